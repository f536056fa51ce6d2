# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
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
