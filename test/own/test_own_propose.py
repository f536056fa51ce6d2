# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The next test of a machine of one's own: a swing that may be pushed off anywhere."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from antenna_drive.cli import main
import numpy as np
from own.swing import NOISE, RATE_NOISE, swing
import pytest
import simgap
from simgap.model import effect, Log, Model, ModelError, OwnTests, read_log, size
from simgap.next_test.design import DesignEffort, TestDesign
from simgap.next_test.investigation import DECIDED, InvestigationPlan
from simgap.next_test.rivals import Findings
from simgap.search.rival import Rival

SMALL = DesignEffort(drawn=6, judged=4, fitted=4)


def push_off(duration_s: float, random: np.random.Generator) -> Log:
    """Return a test in which the swing starts somewhere."""
    time = np.arange(0.0, duration_s, 0.01)
    return Log('push-off', time, {'turn': 0.7 * time}, {'height': float(random.uniform(0.1, 2.0))})


def simulate(numbers: Any, test: Any) -> dict[str, Any]:
    """Return the angle of a swing that starts where the test says, with friction of two kinds."""
    fall = np.exp(-(numbers.decay + numbers.more) * test.time) - numbers.dry * test.time
    angle = test.constants['height'] * np.maximum(fall, 0.0) * np.cos(2.0 * test.time)
    return {'angle': angle, 'rate': np.gradient(angle, test.time)}


def model(**changes: Any) -> Model:
    """Return the model of a swing with two kinds of friction, and the tests that it may run."""
    return swing(**{'simulate': simulate, 'effects': [
        effect('bearing.oil', more=size(-0.1, 0.3)), effect('bearing.dry', dry=size(0.0, 0.1))],
        'per_test': {}, 'push': {}, 'tests': {'push-off': push_off}, 'limits': {'angle': 1.5},
        **changes})


def rivals() -> list[Rival]:
    return [Rival((f'bearing.{name}',), (f'bearing.{name}',), ('',), probability,
                  ('decay', f'bearing.{name}.{number}'), np.array([0.0, value]),
                  np.diag([1e-6, 1e-6]))
            for name, number, probability, value in (
                ('oil', 'more', 0.6, 0.02), ('dry', 'dry', 0.4, 0.01))]


def test_the_limit_of_a_reading_is_kept() -> None:
    found = TestDesign(OwnTests(model(), 10.0), Findings(rivals()), effort=SMALL).run()
    best = found.tests[0]
    assert best.test.constants['height'] <= SMALL.margin * 1.5
    assert found.refused == {'angle': sum(found.refused.values())}
    assert best.separation is not None and best.separation.expected() > 0.99


def test_readings_of_a_planned_test_have_the_errors_of_a_model() -> None:
    space = OwnTests(model(), 10.0)
    machine = space.machine(space.draw('push-off', np.random.default_rng(1)))
    [experiment] = machine.experiments
    assert experiment.model_error == pytest.approx(3e-3 * experiment.measured.std(axis=0))
    assert experiment.measured == pytest.approx(machine.predict({}, 0))


def test_a_model_without_tests_says_what_it_lacks() -> None:
    with pytest.raises(ModelError, match='does not say what a test may be'):
        OwnTests(model(tests={}), 10.0)


@pytest.mark.parametrize('changes, words', [
    ({'limits': {'angel': 1.0}}, 'limits: angel: no such reading, did you mean angle'),
    ({'limits': {'angle': 0.0}}, 'limits: angle: 0.0 given'),
    ({'tests': {'push-off': 3}}, 'tests: push-off: give a function')])
def test_wrong_declarations_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        model(**changes)


def written(folder: Path, answers: int) -> Path:
    """Return a verdict with so many answers, beside the model that it is of."""
    (folder / 'my_swing.py').write_text(
        'from own.test_own_propose import model\nmachine = model()\n')
    verdict = folder / 'verdict.json'
    verdict.write_text(json.dumps({'planning': {
        'inflation': 1.0, 'rivals': [rival.as_data() for rival in rivals()[:answers]]}}))
    return verdict


def test_beside_a_single_answer_something_else_is_looked_for(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = main(['propose', str(written(tmp_path, 1)),
                 '--model', str(tmp_path / 'my_swing.py'), '--duration', '10', '--jobs', '1',
                 '--json', str(tmp_path / 'next.json')])
    assert code == 0
    data = json.loads((tmp_path / 'next.json').read_text())
    assert data['objective'] == 'detect' and data['test']
    assert len(data['rivals']) == 1, 'it must stay within the limits with that answer too'
    assert 'this test looks for other effects' in capsys.readouterr().out


def test_the_command_writes_the_commands_of_the_test(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = written(tmp_path, 2)
    code = main(['propose', str(verdict), '--model', str(tmp_path / 'my_swing.py'),
                 '--duration', '10', '--jobs', '1', '--out', str(tmp_path / 'next.csv'),
                 '--json', str(tmp_path / 'next.json'), '--report', str(tmp_path / 'next.html')])
    assert code == 0
    data = json.loads((tmp_path / 'next.json').read_text())
    assert data['expected']['right_after'] > 0.99 and data['expected']['confirmed']
    rows = [line for line in (tmp_path / 'next.csv').read_text().splitlines() if line[0] != '#']
    assert rows[0] == 'time_s,turn' and len(rows) == 1001
    back = read_log(tmp_path / 'next.csv')
    assert 0.1 < back.constants['height'] <= SMALL.margin * 1.5
    assert 'next test: push-off' in (tmp_path / 'next.yaml').read_text()
    assert 'bearing.oil' in (tmp_path / 'next.html').read_text()


def test_an_investigation_plays_tests_until_the_answer_is_sure(tmp_path: Path) -> None:
    """The same call after it plays nothing, and tells the same story."""
    played = []

    def play(number: int, test: Path, duration: float, out: Path) -> None:
        commands, random = read_log(test), np.random.default_rng(number)
        truth = simulate(SimpleNamespace(decay=0.1, more=0.1, dry=0.0), commands)
        np.savetxt(out, np.column_stack([
            commands.time, commands['turn'],
            truth['angle'] + NOISE * random.normal(size=commands.time.size),
            truth['rate'] + RATE_NOISE * random.normal(size=commands.time.size)]),
            delimiter=',', comments='', header='time_s,turn,angle,rate')
        played.append((number, duration))

    plan = InvestigationPlan(most=3, until=0.8, duration=10.0)
    story = simgap.investigate(model(), tmp_path, play, plan, threads=1)
    assert story['ended'] == DECIDED
    assert played == [(1, 10.0), (2, 10.0)]
    assert [test['answers'][0]['effects'] for test in story['tests']] == [['bearing.oil']] * 2
    assert simgap.investigate(model(), tmp_path, play, plan, threads=1) == story
    assert len(played) == 2
