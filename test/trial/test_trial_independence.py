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
HOUSES = ('antenna_drive', 'lab', 'simgap')
ANTENNA = ('lab.antenna', 'simgap.errors')
# what starts processes and reports errors knows nothing of any drive
ALLOWED = (*ANTENNA, 'lab.benchmark', 'lab.joints', 'lab.trials', 'antenna_drive.workers',
           'antenna_drive.programs', 'antenna_drive.remedies', 'antenna_drive.ros_releases',
           'antenna_drive.subcommand',
           'simgap.command.programs', 'simgap.command.remedies')
# what diagnoses, and is loaded by a diagnosis alone
MODELS = [LAB / 'joints' / 'models', LAB / 'benchmark' / 'methods']
SOURCES = [(source, ANTENNA if room == 'antenna' else ALLOWED)
           for room in ('antenna', 'benchmark', 'joints', 'trials')
           for source in sorted((LAB / room).rglob('*.py'))
           if source.parent not in MODELS and source.stem not in ('models', 'days')]


@pytest.mark.parametrize('source, allowed', SOURCES,
                         ids=[str(source.relative_to(LAB)) for source, _ in SOURCES])
def test_source_imports_nothing_of_the_emulator(source: Path, allowed: tuple[str, ...]) -> None:
    for node in ast.walk(ast.parse(source.read_text())):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{source.name}: a relative import'
            names = [node.module or '']
        for name in names:
            if name.split('.')[0] in HOUSES:
                assert name.startswith(allowed), f'{source.name} imports {name}'
                assert 'models' not in name.split('.'), f'{source.name} imports {name}'


def test_nothing_of_the_emulator_is_loaded_with_it() -> None:
    program = (
        'import sys, lab.trials.batch, lab.trials.scorecard\n'
        'print(*[name for name in sys.modules if name.count(".") and\n'
        '       name.split(".")[0] in ("antenna_drive", "lab", "simgap")])')
    loaded = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                            check=True).stdout.split()
    assert 'lab.antenna.equations' in loaded
    assert 'lab.joints.mechanism' in loaded
    assert [name for name in loaded if '.models' in name] == []
    of_packages = ('simgap.command',)   # an empty __init__
    assert [name for name in loaded
            if not name.startswith(ALLOWED) and name not in of_packages] == []
