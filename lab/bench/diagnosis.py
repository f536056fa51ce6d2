# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Wall time and memory of one diagnosis, from recordings of the independent antenna."""

from collections.abc import Callable
from pathlib import Path
import tempfile
from typing import Any

from lab.bench import measuring

_SEED = 20261


def measure(repetitions: int, quick: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """
    Measure the diagnosis of one case of a trial: three recordings of one antenna.

    Return wall time, processor time and peak memory on two cores, and two_core_speedup, the wall
    time on one core over that on two. Raise UserError where the command fails.
    """
    took: dict[int, list[tuple[float, float, float]]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as folder:
        progress('recordings')
        measuring.process('lab', 'trial', '--cases', '1', '--seed', str(_SEED),
                          '--out', folder, '--quiet')
        case = Path(folder, 'case_0001')
        recordings = [str(path) for path in sorted(case.glob('rec_*.csv'))]
        for turn in range(1 if quick else repetitions):
            for cores, found in took.items():
                progress(f'turn {turn + 1}, {cores} of 2 cores')
                found.append(measuring.process(
                    'antenna_drive', 'diagnose', *recordings, '--jobs', str(cores),
                    '--json', str(Path(folder, 'verdict.json'))))
    wall_s, processor_s, memory_mb = zip(*took[2], strict=True)
    return {'took_s': measuring.figure(wall_s, 's'),
            'processor_s': measuring.figure(processor_s, 's'),
            'peak_memory_MB': measuring.figure(memory_mb, 'MB'),
            'two_core_speedup': measuring.ratio([item[0] for item in took[1]], wall_s)}
