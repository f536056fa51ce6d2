# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Times that a user waits for: the import, the first step, the demo."""

from collections.abc import Callable
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any

from lab.bench import measuring
from simgap.errors import UserError

_FIRST_STEP = ('from antenna_drive.emulator.run import Emulator; '
               'from antenna_drive.parameters import load; Emulator(load()).advance(1)')
_STARTS = {
    'interpreter_s': 'pass',
    'libraries_s': 'import numba, numpy',
    'import_s': 'import antenna_drive.emulator.run',
    'second_first_step_s': _FIRST_STEP,
}
_PRINT_TIME = '; import time; print(time.time())'


def measure(repetitions: int, quick: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """
    Measure the starts of separate processes, interleaved.

    Return times from the start of the process to the end of the import or of the first step [s]:
    interpreter_s, libraries_s, import_s, second_first_step_s (compiled before) and
    first_first_step_s (nothing compiled yet); second_over_libraries, and demo_s.
    """
    progress('starts')
    values: dict[str, list[float]] = {name: [] for name in _STARTS}
    for turn in range(repetitions + 1):
        for name, code in _STARTS.items():
            took = _start_time(code)
            if turn:  # the first turn may compile and fill the cache
                values[name].append(took)
    result: dict[str, Any] = {}
    if quick:
        result['left_out'] = {'first start and demo': 'they take long'}
    else:
        progress('starts with nothing compiled')
        with tempfile.TemporaryDirectory() as folder:
            values['first_first_step_s'] = [
                _start_time(_FIRST_STEP, str(Path(folder, str(turn))))
                for turn in range(repetitions)]
        progress('demo')
        demo = [_demo() for _ in range(repetitions)]
        if all(demo):
            values['demo_s'] = [took for took in demo if took]
        else:
            result['left_out'] = {'demo': 'antenna-drive demo cannot be run here'}
    result |= {name: measuring.figure(taken, 's') for name, taken in values.items()}
    result['second_over_libraries'] = measuring.ratio(values['second_first_step_s'],
                                                      values['libraries_s'])
    return result


def _start_time(code: str, cache: str | None = None) -> float:
    began = time.time()
    done = subprocess.run(
        [sys.executable, '-c', code + _PRINT_TIME], capture_output=True, text=True, check=True,
        env={**os.environ, **({'NUMBA_CACHE_DIR': cache} if cache else {})})
    return float(done.stdout) - began


def _demo() -> float | None:
    try:
        with tempfile.TemporaryDirectory() as folder:
            return measuring.process('antenna_drive', 'demo', '--out', folder)[0]
    except UserError:
        return None
