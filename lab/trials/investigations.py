# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A trial of whole investigations: tests and seconds until the answer is sure and right.

The antenna of each sealed case is investigated from nothing by `antenna-drive investigate`, which
designs each test from the verdict on those before. Beside it stands the standard programme: a slow
square wave, a fast triangle and a multisine, diagnosed after one, two and three of them. All tests
take 30 s. An interrupted trial goes on, see `results`.
"""

from collections.abc import Mapping, Sequence
from functools import partial
import json
import math
from pathlib import Path
import shlex
from statistics import median
import sys
from typing import Any

from antenna_drive.subcommand import run_command
from lab.antenna import programme
from lab.antenna.cases import Truth
from lab.trials import sealing
from lab.trials.batch import diagnose_recordings
from lab.trials.driver import Arm, complete, Done, Row
from lab.trials.further_tests import DURATION_S, known, record_test, SURE, with_test
from lab.trials.results import TrialResults
from lab.trials.scorecard import Case, rate
from lab.trials.third_tests import answer_of, RULES
import numpy as np
from simgap.errors import one_line
import yaml

STANDARD = {'square': programme.slow_square, 'triangle': programme.fast_triangle,
            'multisine': programme.multisine}
MOST_TESTS = 4
WAYS = ('designed', 'standard')
_FIRST_PLACE = len(RULES)


def run_trial(folder: Path, manifest: dict[str, Any], jobs: int, limit: float,
              options: Sequence[str] = (),
              done: Done = lambda part, total: None) -> dict[str, Any]:
    """
    Investigate each of the sealed wild cases in both ways, and return what that took (`summary`).

    `limit` [s] holds for each diagnosis of the standard programme, with further `options`, and for
    each step of an investigation. `done` gets the number of complete cases and of all.
    """
    results = TrialResults(folder, manifest)
    complete(list(manifest['seals']), partial(sealing.open_truth, folder, manifest=manifest),
             [Arm(lambda name, row: 'designed' not in row, partial(_designed, folder, limit)),
              Arm(lambda name, row: 'standard' not in row,
                  partial(_standard, folder, limit, options))],
             results, jobs, threads=True, done=done)
    return summary(results)


def _designed(folder: Path, limit: float, truth: Truth) -> Row:
    (folder / truth['case']).mkdir(exist_ok=True)
    return {'kind': truth['kind'], 'truth': sorted(Case(truth, None).effects),
            'designed': _investigated(folder, truth, limit)}


def _standard(folder: Path, limit: float, options: Sequence[str], truth: Truth) -> Row:
    (folder / truth['case']).mkdir(exist_ok=True)
    return {'standard': _after_each(folder / truth['case'], truth, limit, options)}


def _investigated(folder: Path, truth: Truth, limit: float) -> dict[str, Any]:
    """Return the answers after each test of an investigation."""
    case = folder / truth['case']
    out = case / 'investigation'
    sheet = case / 'known.yaml'
    sealing.write_whole(sheet, yaml.safe_dump(known(truth), sort_keys=False))
    by = [sys.executable, '-m', 'lab', 'trial-test', str(folder), truth['case'],
          '--sheet', '{sheet}', '--out', '{out}', '--duration', '{duration}',
          '--number', '{number}']
    said = run_command(['investigate', '--out', str(out), '--sheet', str(sheet), '--by',
                        shlex.join(by), '--max-tests', str(MOST_TESTS), '--until', f'{SURE:g}',
                        # an investigation adds the number of the test
                        '--seed', str(10 * truth['seed'][-1]),
                        '--duration', f'{DURATION_S:g}', '--jobs', '1', '--quiet', '--json',
                        str(case / 'story.json')], 2.0 * MOST_TESTS * limit)
    if not (case / 'story.json').exists():
        return {'failure': one_line(said, 300), 'answers': []}
    story = json.loads((case / 'story.json').read_text(encoding='utf-8'))
    answers = [answer_of(out / f'verdict_{test["test"]}.json', truth) for test in story['tests']]
    if not all(answers):
        return {'failure': 'a verdict cannot be read', 'answers': []}
    return {'ended': story['ended'], 'answers': answers,
            'families': [test['family'] for test in story['tests']]}


def _after_each(case: Path, truth: Truth, limit: float, options: Sequence[str]) -> dict[str, Any]:
    """Return the answers after each test of the standard programme."""
    random = np.random.default_rng([*truth['seed'], 200])
    answers: list[dict[str, Any]] = []
    for place, (name, shape) in enumerate(STANDARD.items(), _FIRST_PLACE):
        sheet = {**known(truth), 'waveform': shape(random)}
        record_test(*with_test(truth, sheet, place), case / f'{name}.csv')
        sealing.write_whole(case / f'{name}.yaml', yaml.safe_dump(sheet, sort_keys=False))
        so_far = list(STANDARD)[:len(answers) + 1]
        verdict = f'standard_{len(so_far)}.json'
        after = ('--after', str(case / f'standard_{len(answers)}.json')) if answers else ()
        said = diagnose_recordings(case, so_far, verdict, limit, (*after, *options))
        answer = answer_of(case / verdict, truth)
        if not answer:
            return {'failure': one_line(said, 300), 'answers': answers}
        answers.append(answer)
    return {'answers': answers}


def until_sure(answers: Sequence[Mapping[str, Any]], alike: int = 1) -> tuple[float, bool]:
    """
    Return how many tests there were until an answer was sure, inf for never, and if it was right.

    Answers are the first ones after each test; the sure one is the last of `alike` equal ones.
    """
    for number, answer in enumerate(answers, 1):
        last = answers[max(number - alike, 0):number]
        if answer['probability'] >= SURE and len(last) == alike and all(
                other['first'] == answer['first'] for other in last):
            return float(number), bool(answer['right'])
    return math.inf, False


def summary(results: TrialResults) -> dict[str, Any]:
    """
    Return what the investigations of a trial took, as far as it has got.

    For each way: `cases`, `after_all`, the share whose last answer is right, and as `until_sure`
    and as `until_confirmed` by the next test, see `_until`. Antennas with an effect from outside
    the catalogue count apart: 'unknown' is never sure.
    """
    found: dict[str, Any] = {}
    for way in WAYS:
        cases = [(results[name]['kind'], results[name][way]['answers'])
                 for name in results if way in results[name]]
        inside = [answers for kind, answers in cases if kind != 'outside' and answers]
        outside = [answers for kind, answers in cases if kind == 'outside' and answers]
        found[way] = {
            'cases': len(inside), 'failures': sum(not answers for _, answers in cases),
            'until_sure': _until(inside, 1), 'until_confirmed': _until(inside, 2),
            'after_all': rate(answers[-1]['right'] for answers in inside).value,
            'outside': len(outside),
            'outside_right': sum(answers[-1]['right'] for answers in outside)}
    return found


def _until(cases: Sequence[Sequence[Mapping[str, Any]]], alike: int) -> dict[str, Any]:
    """
    Return what it took until answers were sure.

    The share of cases whose answer was then `right` with `ci95`, how many were `wrong`, and
    `median_tests` and `median_seconds` until sure and right (None if most cases never were).
    """
    until = [until_sure(answers, alike) for answers in cases]
    share = rate(right for _, right in until)
    middle = median(tests if right else math.inf for tests, right in until) if until else math.inf
    return {'right': share.value, 'ci95': [share.low, share.high],
            'wrong': sum(math.isfinite(tests) and not right for tests, right in until),
            'median_tests': middle if math.isfinite(middle) else None,
            'median_seconds': DURATION_S * middle if math.isfinite(middle) else None}
