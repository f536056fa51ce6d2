# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Score the verdicts of a trial against its truths.

Reads DIR/case_*/verdict.json, which `antenna-drive diagnose --json` writes, and the truths of the
trial, and checks each truth against its seal. A case whose diagnosis failed counts as wrong. A
case that was not diagnosed yet is pending and not scored.

--cases writes the cases with their answers into one small file. Such a file can be published and
scored again, alone or together with others and with folders; a trial may be continued in another
folder (`lab trial --skip`).

lab/notebook/trial.md defines every figure. The exit code is 1 if there is no verdict to score.

For example:
  lab score trial7
  lab score trial7 --json score.json --picture score.png
  lab score trial7 --cases trial7.jsonl
  lab score trial7.jsonl trial8
"""

import argparse
from collections.abc import Sequence
import json
import math
from pathlib import Path
from typing import Any

from lab.antenna.cases import Truth
from lab.trials.scorecard import Case, read_cases, score
from lab.trials.scored_cases import case_lines, identity, read_scored, SUFFIX
from simgap.command.output import add_json_option, give, replaced
from simgap.errors import UserError

# The figures in the order of the table, with their targets.
TARGETS = {
    'cases': '', 'failures': '0', 'pending': '0', 'top1': '>= 0.90', 'top3': '>= 0.97',
    'within_set': '', 'pairs_both': '>= 0.75', 'no_gap_on_none': '>= 0.97',
    'auroc_unknown': '>= 0.95', 'overconfident_outside': '<= 0.05', 'ece': '<= 0.05',
    'explained_fraction_median': '>= 0.95', 'seconds_median': '<= 30',
    'detection_rate': '', 'false_alarm_rate': '', 'true_probability_mean': '',
    'sizes_compared': '', 'size_error_median': '', 'size_coverage': '>= 0.90',
    'closed_held_back_median': '>= 0.90'}
# Those of wild cases, where small faults that nobody listed come on top.
WILD_TARGETS = {**TARGETS, 'top1': '>= 0.85', 'top3': '>= 0.95', 'within_set': '>= 0.92',
                'pairs_both': '>= 0.65', 'no_gap_on_none': '>= 0.95',
                'overconfident_outside': '<= 0.03', 'explained_fraction_median': '',
                'seconds_median': ''}
# The targets of a trial of other machines, with a model of 150 lines.
OTHER_TARGETS = {**dict.fromkeys(TARGETS, ''), 'failures': '0', 'pending': '0',
                 'top1': '>= 0.80', 'no_gap_on_none': '>= 0.90', 'auroc_unknown': '>= 0.90',
                 'overconfident_outside': '<= 0.05'}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `lab score`."""
    parser.add_argument('trials', type=Path, nargs='+', metavar='TRIAL',
                        help='folder of a trial, or a file that --cases wrote (.jsonl)')
    add_json_option(parser)
    parser.add_argument('--cases', type=Path, metavar='FILE',
                        help='write the cases with their answers, one line of JSON each (.jsonl)')
    parser.add_argument('--picture', type=Path, metavar='FILE',
                        help='draw confusion matrix and reliability diagram (.png, .pdf, .svg)')


def run(arguments: argparse.Namespace) -> int:
    """Print the scorecard; 1 if there is no verdict to score."""
    if arguments.cases is not None and arguments.cases.suffix != SUFFIX:
        raise UserError(f'--cases {arguments.cases}: the name must end in {SUFFIX}')
    cases, pending = _all_cases(arguments.trials)
    figures = score(cases, pending)
    if arguments.cases is not None:
        with replaced(arguments.cases) as stream:
            stream.writelines(line.encode() for line in case_lines(cases))
    if arguments.picture is not None:
        from lab.trials import pictures  # only a picture needs matplotlib
        try:
            pictures.draw_scorecard(figures, arguments.picture)
        except ValueError as error:
            raise UserError(f'{arguments.picture}: cannot be drawn, {error}') from error
    give(figures, arguments.json, '\n'.join(_lines(figures)))
    return 0 if cases else 1


def _all_cases(trials: Sequence[Path]) -> tuple[list[Case], int]:
    """Return the cases of all trials, and how many are pending; refuses what is there twice."""
    cases: list[Case] = []
    pending: list[str] = []
    seen: dict[str, Path] = {}  # which trial a case is in
    for trial in trials:
        found, waiting = (read_scored(trial), []) if trial.suffix == SUFFIX else read_cases(trial)
        pending += map(_key, waiting)
        cases += found
        for case in found:
            key = _key(case.truth)
            if key in seen:
                raise UserError(f'{trial}: {case.truth.get("case")} is in {seen[key]}, too; give '
                                'each trial once')
            seen[key] = trial
    return cases, sum(key not in seen for key in pending)


def _key(truth: Truth) -> str:
    return json.dumps(identity(truth), sort_keys=True)


def _lines(figures: dict[str, Any]) -> list[str]:
    lines = []
    antenna, all_wild = set(figures['by_machine']) <= {'antenna'}, figures['all_wild']
    targets = OTHER_TARGETS if not antenna else WILD_TARGETS if all_wild else TARGETS
    for name, target in targets.items():
        value = figures[name]
        text = f'{value}' if isinstance(value, int) else _decimal(value)
        low_high = figures['ci95'].get(name)
        if low_high and math.isfinite(low_high[0]):
            text += f'  [{_decimal(low_high[0])}, {_decimal(low_high[1])}]'
        lines.append(f'{name:<26} {text:<28} {"target " + target if target else ""}'.rstrip())
    healthy = figures['site']['healthy']
    lines += ['', f'at a site where {healthy:.0%} of the machines are healthy']
    lines += [f'{name:<26} {_decimal(value)}' for name, value in figures['site'].items()
              if name != 'healthy']
    for title in ('machine', 'kind', 'size', 'effect'):
        lines += ['', f'{"by " + title:<36} cases  failures  top1   top3']
        lines += [f'{label:<36} {group["cases"]:>5}  {group["failures"]:>8}  '
                  f'{_decimal(group["top1"])}  {_decimal(group["top3"])}'
                  for label, group in figures[f'by_{title}'].items()]
    return lines


def _decimal(value: float) -> str:
    return f'{value:.3f}' if math.isfinite(value) else '    -'
