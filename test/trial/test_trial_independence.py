# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The real antenna shares no code with what it is to test."""

from __future__ import annotations

import ast
from pathlib import Path
import subprocess
import sys

import lab
import pytest

LAB = Path(lab.__file__).parent
# The drivers start diagnoses as processes. What starts processes and reports errors knows nothing
# of any drive.
DRIVERS = ('batch.py', 'third_tests.py', 'investigations.py', 'left_out.py', 'scorecard.py',
           'scored_cases.py', 'sealing.py', 'verdict.py', 'results.py', 'pictures.py',
           'further_tests.py', 'held_back.py')
MACHINES = sorted(path for room in ('antenna', 'joints') for path in (LAB / room).glob('*.py'))
SOURCES = [*MACHINES, *(LAB / 'trials' / name for name in DRIVERS)]
ALLOWED = ('simgap.errors',)
ALLOWED_TO_DRIVERS = (*ALLOWED, 'antenna_drive.workers', 'antenna_drive.subcommand',
                      'simgap.command.programs', 'simgap.command.remedies')


@pytest.mark.parametrize('source', SOURCES,
                         ids=lambda path: str(path.relative_to(LAB)))
def test_source_imports_nothing_of_the_emulator(source: Path) -> None:
    for node in ast.walk(ast.parse(source.read_text())):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{source.name}: a relative import'
            names = [node.module or '']
        for name in names:
            if name.split('.')[0] in ('antenna_drive', 'simgap'):
                assert name.startswith(ALLOWED if source in MACHINES else ALLOWED_TO_DRIVERS), (
                    f'{source.name} imports {name}')
            assert 'models' not in name.split('.'), f'{source.name} imports {name}'


def test_nothing_of_the_emulator_is_loaded_with_it() -> None:
    program = (
        'import sys, lab.trials.batch, lab.trials.scorecard\n'
        'print(*[name for name in sys.modules if name.startswith(("antenna_drive.", "simgap.", "lab."))])')
    loaded = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                            check=True).stdout.split()
    assert 'lab.antenna.equations' in loaded
    assert 'lab.joints.mechanism' in loaded
    assert [name for name in loaded if '.models' in name] == []
    assert [name for name in loaded if not name.startswith(
        ('lab.', 'simgap.command', *ALLOWED_TO_DRIVERS))] == []
