# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tests of the bounded robust fits, on a machine whose answer is known in closed form."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.optimize import lsq_linear
from simgap.fit.box_qp import box_constrained_step
from simgap.fit.least_squares import LeastSquares
from simgap.fit.robust_loss import robust_loss, robust_weight
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point

OFFSET = Parameter('offset', '1', -1.0, 1.0, 1e-3, 0.5)
RATE = Parameter('rate', '1', 0.0, 3.0, 1e-3)


class Decay(Machine):
    """A toy: y = exp(-rate t) + offset."""

    def __init__(self, rate: float, noise: float) -> None:
        """Measure with known noise."""
        time = np.linspace(0.0, 3.0, 400)
        clean = np.exp(-rate * time) + noise * np.random.default_rng(1).normal(size=400)
        super().__init__(
            [Experiment('toy', time, ('y',), ('1',), clean[:, np.newaxis],
                        np.full((400, 1), noise))],
            [OFFSET], [Effect('toy.rate', 'toy', '', (Form('', (RATE,)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the closed form."""
        time = self.experiments[experiment].time
        return np.asarray(np.exp(-point.get('rate', 0.0) * time)
                          + point.get('offset', 0.0))[:, np.newaxis]


def test_fit_finds_the_known_answer() -> None:
    model = Decay(0.7, 0.01)
    problem = LeastSquares(model)
    state = problem.fit(problem.start((OFFSET, RATE), {}), 20)
    assert state.point()['rate'] == pytest.approx(0.7, abs=0.01)
    assert state.point()['offset'] == pytest.approx(0.0, abs=0.01)


def test_fit_never_leaves_the_bounds() -> None:
    model = Decay(5.0, 0.01)
    problem = LeastSquares(model)
    state = problem.fit(problem.start((OFFSET, RATE), {}), 20)
    assert 0.0 <= state.point()['rate'] <= 3.0 and -1.0 <= state.point()['offset'] <= 1.0


def test_central_differences_are_the_derivative() -> None:
    problem = LeastSquares(Decay(0.7, 0.01))
    point = {'rate': 0.5, 'offset': 0.1}
    residual = problem.residuals(point)
    columns = problem.jacobian(point, (OFFSET, RATE), residual, central=True)
    time = problem.experiments[0].time
    assert columns[:, 0] == pytest.approx(np.full(400, 100.0), rel=1e-4)
    assert columns[:, 1] == pytest.approx(-100.0 * time * np.exp(-0.5 * time), abs=1e-2)


def test_fresh_derivatives_are_local_where_the_usual_step_is_long() -> None:
    """Over 0.3 of a rate the decay bends; a few standard deviations of the noise are straight."""
    long_step = Parameter('rate', '1', 0.0, 3.0, 0.3)
    problem = LeastSquares(Decay(0.7, 1e-4))
    state = problem.start((OFFSET, long_step), {'rate': 0.5})
    time = problem.experiments[0].time
    exact = -time * np.exp(-0.5 * time) / 1e-4
    assert np.abs(state.jacobian[:, 1] - exact).max() > 0.1 * np.abs(exact).max()
    fresh = problem.refreshed(state)
    np.testing.assert_allclose(fresh.jacobian[:, 1], exact, atol=0.01 * np.abs(exact).max())
    assert np.array_equal(fresh.x, state.x)


def test_derivatives_of_a_staircase_step_over_its_treads() -> None:
    """A delay in samples changes nothing over less than a sample."""
    class Delayed(Decay):
        def predict(self, point: Point, experiment: int) -> FloatArray:
            """Return a ramp that comes a whole number of samples late."""
            time = self.experiments[experiment].time
            late = round(point.get('delay', 0.0) / (time[1] - time[0]))
            return np.asarray(np.maximum(np.arange(time.size) - late, 0.0))[:, np.newaxis]

    problem = LeastSquares(Delayed(0.7, 1e-4))
    sample = problem.experiments[0].time[1]
    for least, seen in ((0.0, False), (2.0 * sample, True)):
        delay = Parameter('delay', 's', 0.0, 1.0, 2.0 * sample, least_step=least)
        fresh = problem.refreshed(problem.start((delay,), {'delay': 10.0 * sample}))
        assert np.any(fresh.jacobian) == seen


def test_a_rounding_error_at_a_bound_leaves_the_derivative() -> None:
    """A difference quotient that reaches from one bound to the other needs all the room."""
    switch = replace(RATE, high=1.0, step=1.0)
    problem = LeastSquares(Decay(0.7, 0.01))
    for value in (1.0, np.nextafter(1.0, 0.0), 0.0, 5e-17):
        point = {'offset': 0.0, 'rate': float(value)}
        found = problem.jacobian(point, [switch], problem.residuals(point), central=True)
        time = problem.experiments[0].time
        np.testing.assert_allclose(found[:, 0], (np.exp(-time) - 1.0) / 0.01, rtol=1e-5)


class Diverging(Decay):
    """The same, whose offset is taken as linear from a run that diverged half-way."""

    diverged = np.inf

    def linear_response(self, name: str, experiment: int) -> FloatArray | None:
        """Return one, and what is no number later."""
        late = self.experiments[experiment].time > 1.5
        return np.where(late, self.diverged, 1.0)[:, np.newaxis] if name == 'offset' else None


@pytest.mark.parametrize('value', [np.inf, -np.inf, np.nan, 1e300])
def test_a_linear_response_that_diverged_leaves_a_fit_finite(value: float) -> None:
    model = Diverging(0.7, 0.01)
    model.diverged = value
    problem = LeastSquares(model)
    state = problem.fit(problem.start((OFFSET, RATE), {}), 20)
    assert np.isfinite(state.jacobian).all() and math.isfinite(state.cost)


def test_what_was_not_measured_counts_for_nothing() -> None:
    model = Decay(0.7, 0.01)
    model.experiments[0].measured[100:] = np.nan
    problem = LeastSquares(model)
    assert problem.samples == 100
    assert not problem.residuals({'rate': 2.0})[100:].any()


def test_an_outlier_does_not_pull() -> None:
    model = Decay(0.7, 0.01)
    model.experiments[0].measured[50] += 100.0
    problem = LeastSquares(model)
    state = problem.fit(problem.start((OFFSET, RATE), {}), 20)
    assert state.point()['rate'] == pytest.approx(0.7, abs=0.02)


@given(st.integers(1, 12), st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_box_constrained_step_agrees_with_an_independent_solver(m: Any, seed: Any) -> None:
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(3 * m, m))
    target = random.normal(size=3 * m) * 3.0
    low, high = -random.uniform(0.0, 1.0, m), random.uniform(0.01, 1.0, m)
    step = box_constrained_step(matrix.T @ matrix, matrix.T @ target, low, high)
    best = lsq_linear(matrix, target, (low, high), method='bvls', tol=1e-12)

    def cost(x: Any) -> Any:
        return 0.5 * float(np.sum((matrix @ x - target) ** 2))

    assert np.all(step >= low) and np.all(step <= high)
    assert cost(step) <= cost(best.x) + 1e-6 * (1.0 + cost(best.x))


@given(st.integers(2, 12), st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_a_flat_direction_of_a_rounded_hessian_goes_nowhere(m: Any, seed: Any) -> None:
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(200, m))
    matrix[:, -1] = matrix[:, 0]
    target = matrix[:, 0] + 0.1 * random.normal(size=200)
    # in single precision the least eigenvalue may have either sign
    hessian = matrix.T @ matrix
    hessian -= 1e-9 * np.diag(np.diag(hessian))
    gradient = matrix.T @ target * (1.0 + 1e-6 * random.normal(size=m))
    step = box_constrained_step(hessian, gradient, np.full(m, -1e3), np.full(m, 1e3))
    best = np.linalg.lstsq(matrix, target, rcond=None)[0]
    left, least = (float(np.sum((matrix @ x - target) ** 2)) for x in (step, best))
    assert np.abs(step).max() < 10.0
    assert left < least * (1.0 + 1e-4)


def test_robust_loss_is_the_square_within_and_logarithmic_beyond() -> None:
    assert robust_loss(np.array([2.0]), 3.0) == 2.0
    ten, twenty = (robust_loss(np.array([z]), 3.0) for z in (10.0, 20.0))
    assert twenty - ten == pytest.approx(9.0 * math.log(2.0))
    # where one becomes the other neither the loss nor its slope jumps
    around = [robust_loss(np.array([3.0 + d]), 3.0) for d in (-1e-4, 0.0, 1e-4)]
    assert around[2] - around[1] == pytest.approx(around[1] - around[0], rel=1e-3)
    # the weight is the slope over the residual
    weight = robust_weight(np.array([2.0, 10.0]), np.array([True, True]), 3.0)
    np.testing.assert_allclose(weight, [1.0, 9.0 / 100.0])
