# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Fit parameters to published or measured figures, and report how well these determine them.

  lab calibrate article --out fitted.yaml
  lab calibrate my_antenna.yaml --start my_drive.yaml --out fitted.yaml --log fit.log

TARGETS lists the free parameters with their bounds, and the target figures with tolerances
and weights; docs/calibration.md describes its form. The search is global and repeatable: the
same seed tries the same candidates. With --log an interrupted search resumes. The exit code is
1 if a target is missed by more than its tolerance.
"""

import argparse
from pathlib import Path
from typing import Any

from antenna_drive.cli.options import add_worker_options
from lab.calibration.problem import read_problem, SHIPPED
from lab.calibration.report import configuration, report
from lab.calibration.search import search
from simgap.command.output import add_json_option, check_options, give, Progress, replaced
from simgap.command.programs import NEGATIVE, OK
from simgap.inputs.schema import Entry

COUNT = 2000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('targets', metavar='TARGETS',
                        help='free parameters and target figures: a file, or a name in '
                             'lab/calibration/')
    parser.add_argument('--start', metavar='CONFIG', default='reference',
                        help='configuration to start from (default: %(default)s)')
    parser.add_argument('--out', metavar='FILE', type=Path, required=True,
                        help='configuration to write')
    parser.add_argument('--log', metavar='FILE', type=Path,
                        help='write every candidate to FILE, and resume from it if it exists')
    parser.add_argument('--seed', type=int, default=1, help='default: %(default)s')
    parser.add_argument('--count', type=int, default=COUNT,
                        help='candidates to try (default: %(default)s)')
    parser.add_argument('--trade-off', metavar='FIGURE', nargs='+', default=[],
                        help='show the least cost of the other targets by the level of each '
                             'FIGURE')
    add_worker_options(parser, 1)
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    check_options(arguments, jobs=Entry('', 1, whole=True))
    shipped = SHIPPED / f'{arguments.targets}.yaml'
    by_name = shipped.is_file() and not Path(arguments.targets).exists()
    problem = read_problem(shipped if by_name else arguments.targets, [arguments.start])
    with Progress('candidates', max(1, arguments.count)) as shown:
        found = search(problem, arguments.count, seed=arguments.seed, log=arguments.log,
                       progress=lambda done, best: shown.update(done),
                       jobs=arguments.jobs, scheduler=arguments.scheduler)
    with replaced(arguments.out) as stream:
        stream.write(configuration(problem, found.best.shares, arguments.start).encode())
    with Progress('uncertainties', 1.0) as shown:
        fitted = report(problem, found, arguments.trade_off, shown.update)
    give(fitted, arguments.json, _text(fitted))
    return OK if all(item['met'] for item in fitted['targets']) else NEGATIVE


def _text(fitted: dict[str, Any]) -> str:
    lines = [f'{fitted["candidates"]} candidates, cost {fitted["start_cost"]:.4g} -> '
             f'{fitted["cost"]:.4g}', '',
             _TARGET.format('', 'target', 'start', 'obtained', 'aim', 'tolerance')]
    for item in fitted['targets']:
        aim = f'{"" if item["kind"] == "value" else item["kind"].replace("_", " ") + " "}'
        lines.append(_TARGET.format(
            '' if item['met'] else 'MISSED', item['figure'], f'{item["start"]:.4g}',
            f'{item["obtained"]:.4g}', f'{aim}{item["aim"]:g}', f'{item["tolerance"]:g}'))
    lines += ['', _PARAMETER.format('', 'parameter', 'value', 'alone', 'with all others')]
    for item in fitted['parameters']:
        lines.append(_PARAMETER.format(
            '' if item['determined'] else 'OPEN', item['name'], f'{item["value"]:.5g}',
            _range(item['conditional']), _range(item['marginal'])))
    lines += ['', 'parameters that can compensate for each other, with their correlation:']
    lines += [f'  {item["first"]} and {item["second"]}: {item["correlation"]:+.2f}'
              for item in fitted['correlations']] or ['  none']
    for figure, curve in fitted['trade_offs'].items():
        lines += ['', f'least cost of the other targets, by {figure}:']
        lines += [f'  {point["level"]:>10.4g}  {point["cost_of_the_others"]:<10.4g}'
                  f'{"misses " + ", ".join(point["missed"]) if point["missed"] else ""}'
                  for point in curve]
    return '\n'.join(lines)


_TARGET = '{:<8}{:<24}{:>10}{:>12}  {:<16}{:>10}'
_PARAMETER = '{:<6}{:<34}{:>12}  {:<26}{:<26}'


def _range(ends: list[float]) -> str:
    return f'{min(ends):.4g} .. {max(ends):.4g}'
