# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Noise of the process: what is left of a residual is white under its covariance."""

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.fit.process_noise import ProcessNoise, without_process
from simgap.fit.starts import least_cost
from simgap.machine.contract import Experiment, FloatArray, Machine, Parameter, Point
from simgap.machine.responses import ProcessResponses, Responses

COUNT, WIDTH = 60, 9
RANDOM = np.random.default_rng(7)
ROOT = np.tril(RANDOM.normal(size=(5, 5)))
# of two readings, the last of which ends after the test
PULSES = Responses(np.array([0, 4, 9, 15, 26]), RANDOM.normal(size=(WIDTH, 2, 5)))


def columns() -> FloatArray:
    """Return the responses as a matrix, shape (n c, m), by a loop."""
    whole = np.zeros((COUNT // 2 + WIDTH, 2, 5))
    for j, first in enumerate(PULSES.first):
        whole[first:first + WIDTH, :, j] = PULSES.values[:, :, j]
    return whole[:COUNT // 2].reshape(COUNT, 5)


def test_responses_lie_where_each_begins() -> None:
    assert (PULSES.matrix(COUNT // 2).toarray() == columns()).all()


@pytest.mark.parametrize('scale', [1.0, 4.0])
def test_residuals_are_white_under_the_covariance_of_sensors_and_process(scale: float) -> None:
    noise = ProcessNoise.of(PULSES.matrix(COUNT // 2), ROOT)
    root, moves = noise.whitened(np.eye(COUNT), scale), columns() @ ROOT
    covariance = np.eye(COUNT) + moves @ moves.T / scale ** 2
    assert root @ covariance @ root.T == pytest.approx(np.eye(COUNT), abs=1e-4)


def test_what_the_process_does_is_its_conditional_mean() -> None:
    noise = RANDOM.uniform(0.5, 2.0, (COUNT // 2, 2))
    moves = columns() @ ROOT
    residual = noise * RANDOM.normal(size=noise.shape) + (
        moves @ RANDOM.normal(size=5)).reshape(noise.shape)
    measured = residual.copy()
    measured[3, 1] = residual[3, 1] = np.nan
    experiment = Experiment('test', np.arange(0.0, COUNT // 2), ('a', 'b'), ('1', '1'), measured,
                            noise, process=ProcessResponses([PULSES], ROOT, 0.0 * noise))
    left = without_process(experiment, residual, bound=1e9)
    # of jointly normal numbers
    there = np.isfinite(residual).ravel()
    sum_of_both = (moves @ moves.T + np.diag(noise.ravel() ** 2))[np.ix_(there, there)]
    mean = moves @ moves[there].T @ np.linalg.solve(sum_of_both, residual.ravel()[there])
    assert left.ravel()[there] == pytest.approx((residual.ravel() - mean)[there], abs=1e-9)
    assert np.isnan(left[3, 1])


def test_without_a_process_nothing_is_taken_away() -> None:
    ones = np.ones((3, 1))
    experiment = Experiment('test', np.arange(0.0, 3.0), ('a',), ('1',), ones, ones)
    residual = np.array([[1.0], [2.0], [np.nan]])
    assert without_process(experiment, residual, 5.0) is residual


class Slope(Machine):
    """Two readings that grow with time."""

    def predict(self, point: Point, experiment: int) -> FloatArray:
        return np.outer(self.experiments[experiment].time, [point['slope'], 1.0])


@pytest.mark.parametrize('until', [8.0, 17.0, 1e9])
def test_what_was_not_simulated_does_not_count_whatever_the_process_does(until: float) -> None:
    """The cost is about half the number of samples, with the right slope, and more without."""
    time, noise = np.arange(0.0, COUNT // 2), np.full((COUNT // 2, 2), 0.05)
    random = np.random.default_rng(3)
    measured = np.outer(time, [0.3, 1.0]) + noise * random.normal(size=noise.shape) + 0.05 * (
        columns() @ ROOT @ random.normal(size=5)).reshape(noise.shape)
    experiment = Experiment('test', time, ('a', 'b'), ('1', '1'), measured, noise,
                            process=ProcessResponses([PULSES], 0.05 * ROOT, 0.0 * noise))
    problem = LeastSquares(Slope([experiment], [Parameter('slope', '1/s', -1.0, 1.0, 0.01)]))
    trials = [{'slope': value} for value in (0.2, 0.25, 0.3, 0.35, 0.4)]
    cost, point = least_cost(problem, trials, 0, until)
    assert point == {'slope': 0.3}
    assert cost < COUNT
