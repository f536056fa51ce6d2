# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Put any method beside others, on machines that another's program simulates.

A method is a command: it gets the folder of a case and writes verdict.json into it. The whole
task, for somebody who knows none of this code, is lab/benchmark/README.md. Making cases needs
MuJoCo (pip install mujoco). The same --entry goes on after a stop, and tries again what failed.
Exit code 1: a case has no verdict.

For example:
  lab benchmark --make 20 --seed 7 --out cases --practice
  lab benchmark --entry 'python -m lab.benchmark.methods.ours' --cases cases --out ours.jsonl
  lab benchmark --entry './my_method --fast' --cases cases --out mine.jsonl
  lab benchmark --score cases ours.jsonl mine.jsonl
"""

import argparse
from collections.abc import Mapping
import math
from pathlib import Path
import shlex
from typing import Any

from lab.benchmark import entries
from lab.benchmark.cases import PRACTICE
from lab.joints.machines import BENCHMARK
from lab.trials import sealing
from simgap.command.output import add_json_option, check_options, give, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry

# The columns of the table: heading, figure of the scorecard.
COLUMNS = {'top-1 single': 'top1', 'pairs': 'pairs_both', 'healthy': 'no_gap_on_none',
           'overconfident': 'overconfident_outside', 'AUROC unknown': 'auroc_unknown',
           'closed': 'closed_held_back_median', 'CPU s': 'seconds_median'}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `lab benchmark`."""
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument('--make', type=int, metavar='N', help='seal N truths, then record the cases')
    what.add_argument('--entry', metavar='CMD', help='run a command on each case')
    what.add_argument('--score', type=Path, metavar='DIR',
                      help='print the table of all results on these cases, and compare them')
    parser.add_argument('results', type=Path, nargs='*', metavar='FILE', help='for --score')
    parser.add_argument('--seed', type=int, metavar='S', help='with --make: seed of the cases')
    parser.add_argument('--out', type=Path, metavar='PATH', help='the cases, or the results')
    parser.add_argument('--practice', action='store_true',
                        help='with --make: cases to practise on, with their truths')
    parser.add_argument('--machine', action='append', choices=sorted(BENCHMARK.values()),
                        help='with --make: default joint; several take turns')
    parser.add_argument('--cases', type=Path, metavar='DIR', help='with --entry: the cases')
    parser.add_argument('--time-limit', type=float, default=1800.0, metavar='S',
                        help='with --entry: for one case [s] (default %(default)g)')
    parser.add_argument('--jobs', type=int, default=1, metavar='N', help='cases at a time')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make cases, enter a method or score several; 1 if a case has no verdict."""
    some = Entry('', 1, whole=True)
    check_options(arguments, seed=Entry('', 0, PRACTICE - 1, whole=True), make=some, jobs=some,
                  time_limit=Entry('s', 1e-3))
    if arguments.score is None:
        return _make(arguments) if arguments.entry is None else _enter(arguments)
    if not arguments.results:
        raise UserError('--score: no results; name the files that --entry CMD --out wrote')
    methods = {path.stem: entries.answered(arguments.score, path) for path in arguments.results}
    if len(methods) < len(arguments.results):
        raise UserError('--score: two files have one name; a name stands for a method')
    found = entries.table(methods)
    give(found, arguments.json, '\n'.join(_lines(found)))
    return int(any(figures['failures'] for figures in found['methods'].values()))


def _needed(arguments: argparse.Namespace, *names: str) -> None:
    for name in names:
        if getattr(arguments, name) is None:
            raise UserError(f'--{name}: is missing; lab benchmark --help has examples')


def _make(arguments: argparse.Namespace) -> int:
    _needed(arguments, 'seed', 'out')
    machines = [name for name, short in BENCHMARK.items()
                if short in (arguments.machine or ['joint'])]
    with Progress('recordings', arguments.make, quiet=arguments.quiet) as progress:
        seal = sealing.manifest_seal(entries.make(
            arguments.out, arguments.make, arguments.seed, machines, arguments.practice,
            arguments.jobs, lambda done, total: progress.update(done)))
    print(f'{arguments.out}: {arguments.make} truths sealed, manifest {seal}')
    return 0


def _enter(arguments: argparse.Namespace) -> int:
    _needed(arguments, 'cases', 'out')
    command = shlex.split(arguments.entry) or ['']
    count = len(sealing.read_manifest(arguments.cases)['seals'])
    with Progress('cases', count, quiet=arguments.quiet) as progress:
        failures = entries.enter(arguments.cases, command, arguments.out, arguments.time_limit,
                                 arguments.jobs, lambda done, total: progress.update(done))
    if failures:
        print(f"{arguments.out}: {failures} of {count} cases have no verdict; 'failure' in their "
              'lines says why')
    return int(failures > 0)


def _lines(found: Mapping[str, Any]) -> list[str]:
    width = max(map(len, found['methods'])) + 2
    lines = [' ' * width + 'cases ' + ''.join(f'{name:>20}' for name in COLUMNS)]
    for name, figures in found['methods'].items():
        bounds = {**figures['ci95'], 'auroc_unknown': figures['auroc_ci95']}
        cells = ''.join(f'{_cell(figures[key], bounds.get(key)):>20}' for key in COLUMNS.values())
        lines.append(f'{name:<{width}}{figures["cases"]:>5} {cells}')
    return lines + ['', 'right on the same cases'] * bool(found['pairs']) + [
        f'{pair["names"][0]} and {pair["names"][1]}: both {pair["both"]} of {pair["cases"]}, '
        f'only the first {pair["first"]}, only the second {pair["second"]}, p = {pair["p"]:.2g}'
        for pair in found['pairs']]


def _cell(value: float, bounds: tuple[float, float] | None) -> str:
    if not math.isfinite(value):
        return '-'
    return f'{value:.2f}' + (f' [{bounds[0]:.2f}, {bounds[1]:.2f}]' if bounds else '')
