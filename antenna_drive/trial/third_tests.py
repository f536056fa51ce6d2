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
A trial of designed tests: what a third test tells where two have left several answers.

Of sealed wild cases those are kept whose first two recordings leave the answer open. Each gets a
third test by every rule: as `antenna-drive propose` designs it, D-optimal, at random, and the
kinds of the standard programme. All are recorded on the independent antenna, and the three
recordings are diagnosed. Everything lies in the folder of the case, so that a trial that was
interrupted goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import json
import math
from pathlib import Path
from typing import Any

from antenna_drive.errors import one_line
from antenna_drive.subcommand import run_command
from antenna_drive.trial import programme, sealing
from antenna_drive.trial.batch import (
    diagnose_recordings, Done, FORMATS, make_case, write_csv,
)
from antenna_drive.trial.cases import build_machine, make_recording, sheet_of, Truth
from antenna_drive.trial.real_antenna import simulate
from antenna_drive.trial.scorecard import Case, rate
from antenna_drive.trial.sensors import COLUMNS
from antenna_drive.trial.verdict import read_verdict, Verdict, VerdictError
from antenna_drive.workers import workers
import numpy as np
import yaml

FIRST = ('rec_a', 'rec_b')
DURATION_S = 30.0
# An answer is open below this probability; a set holds every answer with the second one or more.
OPEN, IN_SET = 0.7, 0.05
DESIGNED: Mapping[str, Sequence[str]] = {
    'proposed': (), 'd-optimal': ('--rule', 'd-optimal'), 'random': ('--rule', 'random')}
BUILT_IN: Mapping[str, Callable[[np.random.Generator], dict[str, Any]]] = {
    'square': programme.slow_square, 'triangle': programme.fast_triangle,
    'multisine': programme.multisine,
    'chirp': lambda random: programme.chirp(DURATION_S, random)}
RULES = (*DESIGNED, *BUILT_IN)
OPEN_FILE, RESULT = 'open.json', 'third_tests.json'


def run_trial(folder: Path, manifest: dict[str, Any], wanted: int, jobs: int, limit: float,
              options: Sequence[str] = (), rules: Sequence[str] = RULES,
              done: Done = lambda part, total: None) -> dict[str, Any]:
    """
    Find open cases, give each its third tests, and return what they told.

    Parameters
    ----------
    folder, manifest
        of sealed wild cases, see `batch.prepare`
    wanted
        number of open cases; fewer if there are no more
    jobs
        cases at a time
    limit
        time limit of each diagnosis and each proposal [s]
    options
        further options for each diagnosis
    rules
        some of RULES
    done
        called with the number of open cases that are complete, and of those wanted

    Returns
    -------
    as `summary`

    """
    names = list(manifest['seals'])
    found: list[str] = []
    done(0, wanted)
    for first in range(0, len(names), jobs):
        part = names[first:first + jobs]
        tasks = [(folder, sealing.open_truth(folder, name, manifest), limit, options)
                 for name in part]
        with workers(jobs, threads=True) as pool:
            opened = {part[number]: result() for number, result in pool.each(_is_open, tasks)}
        found += [name for name in part if opened[name]]
        if len(found) >= wanted:
            break
    tasks_of_cases = [(folder, sealing.open_truth(folder, name, manifest), rules, limit, options)
                      for name in found[:wanted]]
    with workers(jobs, threads=True) as pool:
        for complete, (_, result) in enumerate(pool.each(third_tests, tasks_of_cases), 1):
            result()
            done(complete, wanted)
    return summary(folder, manifest)


def is_open(verdict: Verdict) -> bool:
    """Return whether a verdict leaves the answer open: it is not sure, or names a set."""
    first = verdict.which[0]
    return first.probability < OPEN or any(
        len(verdict.confusable_with(effect)) > 1 for effect in first.effects)


def set_of(verdict: Verdict) -> int:
    """Return how many answers a verdict leaves."""
    return max(sum(entry.probability >= IN_SET for entry in verdict.which),
               *(len(verdict.confusable_with(effect)) for effect in verdict.which[0].effects))


def _is_open(folder: Path, truth: Truth, limit: float, options: Sequence[str]) -> bool:
    """Diagnose the first two recordings of a case, and say whether they leave it open."""
    case = folder / truth['case']
    if not case.is_dir():
        make_case(folder, truth)
    if not (case / OPEN_FILE).exists():
        diagnose_recordings(case, FIRST, 'two.json', limit, options)
        try:
            verdict = is_open(read_verdict(case / 'two.json'))
        except VerdictError:
            verdict = False
        sealing.write_whole(case / OPEN_FILE, json.dumps(verdict) + '\n')
    return bool(json.loads((case / OPEN_FILE).read_text(encoding='utf-8')))


def third_tests(folder: Path, truth: Truth, rules: Sequence[str], limit: float,
                options: Sequence[str] = ()) -> None:
    """Give an open case its third tests, those that it has not had."""
    case = folder / truth['case']
    result = case / RESULT
    known = json.loads(result.read_text(encoding='utf-8')) if result.exists() else {}
    for rule in rules:
        if rule not in known:
            known[rule] = _third_test(case, truth, rule, limit, options)
            sealing.write_whole(result, json.dumps(known, indent=2) + '\n')


def _third_test(case: Path, truth: Truth, rule: str, limit: float,
                options: Sequence[str]) -> dict[str, Any]:
    """Return what a third test by a rule told, or why it told nothing."""
    name = f'rec_{rule}'
    if rule in BUILT_IN:
        random = np.random.default_rng([*truth['seed'], 100 + RULES.index(rule)])
        sheet = {**truth['sheets'][0], 'waveform': BUILT_IN[rule](random), 'bias': {
            'type': 'circuit', 'bias_pot': _pot(truth), 'start': 'steady'}}
        proposal: dict[str, Any] = {}
    else:
        said = run_command(['propose', str(case / 'two.json'), '--duration', f'{DURATION_S:g}',
                            '--jobs', '1', '--out', str(case / f'{name}.yaml'),
                            '--json', str(case / f'{rule}.json'), *DESIGNED[rule]], limit)
        if not (case / f'{rule}.json').exists():
            return {'failure': one_line(said, 300)}
        proposal = json.loads((case / f'{rule}.json').read_text(encoding='utf-8'))
        if proposal['test'] is None:
            return {'nothing_helps': True, **_told(case / 'two.json', truth)}
        # what the tester does not know is as in the other tests of the case
        sheet = {**truth['sheets'][0], **proposal['test'],
                 'sensors': truth['sheets'][0]['sensors']}
    whole, number = with_test(truth, sheet, RULES.index(rule))
    write_csv(case / f'{name}.csv', {key: values for key, values in make_recording(
        whole, number).items() if key in COLUMNS}, FORMATS)
    sealing.write_whole(case / f'{name}.yaml', yaml.safe_dump(
        {key: value for key, value in sheet.items() if key != 'sensors'}, sort_keys=False))
    said = diagnose_recordings(case, (*FIRST, name), f'three_{rule}.json', limit, options)
    told = _told(case / f'three_{rule}.json', truth)
    if not told:
        return {'failure': one_line(said, 300)}
    return {**told, 'reached': reached(whole, number),
            'limits': proposal.get('limits', {}), 'family': proposal.get('family', rule),
            'expected': (proposal.get('expected') or {}).get('right_after')}


def _pot(truth: Truth) -> float:
    return float(next((sheet['bias']['bias_pot'] for sheet in truth['sheets']
                       if 'bias_pot' in sheet['bias']), 0.7))


def with_test(truth: Truth, sheet: Mapping[str, Any], place: int) -> tuple[Truth, int]:
    """Return a truth with one test more, and the number of its recording."""
    # each rule has its own noise: recordings are numbered apart
    number = len(truth['sheets']) + place
    filler = [truth['sheets'][0]] * place
    return {**truth, 'sheets': [*truth['sheets'], *filler, dict(sheet)],
            'durations_s': [*truth['durations_s'], *([DURATION_S] * (place + 1))]}, number


def reached(truth: Truth, number: int) -> dict[str, float]:
    """Return what a test reaches on the independent antenna, in the units of the limits."""
    sheet = sheet_of(truth, number)
    times = np.linspace(0.0, DURATION_S, int(500 * DURATION_S) + 1)
    history = simulate(build_machine(truth, number), sheet, times)
    acceleration = np.gradient(history.axis_rate, times)
    return {'rate_deg_s': math.degrees(float(np.abs(history.axis_rate).max())),
            'acceleration_deg_s2': math.degrees(float(np.abs(acceleration).max())),
            'travel_deg': math.degrees(float(np.ptp(history.axis_angle))),
            'current_A': float(np.abs(history.current).max())}


def _told(path: Path, truth: Truth) -> dict[str, Any]:
    """Return what a verdict told of a truth; empty if there is none."""
    try:
        verdict = read_verdict(path)
    except VerdictError:
        return {}
    case = Case(truth, verdict)
    return {'right': case.named_among(1, exactly=True), 'set': set_of(verdict),
            'first': sorted(verdict.which[0].effects),
            'probability': verdict.which[0].probability}


def summary(folder: Path, manifest: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return what the third tests of a trial told, as far as it has got.

    For each rule: `cases`, exact `top1` with `ci95`, the `median_set` before and after, and
    `violations`, tests that exceeded a limit on the independent antenna. `best_built_in` takes in
    each case the best of the standard kinds, in hindsight.
    """
    results = {name: json.loads((folder / name / RESULT).read_text(encoding='utf-8'))
               for name in manifest['seals'] if (folder / name / RESULT).exists()}
    before = {name: set_of(read_verdict(folder / name / 'two.json')) for name in results}
    rows: dict[str, list[tuple[str, dict[str, Any]]]] = {
        rule: [(name, told[rule]) for name, told in results.items() if rule in told]
        for rule in RULES}
    rows['best_built_in'] = [
        (name, max((told[rule] for rule in BUILT_IN if 'right' in told.get(rule, {})),
                   key=lambda item: (item['right'], -item['set'])))
        for name, told in results.items()
        if any('right' in told.get(rule, {}) for rule in BUILT_IN)]
    found: dict[str, Any] = {
        'diagnosed': sum((folder / name / OPEN_FILE).exists() for name in manifest['seals']),
        'open': len(results), 'rules': {}}
    for rule, items in rows.items():
        judged = [(name, item) for name, item in items if 'right' in item]
        share = rate(item['right'] for _, item in judged)
        found['rules'][rule] = {
            'cases': share.cases, 'failures': len(items) - len(judged),
            'top1': share.value, 'ci95': [share.low, share.high],
            'median_set_before': _median([before[name] for name, _ in judged]),
            'median_set': _median([item['set'] for _, item in judged]),
            'violations': sum(any(item['reached'][key] > limit for key, limit in item.get(
                'limits', {}).items() if key in item['reached'])
                for _, item in judged if 'reached' in item)}
    return found


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else math.nan
