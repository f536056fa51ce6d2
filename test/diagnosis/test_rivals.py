# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Answers that share a fit are apart where one of its effects exceeds its tolerance by little."""

from __future__ import annotations

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.next_test.design import objective_for
from simgap.next_test.discrimination import separation
from simgap.next_test.rivals import Findings, Rival, rivals_of, within
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT
from simgap.verdict.verdict import Answer

TOLERANCE = 0.02


class Gauge(Machine):
    """A gauge with a gain that deviates by a tolerance: y = (1 + gain) t + zero."""

    def __init__(self, gain: float, sigma: float) -> None:
        time = np.linspace(0.0, 1.0, 200)
        size = Parameter('gauge.gain', '1', -1.0, 1.0, 0.01, tolerance=TOLERANCE)
        noise = np.random.default_rng(3).normal(0.0, sigma, time.size)
        super().__init__(
            [Experiment('one', time, ('y',), ('m',), ((1.0 + gain) * time + noise)[:, np.newaxis],
                        np.full((time.size, 1), sigma), model_error=np.zeros(1))],
            [Parameter('zero', 'm', -1.0, 1.0, 0.01, 0.05)],
            [Effect('gauge.gain', 'gauge', '', '', (Form('', (size,)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        time = self.experiments[experiment].time
        y = (1.0 + point.get('gauge.gain', 0.0)) * time + point.get('zero', 0.0)
        return np.asarray(y[:, np.newaxis])


def answers_of(machine: Machine) -> list[Rival]:
    problem = LeastSquares(machine)
    [form] = machine.catalogue['gauge.gain'].forms
    state = problem.fit(problem.start([*machine.nuisances, *form.parameters], {}), 20)
    fitted = Hypothesis(('gauge.gain',), (form,), state)
    return rivals_of(problem, [Answer(fitted, 0.0, 0.7, ('gauge.gain',)),
                               Answer(fitted, 0.0, 0.25, ())], 1.0, DEFAULT.planning)


@pytest.mark.parametrize('gain', [0.024, -0.024])
def test_each_answer_of_a_fit_is_in_its_own_region(gain: float) -> None:
    beyond, inside = answers_of(Gauge(gain, sigma=0.03))
    assert beyond.effects == inside.effects == ('gauge.gain',)
    assert abs(beyond.point['gauge.gain']) > TOLERANCE > abs(inside.point['gauge.gain'])
    assert beyond.point['gauge.gain'] * gain > 0.0
    # the offset follows the gain: measured at the same place, a greater gain has a lower zero
    assert (beyond.point['zero'] - inside.point['zero']) * gain < 0.0


def test_a_more_precise_test_tells_them_apart() -> None:
    rivals = answers_of(Gauge(0.024, sigma=0.03))
    coarse, fine = (separation(Gauge(0.0, sigma), rivals, 1.0).information(1.0)
                    for sigma in (0.3, 0.003))
    assert fine > 0.1
    assert fine > 3.0 * coarse


@pytest.mark.parametrize(('low', 'high'), [
    (-1.0, 0.3), (0.5, np.inf), (-np.inf, 1.2), (-0.1, 0.1)])
def test_a_normal_number_within_bounds_takes_the_others_along(low: float, high: float) -> None:
    random = np.random.default_rng(7)
    mean, root = np.array([0.4, -1.0, 2.0]), random.normal(size=(3, 3))
    known = root @ root.T
    drawn = random.multivariate_normal(mean, known, 4_000_000)
    kept = drawn[(drawn[:, 1] > low) & (drawn[:, 1] < high)]
    values, covariance = within(mean, known, 1, low, high)
    error = np.sqrt(np.diag(known) / len(kept))
    assert (abs(values - kept.mean(axis=0)) < 4.0 * error).all()
    np.testing.assert_allclose(covariance, np.cov(kept.T), rtol=0.0, atol=float(
        8.0 * known.max() / np.sqrt(len(kept))))


@pytest.mark.parametrize(('low', 'high'), [(0.0, 0.0), (-1e-9, 1e-9), (1e5, np.inf)])
def test_bounds_far_away_or_next_to_each_other_leave_a_covariance(
        low: float, high: float) -> None:
    known = np.array([[1.0, 0.5], [0.5, 2.0]])
    values, covariance = within(np.array([1.0, -3.0]), known, 0, low, high)
    assert values[0] == pytest.approx(min(max(0.0, low), high), rel=1e-6, abs=1e-8)
    assert values[1] == pytest.approx(-3.0 + 0.5 * (values[0] - 1.0))
    assert (np.linalg.eigvalsh(covariance) > 0.0).all()
    assert covariance[0, 0] < 1e-5


@pytest.mark.parametrize(('known', 'objective'), [
    ([], 'detect'), ([0.64], 'detect'), ([0.95], 'detect'),
    ([0.5, 0.45], 'separate'), ([0.89, 0.06], 'separate'), ([0.4, 0.3], 'separate'),
    ([0.92, 0.03], 'detect'),
    # one answer and `unknown`: the rest has next to nothing
    ([0.64, 0.012], 'detect'), ([0.012, 0.64], 'detect'),
    # something without a name is likelier than each answer
    ([0.31, 0.17], 'detect'), ([0.4, 0.21], 'separate')])
def test_the_next_test_looks_beyond_what_is_as_good_as_one_answer(
        known: list[float], objective: str) -> None:
    rivals = [Rival((), (), (), probability, (), np.zeros(0), np.zeros((0, 0)))
              for probability in known]
    assert objective_for(Findings(rivals)) == objective
