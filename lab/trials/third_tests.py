# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A trial of designed tests: what a third test tells where two have left several answers.

Of sealed wild cases those are kept whose first two recordings leave the answer open. Each gets a
third test by every rule: as `antenna-drive propose` designs it, and the kinds of the standard
programme. All are recorded on the independent antenna, and the three recordings are diagnosed. An
interrupted trial goes on, see `results`.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
import json
import math
from pathlib import Path
from typing import Any

from antenna_drive.subcommand import run_command
from lab.antenna import programme
from lab.antenna.cases import Truth
from lab.trials import sealing
from lab.trials.batch import diagnose_recordings, make_case
from lab.trials.driver import Arm, complete, Done, Row
from lab.trials.further_tests import DURATION_S, known, reached, record_test, SURE, with_test
from lab.trials.results import TrialResults
from lab.trials.scorecard import Case, rate
from lab.trials.verdict import read_verdict, UNKNOWN, Verdict, VerdictError, VerdictLine
import numpy as np
from simgap.errors import one_line
import yaml

FIRST = ('rec_a', 'rec_b')
# An answer is open below the first probability. Answers with the second one or more are left: no
# verdict gives 'unknown' less than 0.05, and that alone is no second answer.
OPEN, IN_SET = 0.7, 0.06
PROPOSED = 'proposed'
BUILT_IN: Mapping[str, Callable[[np.random.Generator], dict[str, Any]]] = {
    'square': programme.slow_square, 'triangle': programme.fast_triangle,
    'multisine': programme.multisine,
    'chirp': lambda random: programme.chirp(DURATION_S, random)}
RULES = (PROPOSED, *BUILT_IN)
# Rules of published trials that nothing designs by any more.
_FORMER = ('d-optimal', 'random')
TWO = 'two.json'
# Cases for each job that open ones are looked for among: who has finished one takes the next.
_AT_ONCE = 4


def run_trial(folder: Path, manifest: dict[str, Any], wanted: int, jobs: int, limit: float,
              options: Sequence[str] = (), rules: Sequence[str] = RULES,
              done: Done = lambda part, total: None) -> dict[str, Any]:
    """
    Find `wanted` open cases, give each its third tests by `rules`, and return what they told.

    The folder has sealed wild cases; the result is that of `summary`. Each diagnosis, with further
    `options`, and each proposal may take `limit` [s]. `done` gets the numbers of complete and
    wanted open cases.
    """
    names, results = list(manifest['seals']), TrialResults(folder, manifest)
    found: list[str] = []
    work = partial(complete, known=partial(sealing.open_truth, folder, manifest=manifest),
                   results=results, jobs=jobs, threads=True)
    opening = Arm(lambda name, row: 'open' not in row, partial(_opening, folder, limit, options))
    third = [Arm(partial(_lacks, rule), partial(_third_test, folder, rule, limit, options))
             for rule in rules]
    done(0, wanted)
    for first in range(0, len(names), _AT_ONCE * jobs):
        part = names[first:first + _AT_ONCE * jobs]
        work(part, arms=[opening])
        found += [name for name in part if results[name]['open']]
        if len(found) >= wanted:
            break
    work(found[:wanted], arms=third, done=done)
    return summary(results)


def _lacks(rule: str, name: str, row: Row) -> bool:
    return rule not in row.get('tests', {})


def is_open(verdict: Verdict) -> bool:
    """Return whether a verdict leaves the answer open: it is not sure, or names a set."""
    first = verdict.which[0]
    return first.probability < OPEN or _largest_set(verdict) > 1


def set_of(verdict: Verdict) -> int:
    """Return how many answers a verdict leaves, 'unknown' among them."""
    return _left(verdict, verdict.which)


def rivals_of(verdict: Verdict) -> int:
    """Return how many answers a verdict leaves that a test can tell apart: not 'unknown'."""
    return _left(verdict, [entry for entry in verdict.which if entry.effects != {UNKNOWN}])


def _left(verdict: Verdict, entries: Sequence[VerdictLine]) -> int:
    return max(sum(entry.probability >= IN_SET for entry in entries), _largest_set(verdict))


def _largest_set(verdict: Verdict) -> int:
    """Return how many effects the first answer cannot be told from, itself included."""
    return max((len(verdict.confusable_with(effect)) for effect in verdict.which[0].effects),
               default=1)


def _of_two(folder: Path, truth: Truth, limit: float, options: Sequence[str]) -> Verdict | None:
    """Return the verdict on the first two recordings of a case, made if there is none."""
    case = folder / truth['case']
    if not case.is_dir():
        make_case(folder, truth)
    diagnose_recordings(case, FIRST, TWO, limit, options)
    try:
        return read_verdict(case / TWO)
    except VerdictError:
        return None


def _opening(folder: Path, limit: float, options: Sequence[str], truth: Truth) -> Row:
    """Return whether the first two recordings of a case leave its answer open, and how."""
    verdict = _of_two(folder, truth, limit, options)
    told = answer_of(folder / truth['case'] / TWO, truth)
    return {'open': verdict is not None and is_open(verdict),
            **{f'{key}_before': told.get(key) for key in ('set', 'rivals', 'right')}}


def _third_test(folder: Path, rule: str, limit: float, options: Sequence[str],
                truth: Truth) -> Row:
    """Give an open case its third test by a rule."""
    _of_two(folder, truth, limit, options)
    return {'tests': {rule: _told(folder / truth['case'], rule, limit, options, truth)}}


def _told(case: Path, rule: str, limit: float, options: Sequence[str],
          truth: Truth) -> dict[str, Any]:
    """Return what a third test by a rule told, or why it told nothing."""
    name = f'rec_{rule}'
    if rule in BUILT_IN:
        random = np.random.default_rng([*truth['seed'], 100 + RULES.index(rule)])
        sheet = {**known(truth), 'waveform': BUILT_IN[rule](random)}
        proposal: dict[str, Any] = {}
    else:
        said = run_command(['propose', str(case / TWO), '--duration', f'{DURATION_S:g}',
                            '--jobs', '1', '--seed', str(truth['seed'][-1]),
                            '--out', str(case / f'{name}.yaml'),
                            '--json', str(case / f'{rule}.json')], limit)
        if not (case / f'{rule}.json').exists():
            return {'failure': one_line(said, 300)}
        proposal = json.loads((case / f'{rule}.json').read_text(encoding='utf-8'))
        if proposal['test'] is None:
            return {'nothing_helps': True, **answer_of(case / TWO, truth)}
        sheet = {**known(truth), **proposal['test']}
    whole, number = with_test(truth, sheet, RULES.index(rule))
    record_test(whole, number, case / f'{name}.csv')
    sealing.write_whole(case / f'{name}.yaml', yaml.safe_dump(
        {key: value for key, value in sheet.items() if key != 'sensors'}, sort_keys=False))
    said = diagnose_recordings(case, (*FIRST, name), f'three_{rule}.json', limit,
                               ('--after', str(case / TWO), *options))
    answer = answer_of(case / f'three_{rule}.json', truth)
    if not answer:
        return {'failure': one_line(said, 300)}
    return {**answer, 'reached': reached(whole, number),
            'limits': proposal.get('limits', {}), 'family': proposal.get('family', rule),
            'expected': (proposal.get('expected') or {}).get('right_after')}


def answer_of(path: Path, truth: Truth) -> dict[str, Any]:
    """Return what a verdict told of a truth; empty if there is none."""
    try:
        verdict = read_verdict(path)
    except VerdictError:
        return {}
    case = Case(truth, verdict)
    return {'right': case.named_among(1, exactly=True), 'set': set_of(verdict),
            'rivals': rivals_of(verdict),
            'first': sorted(verdict.which[0].effects),
            'probability': verdict.which[0].probability,
            'true_probability': case.probability_of_truth,
            'unknown': verdict.probability_of(UNKNOWN), 'kind': case.kind}


def summary(results: TrialResults) -> dict[str, Any]:
    """
    Return what the third tests of a trial told, as far as it has got.

    For each rule: `cases`, exact `top1` with `ci95`, how many of the sure first answers were right
    and how many wrong (`sure`), the `median_set` before and after, with 'unknown' as an
    answer, the same without it as `median_rivals` (NaN for trials that did not count them), and
    `violations`, tests that exceeded a limit on the independent antenna.
    `best_built_in` takes in each case the best of the standard kinds, in hindsight. `before` says
    of how many of the cases with third tests the first answer was right without one. `promise`
    compares what a proposal expected for the true answer with the share that it got of what
    'unknown' left.
    """
    tests: dict[str, dict[str, Any]] = {
        name: results[name]['tests'] for name in results if 'tests' in results[name]}
    rows: dict[str, list[tuple[str, dict[str, Any]]]] = {
        rule: [(name, told[rule]) for name, told in tests.items() if rule in told]
        for rule in (*RULES, *_FORMER)}
    rows['best_built_in'] = [
        (name, max((told[rule] for rule in BUILT_IN if 'right' in told.get(rule, {})),
                   key=lambda item: (item['right'], -item['set'])))
        for name, told in tests.items()
        if any('right' in told.get(rule, {}) for rule in BUILT_IN)]
    found: dict[str, Any] = {
        'diagnosed': sum('open' in results[name] for name in results),
        'open': sum(results[name].get('open', False) for name in results), 'rules': {}}
    before = [right for name in tests if (right := results[name].get('right_before')) is not None]
    found['before'] = {'cases': len(before), 'right': sum(before)}
    for rule, items in rows.items():
        judged = [(name, item) for name, item in items if 'right' in item]
        share = rate(item['right'] for _, item in judged)
        found['rules'][rule] = {
            'cases': share.cases, 'failures': len(items) - len(judged),
            'top1': share.value, 'ci95': [share.low, share.high],
            'sure': {key: sum(item['right'] == right and item['probability'] >= SURE
                              for _, item in judged)
                     for key, right in (('right', True), ('wrong', False))},
            'violations': sum(any(item['reached'][key] > limit for key, limit in item.get(
                'limits', {}).items() if key in item['reached'])
                for _, item in judged if 'reached' in item)}
        for left in ('set', 'rivals'):
            found['rules'][rule] |= {
                f'median_{left}_before': _median([
                    results[name].get(f'{left}_before') for name, _ in judged]),
                f'median_{left}': _median([item.get(left) for _, item in judged])}
    # no answer stands for a cause from outside the catalogue
    kept = [(item['expected'], 0.0 if item['kind'] == 'outside' else
             item['true_probability'] / (1.0 - item['unknown']))
            for _, item in rows[PROPOSED]
            if item.get('expected') is not None and item.get('unknown', 1.0) < 1.0]
    found['promise'] = {'cases': len(kept), 'expected': _mean([e for e, _ in kept]),
                        'obtained': _mean([o for _, o in kept])}
    return found


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else math.nan


def _median(values: Sequence[float | None]) -> float:
    """Return the median of what is known."""
    known_values = [value for value in values if value is not None]
    return float(np.median(known_values)) if known_values else math.nan
