# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
List the thresholds of the diagnosis, and say what halving and doubling them does to a trial.

Without TRIAL the table is printed: name, value, unit, what it decides, which trial set it. With
TRIAL, a folder of `lab trial --diagnose`, every verdict is decided anew from the fits
that it keeps, with each threshold of the verdict halved and doubled. That takes seconds, because
nothing is fitted. Thresholds of the search change the fits themselves: --again runs the first
--cases diagnoses with one of them changed, which takes minutes for each; interrupted, it goes on.
It also tells how long a diagnosis takes with each.

For example:

  lab thresholds
  lab thresholds trial --json -
  lab thresholds trial --again search.singles search.reach --cases 10
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
import json
import math
from pathlib import Path
from statistics import fmean
from typing import Any

from antenna_drive.cli.sharing import add_worker_options
from antenna_drive.workers import workers
from lab.trials import sealing
from lab.trials.batch import diagnose_case, machine_of, model_options, VERDICT
from lab.trials.scorecard import Case, score
from lab.trials.verdict import parse_verdict, read_verdict
from simgap.command.output import add_json_option, check_options, give, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry
from simgap.search.evidence import Evidence
from simgap.settings import DEFAULT, Settings
from simgap.verdict.verdict import which

# Groups whose thresholds act on kept fits; the fits depend on the others.
DECIDED = ('penalty', 'verdict')
FIGURES = ('top1', 'within_set', 'pairs_both', 'no_gap_on_none', 'auroc_unknown',
           'overconfident_outside', 'ece')
# What --again tells besides: it costs time to search more.
MEAN_SECONDS = 'seconds_mean'
FACTORS = {'halved': 0.5, 'doubled': 2.0}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('trial', nargs='?', type=Path, metavar='TRIAL',
                        help='folder of a trial whose cases are diagnosed')
    parser.add_argument('--again', nargs='+', default=[], metavar='NAME',
                        help='thresholds of the search to run diagnoses again with')
    parser.add_argument('--cases', type=int, default=10, metavar='N',
                        help='how many cases --again takes (default: %(default)s)')
    add_worker_options(parser, 2)
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the table, or what changed thresholds do."""
    check_options(arguments, jobs=Entry('', 1, whole=True))
    table = [{'name': name, 'value': value, **item.metadata}
             for name, item, value in DEFAULT.entries()]
    if arguments.trial is None:
        give(table, arguments.json, '\n'.join(
            f'{row["name"]:32s} {row["value"]:<10g} {row["unit"]:20s} '
            f'{row["set_by"]:20s} {row["decides"]}' for row in table))
        return 0
    if arguments.again:
        found = _run_again(arguments)
    else:
        found = _decided_anew(arguments.trial)
    columns = list(found['as they are'])
    lines = [f'{"":44s}' + ''.join(f'{name[:12]:>14s}' for name in columns)]
    lines += [f'{name:44s}' + ''.join(f'{figures[key]:14.3f}' for key in columns)
              for name, figures in found.items()]
    give(found, arguments.json, '\n'.join(lines))
    return 0


def variants(groups: tuple[str, ...]) -> Iterator[tuple[str, Settings]]:
    """Yield the settings with each threshold of these groups halved and doubled."""
    for name, item, value in DEFAULT.entries():
        if name.partition('.')[0] in groups:
            yield from _halved_and_doubled(name, value, item.metadata['unit'])


def _halved_and_doubled(name: str, value: Any, unit: str) -> Iterator[tuple[str, Settings]]:
    for word, factor in FACTORS.items():
        changed = max(1, round(factor * value)) if isinstance(value, int) else factor * value
        if unit == 'probability':
            changed = min(changed, 1.0)
        if changed != value:
            yield f'{name} {word}, {changed:g}', DEFAULT.changed(name, changed)


def _decided_anew(folder: Path) -> dict[str, Mapping[str, float]]:
    manifest = sealing.read_manifest(folder)
    kept: list[tuple[Any, dict[str, Any], Evidence]] = []
    for name in manifest['seals']:
        path = folder / name / VERDICT
        if not path.exists():
            continue
        content = json.loads(path.read_text(encoding='utf-8'))
        try:
            evidence = Evidence.of_data(content['fits'])
        except KeyError as error:
            raise UserError(f'{path}: {error.args[0]}: is missing; diagnose the trial anew with '
                            'this version') from None
        kept.append((sealing.open_truth(folder, name, manifest), content, evidence))
    if not kept:
        raise UserError(f'{folder}: no case is diagnosed; lab trial --diagnose does it')
    return {name: _scored(kept, settings)
            for name, settings in (('as they are', DEFAULT), *variants(DECIDED))}


def _scored(kept: list[tuple[Any, dict[str, Any], Evidence]],
            settings: Settings) -> dict[str, float]:
    """Return the figures of the verdicts that kept fits give with these thresholds."""
    cases = []
    for truth, content, evidence in kept:
        decision = evidence.decide(settings)
        cases.append(Case(truth, parse_verdict({
            **content, 'verdict': decision.word, 'confusable': decision.confusable,
            'which': which(decision, settings.verdict)})))
    figures = score(cases, 0)
    return {key: float(figures[key]) for key in FIGURES}


def _run_again(arguments: argparse.Namespace) -> dict[str, Mapping[str, float]]:
    """Diagnose the first cases again with changed thresholds; what is there is kept."""
    folder: Path = arguments.trial
    manifest = sealing.read_manifest(folder)
    names = list(manifest['seals'])[:arguments.cases]
    known = {name: (value, item.metadata['unit']) for name, item, value in DEFAULT.entries()}
    wanted: dict[str, list[str]] = {'as they are': []}
    for name in arguments.again:
        if name not in known:
            raise UserError(f'--again: {name}: no such threshold; lab thresholds lists them')
        for label, _ in _halved_and_doubled(name, *known[name]):
            wanted[label] = ['--threshold', f'{name}={label.rpartition(" ")[2]}']
    jobs = [(_linked(folder, label, case).absolute(), options, machine_of(folder, case, manifest))
            for label, options in wanted.items() for case in names]
    with (Progress('diagnoses', len(jobs)) as progress,
          workers(arguments.jobs, arguments.scheduler, threads=True) as pool):
        for done, (_, result) in enumerate(pool.each(_diagnose_again, jobs), start=1):
            result()
            progress.update(done)
    found: dict[str, Mapping[str, float]] = {}
    for label in wanted:
        cases = []
        for case in names:
            path = _linked(folder, label, case) / VERDICT
            verdict = read_verdict(path) if path.exists() else None
            cases.append(Case(sealing.open_truth(folder, case, manifest), verdict))
        figures = score(cases, 0)
        seconds = [case.verdict.seconds for case in cases if case.verdict]
        found[label] = {**{key: float(figures[key]) for key in FIGURES},
                        MEAN_SECONDS: fmean(seconds) if seconds else math.nan}
    return found


def _diagnose_again(case: Path, options: list[str], machine: str | None) -> bool:
    return (case / VERDICT).exists() or diagnose_case(
        case, [*model_options(machine), *options], math.inf)


def _linked(folder: Path, label: str, case: str) -> Path:
    """Return a folder for one diagnosis, with links to the case's recordings."""
    if label == 'as they are':
        return folder / case
    place = folder / 'thresholds' / label.replace(', ', '_').replace(' ', '_') / case
    if not place.exists():
        place.mkdir(parents=True)
        for path in (folder / case).glob('rec_*'):
            (place / path.name).symlink_to(path.resolve())
    return place
