# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Statistics of residuals whose answers are known: white noise, AR(1), a sine, a staircase."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from simgap.fit.residual_statistics import autocorrelation, power, slow_excess
from simgap.machine.contract import FloatArray

N = 200_000
WHITE: FloatArray = np.random.default_rng(11).normal(size=N)


def test_white_noise_has_power_one_and_nothing_slow() -> None:
    assert power(WHITE) == pytest.approx(1.0, abs=0.01)
    assert slow_excess(WHITE) == pytest.approx(0.0, abs=0.03)
    assert autocorrelation(WHITE) < 0.01


@pytest.mark.parametrize('phi', [0.3, 0.6, 0.9])
def test_an_autoregressive_residual_is_as_slow_as_theory_says(phi: float) -> None:
    """AR(1) of unit variance: half the squared step is 1 - phi, lag one correlates by phi."""
    z = np.asarray(lfilter([np.sqrt(1.0 - phi ** 2)], [1.0, -phi], WHITE))
    lags = np.arange(1, 10)
    mean_of_ten = (1.0 + 2.0 * np.sum((1.0 - lags / 10.0) * phi ** lags)) / 10.0
    assert slow_excess(z) == pytest.approx(10.0 * mean_of_ten / (1.0 - phi) - 1.0, rel=0.04)
    assert autocorrelation(z) == pytest.approx(phi, abs=0.01)


def test_too_short_a_residual_says_nothing() -> None:
    assert slow_excess(np.ones(30)) == 0.0
    assert autocorrelation(np.ones(30) + 1e-3 * WHITE[:30]) == 0.0
    assert power(np.full(5, np.nan)) == 0.0
