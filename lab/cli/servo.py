# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
Find the effects that a servo's model lacks, and test the result on withheld logs.

DIR holds logs of a position-controlled servo with a pendulum, as the BAM project records them
(JSON). The initial model is a motor with Coulomb and viscous friction. For each pair of gains and
each pair of trajectories, the diagnosis uses only their logs to find the missing effects. The
resulting model then predicts the other logs in open loop. BAM's friction models m1 to m6, refitted
to the same logs with the same effort, do the same. The error is the mean absolute position error
over whole runs, in milliradians. The exit code is 1 if one of BAM's models is better in a split.

For example:

  lab servo logs/
  lab servo logs/ --split gain --runs 500 --jobs 2 --json result.json
  lab servo logs/ --without gearbox.load_dependent_friction --json -
"""

import argparse
from pathlib import Path

from antenna_drive.cli.options import add_worker_options
from simgap.command.output import add_json_option, check_options, give, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('directory', metavar='DIR', help='folder with the logs, *.json')
    parser.add_argument('--split', choices=('gain', 'trajectory', 'both'), default='both',
                        help='what the logs are split by (default: both, one after the other)')
    parser.add_argument('--without', action='append', default=[], metavar='EFFECT',
                        help='leave an effect out of the catalogue; may be repeated')
    parser.add_argument('--runs', type=int, default=2400, metavar='N',
                        help='simulations of the fitted logs per fit (default: 2400); fewer are '
                             'faster but worse for every model')
    add_worker_options(parser, 1)
    parser.add_argument('--keep', metavar='FOLDER',
                        help='write the result of each split to FOLDER; an interrupted run '
                             'resumes from there')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare; 0 if the diagnosis has the lower withheld error in every split, else 1."""
    # the compiled physics loads slowly, so it is imported only here
    from lab.servo.log import read_bam, ServoLog
    from lab.servo.rounds import FitEffort
    from lab.servo.study import directions, SPLITS, study, text

    check_options(arguments, runs=Entry('', 20, whole=True), jobs=Entry('', 1, whole=True))
    folder = Path(arguments.directory)
    if not folder.is_dir():
        raise UserError(f'{folder}: no such folder; a folder with *.json logs is needed')
    paths = sorted(folder.glob('*.json'))
    if not paths:
        raise UserError(f'{folder}: holds no *.json logs')
    tests = [ServoLog.of(path.stem, read_bam(path), folder) for path in paths]
    splits = tuple(SPLITS) if arguments.split == 'both' else (arguments.split,)
    chosen = directions(tests, splits)
    effort = FitEffort(arguments.runs, max(20, arguments.runs // 5))
    with Progress('servo', 1.0) as progress:
        result = study(tests, chosen, effort, arguments.without, arguments.jobs,
                       Path(arguments.keep) if arguments.keep else None,
                       lambda share, doing: progress.update(share), arguments.scheduler)
    give(result, arguments.json, text(result))
    return 0 if all(part['lower_than_best_of_ladder']
                    for part in result['summary'].values()) else 1
