# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers that differ between days and specimens, against linear models in closed form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import found_noise, with_estimated_noise
from simgap.machine.by_label import by_label, ByLabel, groups_of, spread_of
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.report.page import contents
from simgap.report.render import render
from simgap.settings import DEFAULT
from simgap.verdict.diagnosis import diagnose
from simgap.verdict.record import Verdict

TIME = np.arange(0.0, 20.0, 0.02)
PUSH, RATE = np.sin(1.3 * TIME) + np.sin(4.1 * TIME), np.cos(2.9 * TIME)
NOISE, SIGMA = 0.05, 0.1
DAYS = tuple({'day': value} for value in ('Mon', 'Tue', 'Wed'))


class Linear(Machine):
    """Readings in proportion to two numbers, of which each test has its own truth."""

    def __init__(self, truths: Sequence[Point], labels: Sequence[Mapping[str, str]]) -> None:
        random = np.random.default_rng(3)
        self.runs = 0
        super().__init__([Experiment(
            f'test {k}', TIME, ('force',), ('N',),
            read(truth) + NOISE * random.normal(size=(TIME.size, 1)),
            np.full((TIME.size, 1), NOISE), labels=own, model_error=np.zeros(1))
            for k, (truth, own) in enumerate(zip(truths, labels, strict=True))],
            [Parameter('friction', 'N', -0.3, 0.3, 1e-3, SIGMA, configured=1.0),
             Parameter('mass', 'kg', -0.3, 0.3, 1e-3, SIGMA, spread=0.01)],
            [Effect('part.step', 'part', 'a cause', (
                Form('', (Parameter('part.step.size', 'N', -1.0, 1.0, 1e-3),)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        self.runs += 1
        return read(point)


def read(point: Point) -> FloatArray:
    return ((1.0 + point.get('friction', 0.0)) * PUSH + point.get('mass', 0.0) * RATE
            + point.get('part.step.size', 0.0) * (TIME > 9.0))[:, np.newaxis]


def told(verdict: Verdict) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Return the JSON of a diagnosis, and what it says of each number."""
    data = verdict.as_data()
    return data, {item['number']: item for item in data['reproducibility']}


def half(interval: Sequence[float]) -> float:
    return 0.5 * (interval[1] - interval[0]) / 1.96


def own_deviation() -> float:
    """Return how well one test shows the friction."""
    return NOISE / math.sqrt(float(PUSH @ PUSH))


def test_a_deviation_is_added_to_its_number_in_the_tests_of_its_label() -> None:
    machine = by_label(Linear([{}] * 3, DAYS))
    assert isinstance(machine, ByLabel)
    assert [p.name for p in machine.nuisances] == ['friction', 'mass', *(
        f'{name}[day={day["day"]}]' for name in ('friction', 'mass') for day in DAYS)]
    point = {'friction': 0.1, 'friction[day=Tue]': 0.02, 'friction[day=Wed]': -0.03}
    assert [machine.labels.in_test(point, k)['friction'] for k in range(3)] == pytest.approx(
        [0.1, 0.12, 0.07])
    assert machine.labels.mean(point)['friction'] == pytest.approx(0.1 + (0.02 - 0.03) / 2.0)
    # however far a day is off, what is positive within its tolerance stays so
    assert machine.labels.in_test({'mass': -0.3, 'mass[day=Mon]': -9.0}, 0)['mass'] > -0.6


def test_the_derivatives_by_deviations_are_exact_and_cost_no_run() -> None:
    body = Linear([{}] * 3, DAYS)
    problem = LeastSquares(by_label(body))
    numbers = problem.machine.nuisances
    plain = LeastSquares(body)
    for jacobian_of, wanted in ((plain, body.nuisances), (problem, numbers)):
        at_zero = jacobian_of.residuals({})
        before = body.runs
        found = jacobian_of.jacobian({}, wanted, at_zero, central=False)
        assert body.runs - before == 6
    for j, item in enumerate(numbers):
        slope = {'friction': PUSH, 'mass': RATE}[item.of or item.name]
        for k, labels in enumerate(DAYS):
            there = item.label in (None, ('day', labels['day']))
            assert found[problem.rows(k), j] == pytest.approx(
                slope / NOISE if there else np.zeros(TIME.size), abs=1e-2)


@pytest.mark.parametrize('off', [(0.0, 0.02, -0.02), (0.1, 0.07, 0.16), (0.02, 0.02, 0.021)])
def test_spread_and_intervals_are_those_of_a_model_of_variance_components(
        off: Sequence[float]) -> None:
    machine = Linear([{'friction': value} for value in off], DAYS)
    data, numbers = told(diagnose(machine))
    assert data['verdict'] == 'no_gap'
    usual, own = spread_of(machine.nuisances[0], 'day'), own_deviation()
    assert usual == 0.25 * SIGMA
    means = np.array([np.linalg.lstsq(np.column_stack([PUSH, RATE]), e.measured[:, 0],
                                      rcond=None)[0][0] - 1.0 for e in machine.experiments])

    def covariance(square: float) -> FloatArray:
        return np.asarray((square + own ** 2) * np.eye(3) + SIGMA ** 2)

    def unlikely(square: float) -> float:
        known = covariance(square)
        return float(0.5 * np.linalg.slogdet(known)[1] + 0.5 * means @ np.linalg.solve(
            known, means) + math.log(square) + usual ** 2 / square)

    best = minimize_scalar(unlikely, bounds=(1e-5, 1e-1), method='bounded').x
    found = numbers['friction']
    assert found['spread'] == pytest.approx(math.sqrt(best), rel=0.05)
    weights = np.linalg.solve(covariance(best), np.ones(3))
    sure = SIGMA ** 2 - SIGMA ** 4 * weights.sum()
    assert found['value'] == pytest.approx(1.0 + SIGMA ** 2 * weights @ means, abs=2e-3)
    assert half(found['ci95']) == pytest.approx(math.sqrt(sure), rel=0.05)
    assert half(found['another_day']) == pytest.approx(math.sqrt(sure + best), rel=0.05)
    for day, mean in zip(DAYS, means, strict=True):
        of_day = found['by']['day'][day['day']]
        assert of_day['value'] == pytest.approx(1.0 + mean, abs=2e-3)
        assert half(of_day['ci95']) == pytest.approx(own, rel=0.3)
    assert not found['differs'] and not numbers['mass']['differs']
    # what differs clearly is the day's, even where such a spread is usual
    assert found['belongs_to'] == ('day' if max(off) - min(off) > 0.03 else 'machine')
    assert numbers['mass']['belongs_to'] == 'machine'


def test_without_labels_a_number_is_as_sure_as_a_single_day_allows() -> None:
    _, numbers = told(diagnose(Linear([{}] * 2, [{}] * 2)))
    for name, spread in (('friction', 0.25 * SIGMA), ('mass', 0.01)):
        assert half(numbers[name]['ci95']) == pytest.approx(spread, rel=0.1)
        assert half(numbers[name]['another_day']) == pytest.approx(math.sqrt(2.0) * spread,
                                                                   rel=0.1)
        assert numbers[name]['by'] == {} and numbers[name]['belongs_to'] == 'machine'


def test_another_specimen_is_told_from_another_day() -> None:
    labels = [{'day': str(k), 'specimen': 'AABB'[k]} for k in range(4)]
    off = (0.01, -0.02, -0.29, -0.31)
    verdict = diagnose(Linear([{'friction': value} for value in off], labels))
    data, numbers = told(verdict)
    assert data['verdict'] == 'no_gap'
    [key] = numbers['friction']['differs']
    one = numbers['friction']['differs'][key]
    assert key == numbers['friction']['belongs_to'] == 'specimen' and one['under'] == 'B'
    assert one['ci95'][0] < one['value'] < one['ci95'][1]
    assert one['value'] == pytest.approx(-0.295, abs=0.02)
    assert 'The recordings contradict each other: friction is off by -0.' in data['sentence']
    assert 'under specimen B' in data['sentence']
    page = render('verdict.html', **contents(verdict))
    assert 'What holds on another day' in page and 'under specimen\nB' in page


@pytest.mark.parametrize('jump', [0.05, 0.2])
def test_a_day_that_is_off_by_more_than_days_are_is_told(jump: float) -> None:
    machine = Linear([{'friction': value} for value in (0.0, jump, 0.0)], DAYS)
    verdict = diagnose(machine)
    [found] = [item for item in verdict.reproducibility if item['number'] == 'friction']
    assert bool(found['differs']) == (jump > 0.1)
    assert ('recordings contradict' in verdict.summary()) == (jump > 0.1)
    assert 'friction, of the day: ' in verdict.summary()
    assert not found['differs'] or found['differs']['day']['under'] == 'Tue'


def test_nothing_differs_between_repeats() -> None:
    labels = [{'day': 'Mon', 'repeat': str(k)} for k in range(2)]
    assert groups_of(Linear([{}] * 2, labels).experiments) == {}


def test_repeats_tell_noise_from_what_a_model_lacks() -> None:
    random = np.random.default_rng(8)
    lacks = 4.0 * NOISE * np.sin(0.9 * TIME)[:, np.newaxis]
    residuals = [lacks + 6.0 * NOISE * random.normal(size=lacks.shape) for _ in range(3)]

    def white_and_slow(labels: Sequence[Mapping[str, str]]) -> tuple[float, float]:
        experiments = Linear([{}] * 3, labels).experiments
        noise = found_noise(with_estimated_noise(experiments, residuals, DEFAULT.noise))['force']
        return noise['white'], noise['slow']

    white, slow = white_and_slow([{'repeat': str(k)} for k in range(3)])
    assert white == pytest.approx(36.0, rel=0.1) and slow < 1.0
    white, slow = white_and_slow([{}] * 3)
    assert white == pytest.approx(9.0) and slow > 3.0
