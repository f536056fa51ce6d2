# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Try designed tests on sealed cases: a third test, or a whole investigation.

Wild cases are drawn and sealed as by `lab trial --wild`. All tests run on the
independent antenna.

  --kind third        cases whose first two recordings leave the answer open (best answer below
                      0.7, or a set of effects that they cannot tell apart) get a third test of
                      30 s by each rule: as `antenna-drive propose` designs it, and the four
                      kinds of the standard programme, of which the best counts in hindsight
  --kind investigate  each case is investigated from nothing by `antenna-drive investigate`, with
                      up to four tests of 30 s, beside a standard programme of three; what counts
                      is the number of tests until an answer is 0.9 sure, and until one test more
                      has confirmed it

Most wild cases leave nothing open after two recordings. Small effects leave more open: with
--largest 0.1, sizes are at most this share of their range. So do short recordings, which also
take less time: with --longest 30, the first two take 10 to 30 s.

A case takes about ten diagnoses. The same command resumes an interrupted trial. What was found is
in DIR/results.jsonl. To continue on another machine, put that file into a new DIR.

For example:
  lab trial-next --cases 40 --pool 400 --seed 71 --out next71 --jobs 8
  lab trial-next --cases 40 --seed 71 --longest 30 --largest 0.1 --out small71 --jobs 8
  lab trial-next --kind investigate --cases 30 --seed 72 --out loops72 --jobs 8
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
import shlex
from typing import Any

from lab.antenna.wild_programme import LONGEST_S, SHORTEST_S
from lab.cli.trial import add_batch_options
from lab.trials import batch, investigations, sealing, third_tests
from lab.trials.further_tests import DURATION_S
from lab.trials.third_tests import RULES
from simgap.command.output import check_options, give, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry

_TOLERANCE = 0.02


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('--kind', choices=('third', 'investigate'), default='third',
                        help='what is tried (default: %(default)s)')
    parser.add_argument('--cases', type=int, required=True, metavar='N',
                        help='number of cases; of --kind third, of open ones')
    parser.add_argument('--pool', type=int, metavar='N',
                        help='number of sealed cases that open ones are looked for among '
                             '(default: ten times --cases)')
    parser.add_argument('--seed', type=int, required=True, metavar='S', help='of the cases')
    parser.add_argument('--largest', type=float, default=1.0, metavar='SHARE',
                        help='largest size of an effect, as a share of its range '
                             '(default: %(default)s)')
    parser.add_argument('--longest', type=float, default=LONGEST_S, metavar='S',
                        help='longest of the first two recordings in seconds '
                             '(default: %(default)g)')
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder of the trial')
    parser.add_argument('--rules', nargs='+', choices=RULES, default=list(RULES), metavar='RULE',
                        help=f'some of {", ".join(RULES)} (default: all)')
    add_batch_options(parser, 'cases')


def run(arguments: argparse.Namespace) -> int:
    """Make the trial, or go on with it, and print what it has shown so far."""
    check_options(arguments, cases=Entry('', 1, whole=True), pool=Entry('', 1, whole=True),
                  seed=Entry('', 0, whole=True), jobs=Entry('', 1, whole=True),
                  largest=Entry('', 0.01, 1.0), longest=Entry('s', SHORTEST_S, LONGEST_S))
    third = arguments.kind == 'third'
    if not third and arguments.pool is not None:
        raise UserError('--pool: does not go with --kind investigate, which takes every case; '
                        'leave it out')
    if not third and arguments.longest != LONGEST_S:
        raise UserError('--longest: does not go with --kind investigate, whose tests all take '
                        f'{DURATION_S:g} s; leave it out')
    drawn = (arguments.pool or 10 * arguments.cases) if third else arguments.cases
    manifest = batch.prepare(arguments.out, drawn, arguments.seed, _TOLERANCE, 200.0,
                             batch.DURATION_S, wild=True, largest=arguments.largest,
                             longest=arguments.longest)
    print(f'{arguments.out}: {drawn} truths sealed, manifest '
          f'{sealing.manifest_seal(manifest)}', flush=True)
    options = shlex.split(arguments.diagnose_options)
    with Progress('cases', arguments.cases, quiet=arguments.quiet) as progress:
        def show(done: int, total: int) -> None:
            progress.update(done)

        if third:
            found = third_tests.run_trial(
                arguments.out, manifest, arguments.cases, arguments.jobs, arguments.time_limit,
                options, arguments.rules, show)
        else:
            found = investigations.run_trial(
                arguments.out, manifest, arguments.jobs, arguments.time_limit, options, show)
    give(found, arguments.json, '\n'.join((_of_rules if third else _of_ways)(found)))
    return 0


def _of_rules(found: Mapping[str, Any]) -> list[str]:
    lines = [f'{found["diagnosed"]} cases diagnosed, {found["open"]} of them open',
             'rule            cases  exact top-1         0.9 sure and right, wrong  '
             'set before, after  rivals  limits exceeded']
    for rule, item in found['rules'].items():
        if item['cases']:
            lines.append(f'{rule:15s} {item["cases"]:5d}  {_share(item["top1"], item["ci95"])}    '
                         f'{"{right}, {wrong}".format(**item["sure"]):27s}'
                         f'{item["median_set_before"]:g}, {item["median_set"]:g}               '
                         f'{item["median_rivals_before"]:g}, {item["median_rivals"]:g}    '
                         f'{item["violations"]}')
    before, promise = found['before'], found['promise']
    if before['cases']:
        lines.append(f'without a third test the first answer was right in {before["right"]} of '
                     f'{before["cases"]} cases')
    if promise['cases']:
        lines.append(f'the true answer was to get {promise["expected"]:.2f} by the proposals of '
                     f'{promise["cases"]} cases; of what unknown left it got '
                     f'{promise["obtained"]:.2f}')
    return lines


def _of_ways(found: Mapping[str, Any]) -> list[str]:
    lines = ['until an answer is 0.9 sure',
             'tests                cases  right                wrong  median until right']
    for way, item in found.items():
        if not item['cases']:
            continue
        for rule, name in (('until_sure', way), ('until_confirmed', f'{way}, confirmed')):
            until = item[rule]
            share = _share(until['right'], until['ci95'])
            middle = ('most never' if until['median_tests'] is None else
                      f'{until["median_tests"]:g} tests, {until["median_seconds"]:g} s')
            lines.append(f'{name:20s} {item["cases"]:5d}  {share}  {until["wrong"]:5d}  {middle}')
    return lines


def _share(value: float, ci95: Sequence[float]) -> str:
    low, high = ci95
    return f'{100.0 * value:3.0f} % ({100.0 * low:3.0f} to {100.0 * high:3.0f})'
