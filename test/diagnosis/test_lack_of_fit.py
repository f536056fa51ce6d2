# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a fit leaves, on a reading of nothing with waves of known size in it."""

from __future__ import annotations

import math

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Experiment, FloatArray, Machine, Parameter, Point
from simgap.verdict.diagnosis import diagnose
from simgap.verdict.lack_of_fit import enough
from simgap.verdict.record import Verdict

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


def left(noise: float, wave: float, quantised: tuple[str, ...] = ()) -> Verdict:
    """Return the verdict on noise and a wave of these rms, in deviations of the stated noise."""
    seen = noise * np.random.default_rng(3).normal(size=TIME.size) + wave * WAVE
    return diagnose(Still(seen, quantised))


def unknown(verdict: Verdict) -> float:
    [found] = [answer.probability for answer in verdict.which if answer.effects == ['unknown']]
    return found


def test_a_hum_no_louder_than_noise_may_be_is_unknown() -> None:
    """The sensor of the sheet is as loud as the hum, so its loudness tells nothing."""
    assert unknown(left(0.4, 0.9)) > 0.7
    assert unknown(left(1.0, 0.0)) < 0.1
    assert unknown(left(1.0, 0.4)) < 0.1


def test_what_is_quieter_than_noise_is_no_gap() -> None:
    """A recording without noise leaves rounding and a model's last digits, which are regular."""
    quiet = left(0.01, 0.2)
    assert quiet.word == 'no_gap' and unknown(quiet) < 0.15


def test_a_digit_is_no_hum() -> None:
    verdict = left(0.1, 1.0, quantised=('seen',))
    assert unknown(verdict) < 0.1


def test_few_samples_of_a_signal_are_not_enough() -> None:
    machine = Still(WAVE)
    assert enough(LeastSquares(machine))
    machine.experiments[0].measured[50:] = np.nan
    assert not enough(LeastSquares(machine))
