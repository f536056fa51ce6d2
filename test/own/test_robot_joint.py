# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The robot joint: logs of a program of its own, and the fault that it was given is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import runpy
from typing import Any

import pytest
from simgap.model import check_model, diagnose_logs, load_model, Log, unseen

FOLDER = Path(__file__).resolve().parents[2] / 'examples' / 'robot_joint'
MODEL = load_model(str(FOLDER / 'machine.py'))
MAKER = runpy.run_path(str(FOLDER / 'make_logs.py'))


def logs_of(fault: str) -> list[Log]:
    return logs_with(MAKER['FAULTS'][fault])


def logs_with(faults: dict[str, float], first_seed: int = 0, **labels: str) -> list[Log]:
    made = []
    for seed, name in enumerate(('steps', 'sweep'), first_seed):
        rows: Any = MAKER['log_of'](MAKER[name], faults, seed)
        made.append(Log(' '.join([name, *labels.values()]), rows[:, 0], {
            'reference_rad': rows[:, 1], 'motor_rad': rows[:, 2], 'current_A': rows[:, 3]},
            labels=labels))
    return made


@pytest.mark.slow
def test_a_joint_in_good_order_has_no_gap() -> None:
    logs = logs_of('nothing')
    assert check_model(MODEL, logs).faults == []
    assert diagnose_logs(MODEL, logs).word == 'no_gap'


@pytest.mark.parametrize(('fault', 'effect', 'number', 'size'), [
    ('compliance', 'gearbox.compliance', 'compliance', 0.3),
    ('backlash', 'gearbox.backlash', 'half_gap', 0.04),
    ('asymmetry', 'motor.friction_asymmetry', 'asymmetry', 0.25),
    ('ripple', 'motor.ripple', 'ripple_sine@6', 0.02),
    ('delay', 'controller.delay', 'delay', 0.004)])
@pytest.mark.slow
def test_the_fault_of_a_joint_is_named_with_its_size(fault: str, effect: str, number: str,
                                                     size: float) -> None:
    first = diagnose_logs(MODEL, logs_of(fault)).which[0]
    assert first.effects == [effect]
    assert first.parameters[f'{effect}.{number}']['value'] == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize('fault', [
    pytest.param('nothing', marks=pytest.mark.slow),
    pytest.param('asymmetry', marks=pytest.mark.slow),
    *(pytest.param(fault, marks=pytest.mark.trial) for fault in ('backlash', 'ripple', 'delay'))])
def test_an_answer_does_not_turn_with_the_rate_at_which_samples_are_compared(fault: str) -> None:
    answers = [diagnose_logs(replace(MODEL, judged_hz=rate), logs_of(fault)).which[0]
               for rate in (10.0, 20.0, 50.0, 200.0, 1000.0)]
    assert len({tuple(answer.effects) for answer in answers}) == 1
    probabilities = [answer.probability for answer in answers]
    assert max(probabilities) - min(probabilities) < 0.1


@pytest.mark.slow
def test_a_law_in_the_place_of_what_the_list_lacks_predicts_a_log_that_it_never_saw() -> None:
    """As well as the true effect would; the logs have noise of 0.02 A."""
    found = diagnose_logs(MODEL, logs_of('asymmetry'), without=['motor.friction_asymmetry'])
    assert found.word == 'unknown_effect' and found.lawful is not None
    # what is said first is the place of the law, whatever was promised elsewhere
    assert found.where[0]['component'] == found.may_enter_at[0].component
    assert found.may_enter_at[0].law is not None
    for log in logs_with(MAKER['FAULTS']['asymmetry'], 7):
        current = unseen(found, log)['current']
        assert current.after > 0.07 and current.lawful == pytest.approx(0.02, rel=0.1)


@pytest.mark.slow
def test_what_a_repair_changes_is_told_and_what_it_leaves_too() -> None:
    """The asymmetry falls from 0.35 to 0.15; the delay of the bus is the same."""
    found = diagnose_logs(MODEL, [
        *logs_with({'asymmetry': 0.35, 'delay': 0.004}, 0, repair='before'),
        *logs_with({'asymmetry': 0.15, 'delay': 0.004}, 2, repair='after')])
    result = found.as_data()
    assert set(result['which'][0]['effects']) == {'motor.friction_asymmetry', 'controller.delay'}
    [label] = result['labels']
    assert label['differ'] == ['motor.friction_asymmetry']
    assert label['stay'] == ['controller.delay']
    asymmetry, delay = (next(item for item in label['numbers'] if item['effect'] == effect)
                        for effect in ('motor.friction_asymmetry', 'controller.delay'))
    [difference] = asymmetry['differences']
    assert difference['value'] == pytest.approx(-0.2, rel=0.1)
    assert difference['ci95'][1] < -0.15
    # the reference is held for a sample, 1 ms: all delays from 3 to 4 ms do the same
    for value in (*delay['values'].values(), result['numbers']['delay']):
        assert 0.003 < value['value'] < 1.1 * 0.004
    assert result['numbers']['asymmetry[steps before]']['value'] == pytest.approx(0.35, rel=0.1)
    assert result['numbers']['asymmetry[sweep after]']['value'] == pytest.approx(0.15, rel=0.1)
