# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The real antenna shares no code with what it is to test."""

from __future__ import annotations

import ast
from pathlib import Path
import subprocess
import sys

import antenna_drive.trial as trial
import pytest

PACKAGE = Path(trial.__file__).parent
# what starts processes and reports errors knows nothing of any drive
ALLOWED = ('antenna_drive.trial', 'antenna_drive.errors', 'antenna_drive.workers',
           'antenna_drive.subcommand', 'antenna_drive.programs', 'antenna_drive.remedies')


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
        'import sys, antenna_drive.trial.batch, antenna_drive.trial.scorecard\n'
        'print(*[name for name in sys.modules if name.startswith("antenna_drive.")])')
    loaded = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                            check=True).stdout.split()
    assert 'antenna_drive.trial.equations' in loaded
    assert 'antenna_drive.trial.others.mechanism' in loaded
    assert [name for name in loaded if '.models' in name] == []
    assert [name for name in loaded if not name.startswith(ALLOWED)] == []
