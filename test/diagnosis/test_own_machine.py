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
"""The example of a machine of one's own: one file is enough for a verdict."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

EXAMPLE = Path(__file__).resolve().parents[2] / 'examples' / 'own_machine' / 'cooling_body.py'


def test_the_example_names_its_heater() -> None:
    done = subprocess.run([sys.executable, str(EXAMPLE)], capture_output=True, text=True,
                          check=True)
    assert done.stdout.startswith('explained')
    assert 'heater.step\n' in done.stdout and 'size = 0.2' in done.stdout
    assert done.stderr == ''
