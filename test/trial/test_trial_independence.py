# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The real antenna shares no code with what it is to test."""

from __future__ import annotations

import ast
from pathlib import Path
import subprocess
import sys

import lab.antenna as trial
import pytest

PACKAGE = Path(trial.__file__).parent
# what starts processes and reports errors knows nothing of any drive
ALLOWED = ('lab.antenna', 'simgap.errors', 'antenna_drive.workers',
           'antenna_drive.subcommand', 'simgap.command.programs', 'simgap.command.remedies')


# models that diagnose, which only a diagnosis loads
MODELS = PACKAGE / 'others' / 'models'
SOURCES = sorted(path for path in PACKAGE.rglob('*.py') if path.parent != MODELS)


@pytest.mark.parametrize('source', SOURCES,
                         ids=lambda path: str(path.relative_to(PACKAGE)))
def test_source_imports_nothing_of_the_emulator(source: Path) -> None:
    for node in ast.walk(ast.parse(source.read_text())):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{source.name}: a relative import'
            names = [node.module or '']
        for name in names:
            if name.split('.')[0] == 'antenna_drive':
                assert name.startswith(ALLOWED), f'{source.name} imports {name}'
                assert 'models' not in name.split('.'), f'{source.name} imports {name}'


def test_nothing_of_the_emulator_is_loaded_with_it() -> None:
    program = (
        'import sys, lab.trials.batch, lab.trials.scorecard\n'
        'print(*[name for name in sys.modules if name.startswith("antenna_drive.")])')
    loaded = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                            check=True).stdout.split()
    assert 'lab.antenna.equations' in loaded
    assert 'lab.joints.mechanism' in loaded
    assert [name for name in loaded if '.models' in name] == []
    assert [name for name in loaded if not name.startswith(ALLOWED)] == []
