# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Measure the error of the lock-step against a converged run, by macro-step.

For each macro-step the command shows the rms error of the worst signal in each of the article's
experiments, in percent of the signal's rms. It also shows the gain k' of Filter 1 at which the
torque bias becomes unstable: 145.4 when converged, less with a delay between the units.
"""

import argparse
from typing import Any

from simgap.command.output import add_json_option, give, Progress

_DEFAULT_STEPS = (5e-4, 1e-3, 2e-3, 4e-3)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--step', type=float, action='append', metavar='S',
                        help='macro-step [s]; must divide 4 ms; may be repeated '
                             '(default: 0.5, 1, 2 and 4 ms)')
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    from antenna_drive.article.experiments import experiments
    from antenna_drive.article.stability import simulated_limit
    from antenna_drive.emulator.run import FINE_STEP
    from antenna_drive.parameters import load
    from lab.bench.accuracy import distances
    from simgap.errors import UserError

    steps = args.step or list(_DEFAULT_STEPS)
    for step_s in steps:
        parts = 4e-3 / step_s if step_s > 0.0 else 0.0
        if parts < 0.5 or abs(parts - round(parts)) > 1e-6:
            raise UserError(f'--step {step_s:g}: 0.004 s must be a multiple of it')
    names = list(experiments())
    drive = load('old_circuit')
    pole = drive.torque_share.filter_1.pole
    table: list[dict[str, Any]] = []
    with Progress('accuracy', len(steps) * len(names)) as progress:
        for number, step_s in enumerate(steps):
            found = []
            for place, name in enumerate(names):
                found += distances(step_s, [name])
                progress.update(number * len(names) + place + 1)
            table.append({
                'step_s': step_s, 'stability_limit': simulated_limit(drive, pole, step_s),
                'worst': {name: max(((item.share, item.signal) for item in found
                                     if item.experiment == name)) for name in names},
                'distances': [{'experiment': item.experiment, 'signal': item.signal,
                               'rms_share': item.share} for item in found]})
    lines = ["rms error of the worst signal in percent of its rms; limit of k' [1/s]",
             f'{"step [ms]":>9}  ' + '  '.join(f'{name:>6}' for name in names) + '   limit']
    for row in table:
        shares = '  '.join(f'{100 * row["worst"][name][0]:6.3f}' for name in names)
        lines.append(f'{1e3 * row["step_s"]:9.2f}  {shares}  {row["stability_limit"]:6.1f}')
    give({'reference_step_s': FINE_STEP, 'steps': table}, args.json, '\n'.join(lines))
    return 0
