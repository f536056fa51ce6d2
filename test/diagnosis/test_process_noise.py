# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Noise of the process: what is left of a residual is white under its covariance."""

import numpy as np
import pytest
from simgap.fit.process_noise import ProcessNoise, without_process
from simgap.machine.contract import Experiment

COUNT = 60
RANDOM = np.random.default_rng(7)
COLUMNS = 3.0 * RANDOM.normal(size=(COUNT, 5))


@pytest.mark.parametrize('scale', [1.0, 4.0])
def test_residuals_are_white_under_the_covariance_of_sensors_and_process(scale: float) -> None:
    root = ProcessNoise.of(COLUMNS).whitened(np.eye(COUNT), scale)
    covariance = np.eye(COUNT) + COLUMNS @ COLUMNS.T / scale ** 2
    assert root @ covariance @ root.T == pytest.approx(np.eye(COUNT), abs=1e-4)


def test_what_the_process_does_is_its_conditional_mean() -> None:
    noise = RANDOM.uniform(0.5, 2.0, (COUNT // 2, 2))
    process = (COLUMNS.reshape(COUNT // 2, 2, 5) * noise[..., np.newaxis])
    residual = noise * RANDOM.normal(size=noise.shape) + process @ RANDOM.normal(size=5)
    measured = residual.copy()
    measured[3, 1] = residual[3, 1] = np.nan
    experiment = Experiment('test', np.arange(0.0, COUNT // 2), ('a', 'b'), ('1', '1'), measured,
                            noise, process=process)
    left = without_process(experiment, residual, bound=1e9)
    # of jointly normal numbers
    there = np.isfinite(residual).ravel()
    moves = process.reshape(COUNT, 5)
    sum_of_both = (moves @ moves.T + np.diag(noise.ravel() ** 2))[np.ix_(there, there)]
    mean = moves @ moves[there].T @ np.linalg.solve(sum_of_both, residual.ravel()[there])
    assert left.ravel()[there] == pytest.approx((residual.ravel() - mean)[there], abs=1e-9)
    assert np.isnan(left[3, 1])


def test_without_a_process_nothing_is_taken_away() -> None:
    ones = np.ones((3, 1))
    experiment = Experiment('test', np.arange(0.0, 3.0), ('a',), ('1',), ones, ones)
    residual = np.array([[1.0], [2.0], [np.nan]])
    assert without_process(experiment, residual, 5.0) is residual
