# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The trial of designed tests: which cases it takes, what it runs, and how it goes on."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
from typing import Any

from lab.trials import batch, further_tests, sealing, third_tests
from lab.trials.results import FILE, TrialResults
from lab.trials.third_tests import is_open, rivals_of, run_trial, set_of, summary
from lab.trials.verdict import parse_verdict, Verdict
import pytest
import yaml

SETTINGS = {'count': 3, 'seed': 5, 'tolerance': 0.02, 'sample_rate': 200.0, 'duration': 30.0}
SLEW = {'type': 'knots', 'times_s': [0.1, 0.6, 1.4, 1.9], 'rates_deg_s': [0.0, 0.3, 0.3, 0.0]}


def verdict_of(answers: dict[str, float], confusable: Sequence[Sequence[str]] = ()) -> Any:
    return {'verdict': 'explained', 'confusable': list(confusable), 'which': [
        {'effects': name.split(' + '), 'probability': p, 'parameters': {}}
        for name, p in answers.items()], 'how_far': {'explained_fraction': {'value': 0.9}},
        'seconds': 1.0}


def parsed(*rest: Any) -> Verdict:
    return parse_verdict(verdict_of(*rest))


def test_a_case_is_open_if_unsure_or_if_a_set_is_named() -> None:
    assert is_open(parsed({'motor_1.coulomb_friction': 0.6, 'unknown': 0.4}))
    assert not is_open(parsed({'motor_1.coulomb_friction': 0.9, 'unknown': 0.1}))
    pair = ['motor_1.coulomb_friction', 'motors.coulomb_friction']
    sure_of_a_set = parsed({pair[0]: 0.9, 'unknown': 0.1}, [pair])
    assert is_open(sure_of_a_set) and set_of(sure_of_a_set) == 2
    assert set_of(parsed({pair[0]: 0.5, pair[1]: 0.3, 'none': 0.16, 'unknown': 0.04})) == 3
    # a small second answer is left, and opens nothing
    rivals = parsed({pair[0]: 0.75, pair[1]: 0.1, 'unknown': 0.15})
    assert not is_open(rivals) and set_of(rivals) == 3 and rivals_of(rivals) == 2
    alone = parsed({pair[0]: 0.75, pair[1]: 0.05, 'unknown': 0.2})
    assert not is_open(alone) and set_of(alone) == 2 and rivals_of(alone) == 1
    assert is_open(parsed({'none': 0.5, pair[0]: 0.45, 'unknown': 0.05}))


class Commands:
    """Stands for the commands that the trial runs; counts them."""

    def __init__(self) -> None:
        self.words: list[list[str]] = []
        self.allowed = 10.0

    def __call__(self, words: Sequence[str], limit_s: float = 0.0) -> str:
        self.words.append(list(words))
        target = Path(words[words.index('--json') + 1])
        if words[0] == 'propose':
            sheet = {'waveform': SLEW, 'bias': {'type': 'circuit', 'bias_pot': 0.8},
                     'elevation_deg': 30.0}
            target.write_text(json.dumps({
                'test': sheet, 'family': 'slews', 'expected': {'right_after': 0.95},
                'limits': {'rate_deg_s': self.allowed}}))
            Path(words[words.index('--out') + 1]).write_text(yaml.safe_dump(sheet))
            return 'exit code 0\n'
        # two recordings leave the second case open, three settle it
        recordings = [Path(word) for word in words if word.endswith('.csv')]
        sure = len(recordings) == 3 or recordings[0].parent.name != 'case_0002'
        target.write_text(json.dumps(verdict_of(
            {'none': 0.9, 'unknown': 0.1} if sure else {'none': 0.5, 'unknown': 0.4,
                                                        'axis.inertia': 0.1})))
        return 'exit code 0\n'


@pytest.fixture
def commands(monkeypatch: pytest.MonkeyPatch) -> Commands:
    found = Commands()
    for module in (batch, third_tests):
        monkeypatch.setattr(module, 'run_command', found)
    monkeypatch.setattr(further_tests, 'DURATION_S', 2.0)
    monkeypatch.setattr(further_tests.with_test, '__defaults__', (2.0,))
    monkeypatch.setattr(third_tests, 'make_case', lambda folder, truth: (
        folder / truth['case']).mkdir())
    return found


def test_open_cases_get_third_tests_on_the_independent_antenna_and_a_trial_goes_on(
        tmp_path: Path, commands: Commands) -> None:
    manifest = batch.prepare(tmp_path, **SETTINGS, wild=True)  # type: ignore[arg-type]
    rules = ('proposed', 'square')
    found = run_trial(tmp_path, manifest, 2, 1, 60.0, rules=rules)
    assert found['diagnosed'] == 3 and found['open'] == 1
    told = TrialResults(tmp_path, manifest)['case_0002']['tests']
    assert list(told) == list(rules)
    # the slew of the sheet is what the antenna did
    assert told['proposed']['reached']['rate_deg_s'] == pytest.approx(0.3, rel=0.2)
    assert told['proposed']['reached']['travel_deg'] == pytest.approx(0.39, rel=0.2)
    assert found['rules']['proposed']['violations'] == 0
    assert found['rules']['proposed']['median_set_before'] == 3
    assert found['rules']['proposed']['median_set'] == 2
    assert found['rules']['proposed']['median_rivals_before'] == 2
    assert found['rules']['proposed']['median_rivals'] == 1
    assert found['rules']['best_built_in']['cases'] == 1
    healthy = not sealing.open_truth(tmp_path, 'case_0002', manifest)['effects']
    assert found['before'] == {'cases': 1, 'right': healthy}, 'after two it is called healthy'
    assert (tmp_path / 'case_0002/rec_proposed.csv').exists()
    # tests of another case are drawn anew
    assert {words[words.index('--seed') + 1] for words in commands.words
            if words[0] == 'propose'} == {'2'}
    asked = len(commands.words)
    assert run_trial(tmp_path, manifest, 2, 1, 60.0, rules=rules) == found
    assert len(commands.words) == asked
    # where only the file of the results is left, no more than what lacks is done
    again = batch.prepare(tmp_path / 'two', **SETTINGS, wild=True)  # type: ignore[arg-type]
    (tmp_path / FILE).rename(tmp_path / 'two' / FILE)
    assert run_trial(tmp_path / 'two', again, 2, 1, 60.0, rules=rules) == found
    assert len(commands.words) == asked
    run_trial(tmp_path / 'two', again, 2, 1, 60.0, rules=[*rules, 'triangle'])
    assert len(commands.words) == asked + 2  # the verdict on two recordings, and that on three


def test_a_slew_that_exceeds_its_limit_is_counted(tmp_path: Path, commands: Commands) -> None:
    manifest = batch.prepare(tmp_path, **SETTINGS, wild=True)  # type: ignore[arg-type]
    commands.allowed = 0.2
    found = run_trial(tmp_path, manifest, 2, 1, 60.0, rules=('proposed',))
    assert found['rules']['proposed']['violations'] == 1


def test_sure_answers_are_counted_by_whether_they_are_right(tmp_path: Path) -> None:
    manifest = batch.prepare(tmp_path, **SETTINGS, wild=True)  # type: ignore[arg-type]
    results = TrialResults(tmp_path, manifest)
    for name, right, probability in (
            ('case_0001', True, 0.95), ('case_0002', True, 0.89), ('case_0003', False, 0.9)):
        results.put(name, open=True, tests={'proposed': {
            'right': right, 'set': 2, 'probability': probability, 'kind': 'single'}})
    assert summary(results)['rules']['proposed']['sure'] == {'right': 1, 'wrong': 1}


def test_a_promise_is_compared_with_what_unknown_has_left(tmp_path: Path) -> None:
    manifest = batch.prepare(tmp_path, **SETTINGS, wild=True)  # type: ignore[arg-type]
    results = TrialResults(tmp_path, manifest)
    told = {'right': True, 'set': 2, 'probability': 0.66, 'first': ['axis.inertia']}
    for name, more in (
            ('case_0001', {'expected': 1.0, 'true_probability': 0.66, 'unknown': 0.34}),
            ('case_0002', {'expected': 0.8, 'true_probability': 0.0, 'unknown': 0.05}),
            ('case_0003', {'expected': None, 'true_probability': 0.9, 'unknown': 0.05})):
        results.put(name, open=True, set_before=2, tests={
            'proposed': {'kind': 'single', **told, **more}})
    promise = summary(results)['promise']
    assert promise == {'cases': 2, 'expected': pytest.approx(0.9),
                       'obtained': pytest.approx(0.5)}


def test_no_answer_keeps_its_promise_for_a_cause_from_outside(tmp_path: Path) -> None:
    manifest = batch.prepare(tmp_path, **SETTINGS, wild=True)  # type: ignore[arg-type]
    results = TrialResults(tmp_path, manifest)
    results.put('case_0001', open=True, set_before=2, tests={'proposed': {
        'right': True, 'set': 2, 'probability': 0.7, 'first': ['unknown'], 'expected': 0.9,
        'true_probability': 0.7, 'unknown': 0.7, 'kind': 'outside'}})
    assert summary(results)['promise'] == {'cases': 1, 'expected': 0.9, 'obtained': 0.0}
