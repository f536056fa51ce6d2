# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Simulate many variants of the drive on all cores, or on a cluster.

  python examples/variants.py
  python examples/variants.py tcp://host:8786      # workers of a dask.distributed scheduler

The question: how much current does a worn gearbox cost? Its gap is varied from half to three times
the configured one.
"""

import os
import sys

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import simulate
from antenna_drive.parameters.sets import changed
from antenna_drive.workers import workers

FACTORS = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]


def largest_current(factor: float) -> float:
    """Return the largest current of motor 1 under a saw-tooth [article A]."""
    drive = experiments()['T3b'].drive()
    gap = factor * drive.motor_1.gearbox.half_gap
    worn = changed(drive, {'motor_1.gearbox.half_gap': gap, 'motor_2.gearbox.half_gap': gap})
    return float(abs(simulate(worn, duration=10.0)['motor_1/current']).max())


def main(scheduler: str | None = None) -> None:
    """Print a line for each variant, as they come."""
    with workers(os.cpu_count() or 1, scheduler) as pool:
        for number, result in pool.each(largest_current, ((factor,) for factor in FACTORS)):
            print(f'gap times {FACTORS[number]:g}: up to {result():.3f} A')


if __name__ == '__main__':
    main(*sys.argv[1:2])
