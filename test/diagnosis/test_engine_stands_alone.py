# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The engine knows no machine: it imports no other room, and machines import its face alone."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
import subprocess
import sys

import antenna_drive
import pytest

PACKAGE = Path(antenna_drive.__file__).parent
ENGINE = sorted((PACKAGE / 'diagnosis').glob('*.py'))
MACHINES = sorted((PACKAGE / 'machines').rglob('*.py'))
LIBRARIES = {'numpy', 'scipy', 'threadpoolctl'}


def imported(source: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{source.name}: a relative import'
            yield node.module or ''


@pytest.mark.parametrize('source', ENGINE, ids=lambda path: path.name)
def test_engine_imports_no_other_room(source: Path) -> None:
    for name in imported(source):
        top = name.split('.')[0]
        if top == 'antenna_drive':
            assert name.startswith('antenna_drive.diagnosis') or name == 'simgap.errors'
        else:
            assert top in LIBRARIES | sys.stdlib_module_names, f'{source.name} imports {name}'


def test_nothing_else_is_loaded_with_the_engine() -> None:
    program = ('import sys, antenna_drive.diagnosis\n'
               'print(*[name for name in sys.modules if name.startswith("antenna_drive.")])')
    loaded = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                            check=True).stdout.split()
    assert 'simgap.search.search' in loaded
    assert [name for name in loaded if not name.startswith('antenna_drive.diagnosis')
            and name != 'simgap.errors'] == []


@pytest.mark.parametrize('source', MACHINES, ids=lambda path: f'{path.parent.name}/{path.name}')
def test_machines_reach_the_engine_through_its_face(source: Path) -> None:
    inner = [name for name in imported(source) if name.startswith('antenna_drive.diagnosis.')]
    assert inner == []


@pytest.mark.parametrize('source', ENGINE, ids=lambda path: path.name)
def test_engine_speaks_of_no_machine(source: Path) -> None:
    text = source.read_text().partition('from __future__')[2]
    for word in ('motor_1', 'motor_2', "'motors'", 'tach_', 'encoder', 'elevation', "'start:",
                 "'offset:", 'wind_gust'):
        assert word not in text, f'{source.name} knows of {word}'
