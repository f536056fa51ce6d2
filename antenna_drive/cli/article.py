# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Repeat the article's experiments and compare every published figure with the model's.

  antenna-drive article                        the comparison as a table
  antenna-drive article --json -               rows and contradictions as JSON
  antenna-drive article --figures figures      draw the figures from new runs
  antenna-drive article --config reference     use another parameter set
  antenna-drive article --through-nodes        run T3a, T3b, T4a, T4e in five ROS 2 processes

A row passes if the obtained figure is within the tolerance of the published one. Where the
article gives both a field and an analysis figure, the analysis counts. The basis of a row says
what a pass proves: published (the article's own numbers in its own equation), derived (a
parameter was computed from the figure), fitted (the shipped parameter sets were fitted to it)
or predicted. Currents are in the article's amperes. The exit code is 1 if a row fails.
"""

import argparse
from collections import Counter
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

from antenna_drive.article.contradictions import Contradiction, contradictions
from antenna_drive.article.experiments import DriveExperiment
from antenna_drive.article.measures import Results, with_circuits
from antenna_drive.article.published import Row, rows
from antenna_drive.emulator.run import MACRO_STEP, Run, simulate
from antenna_drive.parameters import Drive
import numpy as np
from simgap.command.output import add_json_option, give, Progress, replaced
from simgap.command.programs import NEGATIVE, OK

# The default parameter set.
CONFIGURATION = 'dss26'
# The experiments whose rows are shown; all if empty.
EXPERIMENTS: tuple[str, ...] = ()
# The experiments that --through-nodes runs in five processes.
THROUGH_NODES = ('T3a', 'T3b', 'T4a', 'T4e')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_json_option(parser)
    parser.add_argument('--figures', metavar='DIR', type=Path,
                        help='write each figure to DIR as SVG, and figures.html with all of them')
    parser.add_argument('--through-nodes', action='store_true',
                        help=f'run {", ".join(THROUGH_NODES)} through the five ROS 2 processes')
    parser.add_argument('--config', metavar='SET', nargs='+', default=[CONFIGURATION],
                        help='parameter set: a name in config/ or a file; later ones override '
                             f'earlier ones (default: {CONFIGURATION})')


def run(arguments: argparse.Namespace) -> int:
    results = Results(with_circuits(*arguments.config), run=partial(
        _through_nodes, arguments.config) if arguments.through_nodes else None)
    with Progress('experiments', 1.0) as shown:
        found = rows(results, EXPERIMENTS,
                     lambda done, total: shown.update(done / total))
    if arguments.through_nodes:
        found = [replace(row, note=f'{row.note}; through five ROS 2 processes')
                 if row.id.partition('.')[0] in THROUGH_NODES else row for row in found]
    disagreements = contradictions(results)
    if arguments.figures is not None:
        _draw(results, arguments.figures)
    give({'configuration': list(arguments.config),
          'rows': [asdict(row) for row in found],
          'contradictions': [asdict(entry) for entry in disagreements]},
         arguments.json, _text(found, disagreements))
    return OK if all(row.passed for row in found) else NEGATIVE


def _through_nodes(configuration: list[str], experiment: DriveExperiment, drive: Drive) -> Run:
    """Run one of THROUGH_NODES in five processes, and any other in this one."""
    from antenna_drive.lockstep.sampling import sample_processes

    if experiment.name not in THROUGH_NODES:
        return simulate(drive, experiment.duration)
    steps = round(experiment.duration / MACRO_STEP)
    with Progress(f'{experiment.name}, five processes', steps) as shown:
        sampled = sample_processes(
            steps, MACRO_STEP, name='article', settings=experiment.settings,
            config=[*configuration, experiment.circuit], progress=shown.update)
    return Run(MACRO_STEP, np.arange(steps + 1), sampled.names, sampled.samples)


def _draw(results: Results, folder: Path) -> None:
    from antenna_drive.article.figures import draw_all

    folder.mkdir(parents=True, exist_ok=True)
    with Progress('figures', 1.0) as shown:
        files = draw_all(results, lambda done, total: shown.update(done / total))
    for name, content in files.items():
        with replaced(folder / name) as stream:
            stream.write(content)


def _text(found: list[Row], disagreements: list[Contradiction]) -> str:
    lines = [_LINE.format('', 'row', 'obtained', 'published', 'tolerance', 'unit', 'basis')]
    lines += [_LINE.format('' if row.passed else 'FAILS', row.id, f'{row.obtained:.4g}',
                           _published(row), f'{row.tolerance:.3g}' if row.tolerance else '',
                           row.unit, row.basis) for row in found]
    bases = ', '.join(f'{count} {basis}' for basis, count in
                      Counter(row.basis for row in found).most_common())
    lines.append(f'\n{sum(row.passed for row in found)} of {len(found)} rows pass; {bases}\n')
    for entry in disagreements:
        lines.append(f'{entry.id}: {entry.passages}')
        lines += [f'  {"fits" if item.fits else "    "}  {item.reading}: '
                  + ', '.join(f'{name} {value:.4g}' for name, value in item.gives.items())
                  for item in entry.readings]
        lines.append(f'  {entry.conclusion}\n')
    return '\n'.join(lines)


_LINE = '{:<6}{:<22}{:>10}  {:<32}{:>10}  {:<12}{}'


def _published(row: Row) -> str:
    if isinstance(row.published, (str, float)):
        return str(row.published)
    return ', '.join(f'{value:g} ({origin})' for origin, value in row.published.items())
