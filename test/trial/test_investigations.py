# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A trial of whole investigations, and the tests that it makes on sealed antennas."""

from __future__ import annotations

from collections.abc import Sequence
import json
import math
from pathlib import Path
import shlex
from typing import Any

from antenna_drive.recording.csv_format import read_csv
from lab.cli import main
from lab.trials import batch, further_tests, investigations, sealing
from lab.trials.further_tests import known, reached, with_test
from lab.trials.investigations import run_trial, summary, until_sure
from lab.trials.results import FILE, TrialResults
import numpy as np
import pytest
import yaml

SLEW = {'type': 'knots', 'times_s': [0.1, 0.6, 1.4, 1.9], 'rates_deg_s': [0.0, 0.3, 0.3, 0.0]}


def sealed(folder: Path) -> dict[str, Any]:
    return batch.prepare(folder, 3, 5, 0.02, 200.0, 30.0, wild=True)


def healthy(probability: float) -> dict[str, Any]:
    return {'verdict': 'no_gap', 'confusable': [], 'which': [
        {'effects': [name], 'probability': p, 'parameters': {}} for name, p in sorted(
            {'none': probability, 'unknown': 1.0 - probability}.items(),
            key=lambda item: -item[1])], 'how_far': {'explained_fraction': {'value': 0.9}},
        'seconds': 1.0}


def answers(*probabilities: float, right: bool = True) -> list[dict[str, Any]]:
    return [{'probability': p, 'right': right, 'set': 1, 'first': ['none']}
            for p in probabilities]


def test_tests_are_counted_until_the_answer_is_sure() -> None:
    assert until_sure(answers(0.5, 0.8, 0.95)) == (3.0, True)
    assert until_sure(answers(0.93, 0.5, right=False)) == (1.0, False)
    assert until_sure(answers(0.5, 0.89)) == (math.inf, False)


def test_an_answer_is_confirmed_by_the_next_test() -> None:
    assert until_sure(answers(0.95), 2) == (math.inf, False)
    assert until_sure(answers(0.5, 0.95), 2) == (2.0, True)
    changed = answers(0.95, right=False) + answers(0.95, 0.92)
    changed[0]['first'] = ['motors.torque_constant']
    assert until_sure(changed) == (1.0, False)
    assert until_sure(changed, 2) == (3.0, True)


def test_the_summary_counts_what_was_never_sure_and_outsiders_apart(tmp_path: Path) -> None:
    manifest = batch.prepare(tmp_path, 5, 5, 0.02, 200.0, 30.0, wild=True)
    results = TrialResults(tmp_path, manifest)
    for k, (kind, found) in enumerate([
            ('single', answers(0.95)), ('pair', answers(0.5, 0.6, 0.92)),
            ('none', answers(0.5, 0.5)), ('single', answers(0.97, right=False)),
            ('outside', answers(0.8, 0.85))], 1):
        results.put(f'case_000{k}', kind=kind, designed={'answers': found})
    found = summary(results)['designed']
    until = found['until_sure']
    assert (found['cases'], until['right'], until['wrong']) == (4, 0.5, 1)
    # of 1, 3, never and never, the middle is never
    assert until['median_tests'] is None
    assert (found['until_confirmed']['right'], found['until_confirmed']['wrong']) == (0.25, 0)
    assert (found['outside'], found['outside_right']) == (1, 1)
    assert summary(results)['standard']['cases'] == 0
    results.put('case_0003', kind='none', designed={'answers': answers(0.5, 0.91)})
    found = summary(results)['designed']['until_sure']
    assert found['median_tests'] == 2.5 and found['median_seconds'] == 75.0


class Commands:
    """Stands for `investigate` and `diagnose`; makes the tests that `--by` names."""

    def __init__(self) -> None:
        self.words: list[list[str]] = []

    def __call__(self, words: Sequence[str], limit_s: float = 0.0) -> str:
        self.words.append(list(words))
        target = Path(words[words.index('--json') + 1])
        if words[0] == 'diagnose':
            recordings = [word for word in words if word.endswith('.csv')]
            target.write_text(json.dumps(healthy(0.3 * len(recordings) + 0.05)))
            return 'exit code 0\n'
        out = Path(words[words.index('--out') + 1])
        out.mkdir()
        by = shlex.split(words[words.index('--by') + 1])
        tests = []
        for number in (1, 2):
            sheet = out / f'test_{number}.yaml'
            sheet.write_text(yaml.safe_dump({'waveform': SLEW, 'elevation_deg': 30.0}))
            given = {'sheet': sheet, 'out': out / f'test_{number}.csv', 'duration': 2.0,
                     'number': number}
            assert main([word.format(**given) for word in by[3:]]) == 0
            (out / f'verdict_{number}.json').write_text(json.dumps(
                healthy(0.9 if number == 2 else 0.55)))
            tests.append({'test': number, 'family': 'slews'})
        target.write_text(json.dumps({'tests': tests, 'ended': 'decided'}))
        return 'exit code 0\n'


def test_each_case_is_taken_both_ways_and_a_trial_goes_on(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    commands = Commands()
    for module in (batch, investigations):
        monkeypatch.setattr(module, 'run_command', commands)
    monkeypatch.setattr(further_tests, 'DURATION_S', 2.0)
    monkeypatch.setattr(further_tests.with_test, '__defaults__', (2.0,))
    manifest = sealed(tmp_path / 'one')
    found = run_trial(tmp_path / 'one', manifest, 1, 60.0)
    kinds = [sealing.open_truth(tmp_path / 'one', name, manifest)['kind']
             for name in manifest['seals']]
    inside = [kind for kind in kinds if kind != 'outside']
    assert found['designed']['cases'] == found['standard']['cases'] == len(inside)
    assert found['designed']['until_sure']['right'] == pytest.approx(
        inside.count('none') / len(inside))
    designed = TrialResults(tmp_path / 'one', manifest)['case_0001']['designed']
    assert [answer['probability'] for answer in designed['answers']] == [0.55, 0.9]
    # the slew of the sheet is what the antenna did, each time with its own noise
    folder = tmp_path / 'one/case_0001/investigation'
    one, two = (read_csv(folder / f'test_{k}.csv') for k in (1, 2))
    encoder = one['plant/encoder'].values
    assert np.rad2deg(np.nanmax(encoder) - np.nanmin(encoder)) == pytest.approx(0.39, rel=0.2)
    assert not np.array_equal(one['motor_1/ammeter'].values, two['motor_1/ammeter'].values)

    # where only the file of the results is left, nothing is done again
    asked = len(commands.words)
    again = sealed(tmp_path / 'two')
    (tmp_path / 'one' / FILE).rename(tmp_path / 'two' / FILE)
    assert run_trial(tmp_path / 'two', again, 1, 60.0) == found
    assert len(commands.words) == asked


def test_a_further_test_can_be_made_by_hand(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    batch.prepare(tmp_path / 'tame', 2, 11, 0.02, 200.0, 3.0)
    sheet = tmp_path / 'next.yaml'
    sheet.write_text(yaml.safe_dump({'waveform': SLEW}))
    words = ['trial-test', str(tmp_path / 'tame'), 'case_0002', '--sheet', str(sheet),
             '--duration', '2', '--out']
    for name in ('a.csv', 'b.csv'):
        assert main([*words, str(tmp_path / name)]) == 0
    assert main([*words, str(tmp_path / 'c.csv'), '--number', '2']) == 0
    same, other = ((tmp_path / 'a.csv').read_text() == (tmp_path / name).read_text()
                   for name in ('b.csv', 'c.csv'))
    assert same and not other
    assert read_csv(tmp_path / 'a.csv')['plant/encoder'].time_s[-1] == pytest.approx(2.0, abs=0.02)
    assert main([*words[:2], 'case_0009', *words[3:], str(tmp_path / 'd.csv')]) == 2
    assert 'has no case_0009; the cases are case_0001 to case_0002' in capsys.readouterr().err
    sheet.write_text(yaml.safe_dump({'waveform': {'type': 'prbs', 'amplitude_deg_s': 0.1,
                                                  'bit_time_s': 0.5}}))
    assert main([*words, str(tmp_path / 'd.csv')]) == 2
    assert not (tmp_path / 'd.csv').exists() and not list(tmp_path.glob('.*'))


def test_a_test_more_changes_nothing_else_of_a_case(tmp_path: Path) -> None:
    manifest = sealed(tmp_path)
    truth = sealing.open_truth(tmp_path, 'case_0001', manifest)
    sheet = {**truth['sheets'][0], 'waveform': SLEW}
    whole, number = with_test(truth, sheet, 2)
    assert whole['sheets'][:4] == truth['sheets'] and whole['sheets'][number] == sheet
    assert whole['seed'] == truth['seed'] and len(whole['durations_s']) == number + 1
    assert np.isfinite(list(reached(whole, number).values())).all()
    # what a tester knows leaves the sensors as they are
    whole, number = with_test(truth, {**known(truth), 'waveform': SLEW}, 2)
    assert whole['sheets'][number]['waveform'] == SLEW
    assert whole['sheets'][number]['sensors'] == truth['sheets'][0]['sensors']
