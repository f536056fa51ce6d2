# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Compare the five processes with the emulator in one process, sample by sample.

The drive runs in five ROS 2 processes as fast as it can and once more in this process. Value
and time derivative of every signal at every step must be the same to the last bit. The exit
code is 0 if they are, 1 if not.
"""

import argparse
from typing import Any

from simgap.command.output import add_json_option, give, Progress
from simgap.errors import UserError

_NAME = 'lockstep_check'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--duration', type=float, default=5.0, metavar='S',
                        help='simulated time [s] (default: %(default)s)')
    parser.add_argument('--step', type=float, default=1e-3, metavar='S',
                        help='macro-step [s] (default: %(default)s)')
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration file, or name of a set in config/; may be repeated')
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Run the comparison; return 0 if every sample is the same, 1 if not."""
    steps = round(args.duration / args.step) if args.step > 0.0 else 0
    if steps < 1:
        raise UserError(f'--duration {args.duration:g} --step {args.step:g}: '
                        'allowed is a duration of at least one step, and a step above 0 s')
    result = compare(steps, args.step, args.config)
    give(result, args.json,
         f'{result["samples"]} samples of {steps} steps through {result["processes"]} '
         f'processes: greatest difference {result["max_abs_difference"]:g}, '
         f'{result["real_time_factor"]:.2f} x real time')
    return 0 if result['identical'] else 1


def compare(steps: int, step_s: float, config: list[str]) -> dict[str, Any]:
    """
    Run the drive both ways.

    Returns processes, samples (numbers compared), max_abs_difference, identical, real_time_factor,
    steps_per_s, first_step_s (from the start of the last process to its first step).
    """
    from antenna_drive.emulator.run import simulate
    from antenna_drive.lockstep.sampling import sample_processes
    from antenna_drive.parameters import load
    import numpy as np

    drive = load(*config)
    with Progress('lock-step', steps) as progress:
        five = sample_processes(steps, step_s, config=config, name=_NAME,
                                progress=progress.update)
    one = simulate(drive, steps * step_s, step_s).samples
    difference = float(np.abs(five.samples - one).max())
    return {
        'processes': five.processes,
        'samples': int(one.size),
        'max_abs_difference': difference,
        'identical': five.samples.tobytes() == one.tobytes(),
        'real_time_factor': steps * step_s / five.wall_s,
        'steps_per_s': steps / five.wall_s,
        'first_step_s': five.first_step_s,
    }
