# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Run the drive as five ROS 2 processes and compare every sample with a run in this process.

  python examples/five_processes.py

It needs ROS 2; `antenna-drive doctor nodes` says whether it works here.
"""

from __future__ import annotations

from antenna_drive.emulator.run import simulate
from antenna_drive.lockstep.sampling import sample_processes
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
import numpy as np

STEPS, STEP_S = 500, 1e-3
SETTINGS: dict[str, str | float] = {
    'test_signal.rate.waveform': 'square', 'test_signal.rate.amplitude': 8.7e-4,
    'test_signal.rate.period': 0.4}


def main() -> None:
    """Print how many samples there are, and whether they are equal to the last bit."""
    sampled = sample_processes(STEPS, STEP_S, settings=SETTINGS)
    run = simulate(changed(load(), SETTINGS), STEPS * STEP_S, STEP_S)
    equal = sampled.names == run.names and np.array_equal(sampled.samples, run.samples)
    print(f'{sampled.processes} processes, {sampled.samples.size} numbers, '
          f'{"all" if equal else "not all"} equal to the last bit')


if __name__ == '__main__':
    main()
