# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Batches: many variants of the saw-tooth test in an executor of the caller.

A task is a group of variants as plain numbers, and its result is statistics alone, so any thread,
process or machine can run it. `main` runs one task and prints its peak memory.
"""

from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
import os
import sys
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import Emulator
from antenna_drive.parameters import Drive
from antenna_drive.parameters.sets import changed
from antenna_drive.physics.arrays import FloatArray
from lab.bench import measuring
import numpy as np

TEST = 'T3a'
DURATION_S = 20.0
# Varied by up to ten percent, with the same factor in both motors.
_VARIED = ('gearbox.half_gap', 'gearbox.stiffness', 'motor.coulomb_torque', 'motor.rotor_inertia')
_SEED = 20260
VARIANTS, QUICK_VARIANTS = 1000, 60
# Variants in one task: enough for the cost of sending it to be negligible.
_GROUP = 10


@dataclass(frozen=True)
class Task:
    """A group of variants."""

    scales: list[list[float]]   # factors on the varied parameters, shape (variants, 4)
    duration_s: float           # of each run


def statistics(task: Task) -> FloatArray:
    """Run a group; return each signal's least, greatest, mean and rms, (variants, signals, 4)."""
    drive = experiments()[TEST].drive()
    return np.array([_statistics(_variant(drive, scales), task.duration_s)
                     for scales in task.scales])


def _variant(drive: Drive, scales: list[float]) -> Drive:
    changes = {}
    for unit in ('motor_1', 'motor_2'):
        for name, scale in zip(_VARIED, scales, strict=True):
            part, _, key = name.partition('.')
            changes[f'{unit}.{name}'] = scale * getattr(getattr(getattr(drive, unit), part), key)
    return changed(drive, changes)


def _statistics(drive: Drive, duration_s: float) -> FloatArray:
    emulator = Emulator(drive)
    least = np.full(len(emulator.names), np.inf)
    greatest = -least
    total = np.zeros_like(least)
    squares = np.zeros_like(least)
    count = 0
    for steps, samples in emulator.chunks(duration_s, every=4):
        values = samples[:, :, 0]
        np.minimum(least, values.min(axis=0), out=least)
        np.maximum(greatest, values.max(axis=0), out=greatest)
        total += values.sum(axis=0)
        squares += np.einsum('ij,ij->j', values, values)
        count += steps.size
    return np.column_stack((least, greatest, total / count, np.sqrt(squares / count)))


def tasks(variants: int, duration_s: float = DURATION_S) -> list[Task]:
    """Return a number of variants as tasks; always the same ones."""
    scales = 1.0 + 0.1 * np.random.default_rng(_SEED).uniform(-1.0, 1.0, (variants, len(_VARIED)))
    return [Task(scales[first:first + _GROUP].tolist(), duration_s)
            for first in range(0, variants, _GROUP)]


def run(work: list[Task], executor: Executor) -> FloatArray:
    """Run all tasks in an executor; return their statistics, shape (variants, signals, 4)."""
    return np.concatenate(list(executor.map(statistics, work)))


def measure(repetitions: int, quick: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """
    Measure the growth of time and memory, and the gain from more cores and a cluster.

    Return two_core_speedup, wall times by variants, duration and executor, peak memory by
    duration, and omitted measurements with the reason.
    """
    variants = QUICK_VARIANTS if quick else VARIANTS
    work = tasks(variants)
    cores = os.cpu_count() or 1
    result: dict[str, Any] = {'variants': variants, 'duration_s': DURATION_S, 'cores': cores,
                              'left_out': {}}
    progress(f'{variants} variants, one thread and {cores}')
    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(cores) as all_cores:
        times = measuring.in_turn({'one': lambda: run(work, one),
                                   'all': lambda: run(work, all_cores)}, repetitions)
        result['one_core_s'] = measuring.figure(times['one'], 's')
        result['all_cores_s'] = measuring.figure(times['all'], 's')
        result['two_core_speedup'] = measuring.ratio(times['one'], times['all'])
        part = max(variants // 4, _GROUP * cores)
        progress('growth with variants and duration')
        grown = {'base': tasks(part), 'variants': tasks(2 * part),
                 'duration': tasks(part, 2.0 * DURATION_S)}
        times = measuring.in_turn({name: partial(run, given, all_cores)
                                   for name, given in grown.items()}, repetitions)
        result['time_at_twice_the_variants'] = measuring.ratio(times['variants'], times['base'])
        result['time_at_twice_the_duration'] = measuring.ratio(times['duration'], times['base'])
        progress('through dask.distributed')
        try:
            result['dask_over_threads'] = _dask(work, all_cores, cores, repetitions)
        except ModuleNotFoundError as error:
            result['left_out']['dask'] = f'{error.name} is not installed'
    progress('memory')
    long_s = 10.0 * DURATION_S if quick else 100.0 * DURATION_S
    memory = [(peak_memory(DURATION_S), peak_memory(long_s)) for _ in range(repetitions)]
    result['peak_memory_MB'] = {
        f'{duration:g} s': measuring.figure([row[k] for row in memory], 'MB')
        for k, duration in enumerate((DURATION_S, long_s))}
    result['memory_ratio'] = measuring.ratio(*zip(*((b, a) for a, b in memory), strict=True))
    return result


def _dask(work: list[Task], threads: Executor, cores: int, repetitions: int) -> dict[str, Any]:
    from dask.distributed import Client

    with Client(n_workers=cores, threads_per_worker=1, dashboard_address=None) as client:
        # For a cluster, only this line changes: Client('tcp://scheduler:8786').
        cluster = client.get_executor()
        same = np.array_equal(run(work, cluster), run(work, threads))
        times = measuring.in_turn({'dask': lambda: run(work, cluster),
                                   'threads': lambda: run(work, threads)}, repetitions)
    return measuring.ratio(times['dask'], times['threads']) | {'same_bits': same}


def peak_memory(duration_s: float) -> float:
    """Return the peak memory of a process that runs one variant [MB]."""
    return measuring.process(__name__, repr(duration_s))[2]


if __name__ == '__main__':
    statistics(Task([[1.0] * len(_VARIED)], float(sys.argv[1])))
