# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make a trial of the diagnosis: sealed cases from an independent 'real antenna'.

The antenna is a second program for the same drive. It shares no code with the emulator and has
its own integrator and its own form of every effect. Each case is one antenna, whose parameters
deviate by up to --tolerance, with three recordings through noisy sensors. 55 percent of the
cases have one effect of the catalogue, 15 percent two, 15 percent none, and 15 percent one that
is not in the catalogue.

  DIR/manifest.json              settings, and a salted hash of the truth of each case
  DIR/truth/case_0001.json       the effects of that antenna; no diagnosis reads it
  DIR/case_0001/rec_a.csv .yaml  recording and test sheet; also rec_b and rec_c

The hash of the manifest is printed before any recording is made. Note it down to prove later
that no truth was changed. With --diagnose each case is diagnosed too, and the verdict is written
to DIR/case_0001/verdict.json; `lab score DIR` scores the verdicts. The same command
resumes an interrupted trial. On another machine, --skip leaves out the cases that a file of
`lab score --cases` holds; the file and DIR are scored together then.

With --wild, each case also has the imperfections of a real machine and recorder, which no sheet
lists, and other programmes, lengths, rates and sheets. A fourth recording is kept from the
diagnosis, in DIR/kept/case_0001/rec_d.csv. lab/notebook/trial.md has the sizes. --family b draws
other forms, outsiders and programmes; --family c adds what days and loggers bring. Both are to
report on only.

With --machine joint, --machine axis or both, the machines are a robot joint and a linear axis.
Each is diagnosed with a model of one's own (docs/own-machine.md). Their cases always have the
imperfections of a wild one.

With --days, joints and axes are recorded on three days, and diagnosed, see lab/notebook/days.md.

With --scheduler, the workers of a cluster make and diagnose the cases. DIR must lie on a disk
that they all have under the same path.

For example:
  lab trial --cases 200 --seed 7 --out trial7 --diagnose && lab score trial7
  lab trial --wild --cases 20 --seed 7 --out wild7 --diagnose
  lab trial --wild --cases 20 --seed 7 --out rest7 --diagnose --skip wild7.jsonl
  lab trial --machine joint --machine axis --cases 60 --seed 7 --out other7 --diagnose
  lab trial --days --cases 30 --seed 7 --out days7
"""

import argparse
import os
from pathlib import Path
import shlex

from antenna_drive.cli.options import add_diagnosis_options, add_worker_options
from lab.antenna.family import FAMILIES
from lab.joints.machines import MACHINES
from lab.trials import batch, days, sealing
from lab.trials.scored_cases import read_scored_of
from simgap.command.output import add_json_option, check_options, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry

RATES_HZ = (50.0, 500.0)
USUAL_RATE_HZ = 200.0
LARGEST_TOLERANCE = 0.05
USUAL_TOLERANCE = 0.02


def add_sealed_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of every sealed trial: how many cases, which ones, and where to."""
    parser.add_argument('--cases', type=int, required=True, metavar='N', help='number of cases')
    parser.add_argument('--seed', type=int, required=True, metavar='S',
                        help='seed of the cases; for a published figure use one that nothing '
                             'was tuned on')
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder of the trial')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `lab trial`."""
    add_sealed_options(parser)
    parser.add_argument('--machine', action='append', choices=('antenna', *MACHINES),
                        help='machine of the cases (default: antenna); joint and axis may be '
                             'given both, and take turns')
    parser.add_argument('--tolerance', type=float, metavar='T',
                        help='largest relative deviation of each parameter from the reference, '
                             f'0 to {LARGEST_TOLERANCE} (default {USUAL_TOLERANCE})')
    parser.add_argument('--sample-rate', type=float, metavar='HZ',
                        help='mean sample rate of the recordings, 50 to 500 '
                             f'(default {USUAL_RATE_HZ:g}; a wild case draws its own)')
    parser.add_argument('--wild', action='store_true',
                        help='draw imperfections that no sheet lists, and other programmes')
    parser.add_argument('--family', choices=sorted(FAMILIES), default='a',
                        help='forms of effects, outsiders and programmes; nothing may be tuned '
                             'on b, which needs --wild (default %(default)s)')
    parser.add_argument('--days', action='store_true',
                        help='ask whether verdicts of several days agree; takes no other option')
    add_worker_options(parser, os.cpu_count() or 1)
    parser.add_argument('--skip', type=Path, metavar='FILE',
                        help='make and diagnose no case that this file of `lab score '
                             '--cases` holds')
    parser.add_argument('--diagnose', action='store_true', help='diagnose each case as well')
    add_diagnosis_options(parser, '--config my.yaml')
    parser.add_argument('--quiet', action='store_true', help='show no progress')


def add_batch_options(parser: argparse.ArgumentParser, of: str) -> None:
    """Add what commands share that diagnose many cases; `of` is what `--jobs` counts."""
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1, metavar='N',
                        help=f'{of} at a time (default: %(default)s here)')
    add_diagnosis_options(parser, '--config my.yaml')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the cases and diagnose them if requested; 1 if a diagnosis failed."""
    _check(arguments)
    folder = arguments.out
    if arguments.days:
        found = days.run_trial(folder, arguments.cases, arguments.seed, arguments.jobs)
        print('\n'.join(f'{name}: {share.value:.2f} ({share.low:.2f} to {share.high:.2f}) '
                        f'of {share.cases}' for name, share in found.items()))
        return 0
    manifest = batch.prepare(
        folder, arguments.cases, arguments.seed,
        USUAL_TOLERANCE if arguments.tolerance is None else arguments.tolerance,
        arguments.sample_rate or USUAL_RATE_HZ, batch.DURATION_S, wild=arguments.wild,
        family=arguments.family, machines=_others(arguments))
    print(f'{folder}: {arguments.cases} truths sealed, manifest '
          f'{sealing.manifest_seal(manifest)}', flush=True)
    skipped = set() if arguments.skip is None else {
        case.truth['case'] for case in read_scored_of(arguments.skip, folder)}
    count = arguments.cases - len(skipped)
    with Progress('recordings', count, quiet=arguments.quiet) as progress:
        batch.make_cases(folder, manifest, arguments.jobs,
                         lambda done, total: progress.update(done), arguments.scheduler, skipped)
    print(f'{folder}: {count} cases complete', flush=True)
    if not arguments.diagnose:
        return 0
    with Progress('diagnoses', count, quiet=arguments.quiet) as progress:
        failures = batch.diagnose_cases(
            folder, manifest, arguments.jobs, shlex.split(arguments.diagnose_options),
            arguments.time_limit, lambda done, total: progress.update(done),
            arguments.scheduler, skipped)
    if failures:
        print(f'{folder}: {failures} diagnoses failed, see {batch.FAILURE} in their folders; '
              'run the same command to try them again')
    return 1 if failures else 0


def _others(arguments: argparse.Namespace) -> list[str]:
    """Return the machines of the trial other than the antenna, each once."""
    return [name for name in MACHINES if name in (arguments.machine or ())]


def _check(arguments: argparse.Namespace) -> None:
    check_options(
        arguments, cases=Entry('', 1, whole=True), seed=Entry('', 0, whole=True),
        jobs=Entry('', 1, whole=True), tolerance=Entry('1', 0.0, LARGEST_TOLERANCE),
        sample_rate=Entry('Hz', *RATES_HZ), time_limit=Entry('s', 1e-3))
    if _others(arguments):
        for option, value in (('--wild', arguments.wild), ('--family b', arguments.family != 'a'),
                              ('--tolerance', arguments.tolerance is not None),
                              ('--sample-rate', arguments.sample_rate is not None),
                              ('--machine antenna', 'antenna' in arguments.machine)):
            if value:
                raise UserError(f'{option}: does not go with --machine '
                                f'{_others(arguments)[0]}; leave it out')
    if arguments.family != 'a' and not arguments.wild:
        raise UserError(f'--family {arguments.family}: its cases are wild; give --wild as well')
    if arguments.wild and arguments.sample_rate is not None:
        raise UserError('--sample-rate: a wild case draws its own; leave it out, or --wild')
