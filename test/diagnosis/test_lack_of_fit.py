# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a fit leaves, on a reading of nothing with waves of known size in it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Experiment, FloatArray, Machine, Parameter, Point
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT
from simgap.verdict.lack_of_fit import lack_of_fit
from simgap.verdict.verdict import LackOfFit, unknown_probability

TIME: FloatArray = np.arange(4000, dtype=np.float64) * 0.01
# a period of eight samples: one of the first lags is a whole period
WAVE: FloatArray = math.sqrt(2.0) * np.sin(2.0 * np.pi * 12.5 * TIME)


class Still(Machine):
    """A reading that should be its zero."""

    def __init__(self, seen: FloatArray, quantised: tuple[str, ...] = ()) -> None:
        super().__init__(
            [Experiment('one', TIME, ('seen',), ('m',), seen[:, np.newaxis],
                        np.ones((TIME.size, 1)), quantised=quantised)],
            [Parameter('zero', 'm', -0.1, 0.1, 1e-3, 0.05)], [])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the zero."""
        return np.full((TIME.size, 1), point.get('zero', 0.0))


def left(noise: float, wave: float, quantised: tuple[str, ...] = ()) -> LackOfFit:
    """Return what is left of noise and a wave of these rms, in deviations of the stated noise."""
    seen = noise * np.random.default_rng(3).normal(size=TIME.size) + wave * WAVE
    problem = LeastSquares(Still(seen, quantised))
    state = problem.fit(problem.start(problem.machine.nuisances, {}), 5)
    return lack_of_fit(problem, problem.residuals({}), Hypothesis((), (), state), None)


def unknown(lack: LackOfFit) -> float:
    return unknown_probability(lack, DEFAULT.verdict)


@pytest.mark.parametrize('noise, wave', [(0.4, 0.9), (0.5, 1.2), (1.0, 0.5), (0.9, 0.3)])
def test_a_wave_counts_by_its_share_of_what_is_left(noise: float, wave: float) -> None:
    """The autocorrelation at a whole period is the wave's share of the power."""
    share = wave ** 2 / (noise ** 2 + wave ** 2)
    found = left(noise, wave)
    assert found.regular == pytest.approx(
        share * min(1.0, noise ** 2 + wave ** 2), abs=0.03)
    assert found.most_regular == 'seen'


def test_a_hum_no_louder_than_noise_may_be_is_unknown() -> None:
    """The sensor of the sheet is as loud as the hum, so its loudness tells nothing."""
    hum = left(0.4, 0.9)
    assert hum.fast < DEFAULT.verdict.fast and unknown(hum) > 0.7
    assert unknown(left(1.0, 0.0)) < 0.1
    assert unknown(left(1.0, 0.5)) < 0.1


def test_what_is_quieter_than_noise_is_no_gap() -> None:
    """A recording without noise leaves rounding and a model's last digits, which are regular."""
    quiet = left(0.01, 0.2)
    assert quiet.regular < 0.05
    assert unknown(quiet) < 0.15


def test_a_digit_is_no_hum() -> None:
    lack = left(0.1, 1.0, quantised=('seen',))
    assert lack.regular == 0.0 and lack.left == 0.0 and unknown(lack) < 0.1
