# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Try designed tests on sealed cases: a third test as proposed, against those of other rules.

Wild cases are drawn and sealed as by `antenna-drive trial --wild`, and their first two recordings
are diagnosed. Cases that these leave open (best answer below 0.7, or a set of two or more) get a
third test of 30 s by each rule: as `antenna-drive propose` designs it, D-optimal, at random, and
the four kinds of the standard programme, of which the best counts in hindsight. All run on the
independent antenna, which also tells whether a limit was exceeded.

A case takes about ten diagnoses. The same command resumes an interrupted trial:

  antenna-drive trial-next --cases 40 --pool 400 --seed 71 --out next71 --jobs 8
"""

from __future__ import annotations

import argparse
from pathlib import Path
import shlex

from antenna_drive.cli.output import check_options, give, Progress
from antenna_drive.cli.sharing import add_batch_options
from antenna_drive.parameters.schema import Entry
from antenna_drive.trial import batch, sealing
from antenna_drive.trial.third_tests import RULES, run_trial

_TOLERANCE = 0.02


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('--cases', type=int, required=True, metavar='N',
                        help='number of open cases that are wanted')
    parser.add_argument('--pool', type=int, required=True, metavar='N',
                        help='number of sealed cases that they are looked for among')
    parser.add_argument('--seed', type=int, required=True, metavar='S', help='of the cases')
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder of the trial')
    parser.add_argument('--rules', nargs='+', choices=RULES, default=list(RULES), metavar='RULE',
                        help=f'some of {", ".join(RULES)} (default: all)')
    add_batch_options(parser, 'cases')


def run(arguments: argparse.Namespace) -> int:
    """Make the trial, or go on with it, and print what it has shown so far."""
    check_options(arguments, cases=Entry('', 1, whole=True), pool=Entry('', 1, whole=True),
                  seed=Entry('', 0, whole=True), jobs=Entry('', 1, whole=True))
    manifest = batch.prepare(arguments.out, arguments.pool, arguments.seed, _TOLERANCE, 200.0,
                             batch.DURATION_S, wild=True)
    print(f'{arguments.out}: {arguments.pool} truths sealed, manifest '
          f'{sealing.manifest_seal(manifest)}', flush=True)
    with Progress('third tests', arguments.cases, quiet=arguments.quiet) as progress:
        found = run_trial(arguments.out, manifest, arguments.cases, arguments.jobs,
                          arguments.time_limit, shlex.split(arguments.diagnose_options),
                          arguments.rules, lambda done, total: progress.update(done))
    lines = [f'{found["diagnosed"]} cases diagnosed, {found["open"]} of them open',
             'rule            cases  exact top-1         set before, after  limits exceeded']
    for rule, item in found['rules'].items():
        if item['cases']:
            low, high = item['ci95']
            lines.append(f'{rule:15s} {item["cases"]:5d}  {100.0 * item["top1"]:3.0f} % '
                         f'({100.0 * low:3.0f} to {100.0 * high:3.0f})    '
                         f'{item["median_set_before"]:g}, {item["median_set"]:g}               '
                         f'{item["violations"]}')
    give(found, arguments.json, '\n'.join(lines))
    return 0
