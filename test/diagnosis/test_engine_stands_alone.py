# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Three houses: the engine knows no machine, and the drive knows no laboratory."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
import re
import subprocess
import sys

import antenna_drive
import pytest
import simgap

ENGINE, DRIVE = (Path(house.__file__ or '').parent for house in (simgap, antenna_drive))
EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'
# what importing the engine may load, and what is loaded only where it is needed
ALWAYS = {'numpy', 'scipy'}
LATE = {'threadpoolctl', 'yaml', 'jinja2', 'markupsafe', 'numba', 'mujoco', 'fmpy', 'pyarrow',
        'mcap', 'mcap_protobuf', 'rosbags', 'zstandard'}
# of the antenna: `axis=` is numpy's, and a plot has axes
MACHINE_WORDS = re.compile(r'antenna|motor_[12]|\baxis\b(?!=)|tach_|wind_gust|elevation')
NOTICE = 'The antenna_drive authors'


def sources(house: Path) -> list[Path]:
    return sorted(path for path in house.rglob('*.py') if 'build' not in path.parts)


def imported(source: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(source.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split('.')[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{source.name}: a relative import'
            yield (node.module or '').split('.')[0]


def loaded_by(program: str) -> set[str]:
    done = subprocess.run(
        [sys.executable, '-c', f'import sys\n{program}\nprint(*sys.modules)'],
        capture_output=True, text=True, check=True)
    return {name.split('.')[0] for name in done.stdout.split()}


@pytest.mark.parametrize('source', sources(ENGINE), ids=lambda path: f'{path.parent.name}/'
                                                                     f'{path.name}')
def test_the_engine_imports_no_other_house(source: Path) -> None:
    assert set(imported(source)) <= {'simgap'} | ALWAYS | LATE | sys.stdlib_module_names


@pytest.mark.parametrize('source', sources(DRIVE), ids=lambda path: f'{path.parent.name}/'
                                                                    f'{path.name}')
def test_the_drive_imports_nothing_of_the_laboratory(source: Path) -> None:
    assert 'lab' not in set(imported(source))


def test_a_diagnosis_of_any_machine_loads_no_drive_and_no_extra() -> None:
    loaded = loaded_by(f'import simgap\nsimgap.load_model({str(EXAMPLES)!r} '
                       '"/robot_joint/first.py")\n'
                       'simgap.read_logs, simgap.check, simgap.diagnose, simgap.propose, '
                       'simgap.investigate, simgap.Verdict, simgap.Proposal')
    assert {'simgap', 'scipy'} <= loaded
    assert not loaded & ({'antenna_drive', 'lab'} | LATE - {'threadpoolctl'})


def test_a_name_is_loaded_when_it_is_used() -> None:
    assert 'numpy' not in loaded_by('import simgap.errors, simgap')
    assert all(getattr(simgap, name) for name in simgap.__all__)
    with pytest.raises(AttributeError, match='no attribute .verdicts.'):
        _ = simgap.verdicts


@pytest.mark.parametrize('source', [
    *sources(ENGINE), *(ENGINE / 'report' / 'templates').glob('*.html'), ENGINE / 'README.md'],
    ids=lambda path: f'{path.parent.name}/{path.name}')
def test_the_engine_speaks_of_no_machine(source: Path) -> None:
    text = source.read_text(encoding='utf-8').replace(NOTICE, '')
    assert MACHINE_WORDS.findall(text) == []
