# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tests with labels: which effect an intervention changes, by how much, and which one stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from simgap.machine.by_label import by_label, ByLabel, groups_of, without_labels
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.report.page import contents
from simgap.report.render import render
from simgap.verdict.diagnosis import diagnose

TIME = np.arange(0.0, 10.0, 0.02)
NOISE = 0.01
STARTS = (3.0, -2.0, 2.5, -3.5)
LOADS = tuple({'load': value} for value in 'AABB')


def effect(key: str, unit: str, low: float, high: float) -> Effect:
    number = Parameter(f'{key}.size', unit, low, high, 1e-3)
    return Effect(key, key.partition('.')[0], 'a cause', (Form('', (number,)),))


class Body(Machine):
    """A body that cools in several tests, each with its own truth and labels."""

    def __init__(self, truths: Sequence[Mapping[str, float]],
                 labels: Sequence[Mapping[str, str]]) -> None:
        random = np.random.default_rng(5)
        experiments = [Experiment(
            f'test {k}', TIME, ('near', 'behind'), ('K', 'K'),
            readings(k, truth) + NOISE * random.normal(size=(TIME.size, 2)),
            np.full((TIME.size, 2), NOISE), labels=own)
            for k, (truth, own) in enumerate(zip(truths, labels, strict=True))]
        super().__init__(experiments, [Parameter('offset:rate', '1', -0.02, 0.02, 1e-3, 0.01)], [
            effect('thermometer.gain', '1', -0.5, 0.5), effect('heater.step', 'K', -1.0, 1.0),
            effect('air.draught', '1/s', 0.0, 1.0)])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        return readings(experiment, point)


def readings(k: int, point: Point) -> FloatArray:
    rate = 0.4 * (1.0 + point.get('offset:rate', 0.0))
    cooled = rate * TIME + point.get('air.draught.size', 0.0) * np.maximum(TIME - 7.0, 0.0)
    heated = point.get('heater.step.size', 0.0) * (TIME >= 4.0)
    body = STARTS[k] * np.exp(-cooled) + heated
    return np.column_stack([body * (1.0 + point.get('thermometer.gain.size', 0.0)), body])


def of_loads(under_a: Mapping[str, float], under_b: Mapping[str, float]) -> Body:
    return Body([under_a, under_a, under_b, under_b], LOADS)


def number_of(result: Mapping[str, Any], name: str) -> dict[str, Any]:
    [label] = result['labels']
    [found] = [item for item in label['numbers'] if item['effect'] == name]
    return dict(found)


def test_an_effect_that_differs_is_told_with_its_difference_and_one_that_stays_stays() -> None:
    result = diagnose(of_loads({'heater.step.size': -0.3, 'thermometer.gain.size': 0.1},
                               {'heater.step.size': -0.5, 'thermometer.gain.size': 0.1})).as_data()
    assert set(result['which'][0]['effects']) == {'heater.step', 'thermometer.gain'}
    [label] = result['labels']
    assert label['label'] == 'load'
    assert label['tests'] == {'A': ['test 0', 'test 1'], 'B': ['test 2', 'test 3']}
    assert label['differ'] == ['heater.step'] and label['stay'] == ['thermometer.gain']
    heater = number_of(result, 'heater.step')
    for value, size in (('A', -0.3), ('B', -0.5)):
        low, high = heater['values'][value]['ci95']
        assert low < size < high and high - low < 0.02
    [difference] = heater['differences']
    assert (difference['from'], difference['to']) == ('A', 'B') and difference['differs']
    assert difference['ci95'][0] < -0.2 < difference['ci95'][1]
    [same] = number_of(result, 'thermometer.gain')['differences']
    assert not same['differs'] and same['ci95'][0] < 0.0 < same['ci95'][1]


@pytest.mark.parametrize(('under_a', 'under_b'), [(-0.3, 0.0), (0.0, 0.4), (0.3, -0.3)])
@pytest.mark.parametrize('tests', [2, 4])
def test_an_effect_under_one_label_alone_or_of_two_signs_is_found(
        tests: int, under_a: float, under_b: float) -> None:
    truths = [{'heater.step.size': under_a}, {'heater.step.size': under_b}]
    order = [0, 1] if tests == 2 else [0, 0, 1, 1]
    result = diagnose(Body([truths[i] for i in order],
                           [{'load': 'AB'[i]} for i in order])).as_data()
    top = result['which'][0]
    assert result['verdict'] == 'explained' and top['effects'] == ['heater.step']
    assert top['probability'] > 0.9
    for value, size in (('A', under_a), ('B', under_b)):
        told = top['parameters'][f'heater.step.size[load={value}]']
        assert told['value'] == pytest.approx(size, abs=0.01)
    heater = number_of(result, 'heater.step')
    assert heater['differs']
    assert heater['differences'][0]['value'] == pytest.approx(under_b - under_a, abs=0.01)
    reason = result['how_far']['explained_fraction']['reason']
    assert (reason is None) == (tests == 4)
    assert reason is None or 'heater.step: no other test has the label load: A' in reason


def test_an_equal_effect_is_named_with_one_size_and_carries_from_label_to_label() -> None:
    result = diagnose(of_loads({'heater.step.size': -0.3}, {'heater.step.size': -0.3})).as_data()
    assert list(result['which'][0]['parameters']) == ['heater.step.size']
    [label] = result['labels']
    assert label['stay'] == ['heater.step'] and label['differ'] == []
    assert label['explained_fraction']['value'] > 0.95
    assert label['held_out'].startswith('each value of load in turn')


def test_what_was_learned_under_one_label_fails_under_the_other() -> None:
    """Learned without the heater, it cannot be judged; learned with it, the gap is wider."""
    result = diagnose(of_loads({'heater.step.size': -0.3}, {})).as_data()
    [label] = result['labels']
    assert label['explained_fraction']['value'] < 0.0
    assert result['how_far']['explained_fraction']['value'] > 0.9
    judged = {fold['withheld']: fold['judged'] for fold in label['folds']}
    assert judged == {'test 0': [], 'test 1': [], 'test 2': ['heater.step'],
                      'test 3': ['heater.step']}


def test_the_difference_of_a_healthy_machine_names_nothing() -> None:
    result = diagnose(of_loads({}, {})).as_data()
    assert result['verdict'] == 'no_gap'
    assert result['labels'][0]['numbers'] == []


def test_without_labels_or_with_one_value_the_machine_is_not_touched() -> None:
    plain = Body([{'heater.step.size': -0.3}] * 2, [{}] * 2)
    assert by_label(plain) is plain
    one = Body([{'heater.step.size': -0.3}] * 2, [{'load': 'A'}] * 2)
    first, second = diagnose(plain).as_data(), diagnose(one).as_data()
    assert 'labels' not in first
    for result in (first, second):
        del result['seconds']
    assert first == second


def test_labels_that_divide_the_tests_alike_count_once() -> None:
    body = Body([{}] * 4, [{'load': 'A', 'fan': 'on'}, {'load': 'A', 'fan': 'on'},
                           {'load': 'B', 'fan': 'off'}, {'load': 'B'}])
    assert groups_of(body.experiments) == {
        'load': ('A', 'A', 'B', 'B'), 'fan': ('on', 'on', 'off', '')}
    body = Body([{}] * 2, [{'load': 'A', 'fan': 'on'}, {'load': 'B', 'fan': 'off'}])
    assert groups_of(body.experiments) == {'load': ('A', 'B')}


def test_a_point_by_label_is_the_machines_own_point_in_each_test() -> None:
    body = of_loads({}, {})
    machine = by_label(body)
    assert isinstance(machine, ByLabel) and without_labels(machine) is body
    point = {'heater.step.size[load=A]': 0.2, 'heater.step.size[load=B]': 0.4,
             'offset:rate': 0.01}
    rows = machine.simulate([point, {}, point], [None, None, 2])
    for k, size in enumerate((0.2, 0.2, 0.4, 0.4)):
        expected = readings(k, {'heater.step.size': size, 'offset:rate': 0.01})
        assert np.array_equal(rows[0][k], expected)  # type: ignore[arg-type]
        assert np.array_equal(machine.predict(point, k), expected)
        assert np.array_equal(rows[1][k], readings(k, {}))  # type: ignore[arg-type]
    assert [values is None for values in rows[2]] == [True, True, False, True]


def test_the_summary_and_the_page_say_what_differs() -> None:
    found = diagnose(of_loads({'heater.step.size': -0.3}, {'heater.step.size': -0.5}))
    [line] = [line for line in found.summary().splitlines() if 'differs' in line]
    assert line.startswith('  heater.step: size differs by -0.') and 'from A to B' in line
    page = render('verdict.html', **contents(found))
    assert 'What the labels change' in page and 'heater.step' in page
