# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of several machines by one worker of a cluster, and by two."""

from collections.abc import Callable
from pathlib import Path
import tempfile
import time
from typing import Any

from antenna_drive.fleet import diagnose_fleet, FleetMachine, FleetOptions, machines_of
from antenna_drive.workers import workers
from lab.bench import measuring
from simgap.errors import UserError

_SEED = 20262
# Divisible by both numbers of workers: none is idle while another does the last machine.
MACHINES, QUICK_MACHINES = 4, 2


def measure(repetitions: int, quick: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """
    Measure how much faster two workers diagnose a fleet than one.

    Return wall times [s], two_worker_speedup and the number of machines. Raise UserError where a
    machine cannot be diagnosed, ModuleNotFoundError without dask.distributed.
    """
    from distributed import LocalCluster

    count = QUICK_MACHINES if quick else MACHINES
    times: dict[int, list[float]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        progress('recordings')
        measuring.process('lab', 'trial', '--cases', str(count), '--seed', str(_SEED),
                          '--out', str(folder / 'trial'), '--quiet')
        machines = machines_of(folder / 'trial')
        for turn in range(1 if quick else repetitions):
            for number in (1, 2):
                progress(f'turn {turn + 1}, {number} of 2 workers')
                with LocalCluster(n_workers=number, threads_per_worker=1,
                                  dashboard_address=None) as cluster:
                    times[number].append(_wall_time(
                        machines, folder / f'{turn}-{number}', cluster.scheduler_address))
    return {'machines': count,
            'one_worker_s': measuring.figure(times[1], 's'),
            'two_workers_s': measuring.figure(times[2], 's'),
            'two_worker_speedup': measuring.ratio(times[1], times[2])}


def _wall_time(machines: list[FleetMachine], out: Path, address: str) -> float:
    with workers(1, address) as pool:
        began = time.perf_counter()
        rows = diagnose_fleet(machines, out, FleetOptions(), pool)
        took = time.perf_counter() - began
    for row in rows:
        if row['failure'] is not None:
            raise UserError(f'{row["machine"]}: {row["failure"]}')
    return took
