# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive's linear parts: against the loop gain in closed form, and against simulation."""

from __future__ import annotations

import cmath
import math

from antenna_drive.article.stability import bias_loop, growth, growth_rate, stability_limit
from antenna_drive.parameters import load
import numpy as np
import pytest
from scipy.optimize import brentq

POLES = (1.0 / 0.73, 1.0 / 0.1125)


def phase_crossing_limit(pole: float) -> tuple[float, float]:
    """Return gain [1/s] and frequency [Hz] at which the loop gain is -1, rotors held."""
    drive = load()
    amplifier, armature = drive.motor_2.amplifier, drive.motor_2.armature
    loop = armature.resistance + amplifier.current_feedback_gain

    def loop_gain(omega: float) -> complex:
        s = 1j * omega
        return (drive.torque_share.filter_1.difference_gain * 2.0 * amplifier.rate_gain
                * amplifier.bias_command_gain * (1.0 + 1.0 / (amplifier.integral_time * s))
                / (1.0 + amplifier.lag * s) / (1.0 + armature.inductance / loop * s) / (s + pole))

    omega = brentq(lambda omega: cmath.phase(-loop_gain(omega)), 50.0, 300.0)
    return 1.0 / abs(loop_gain(omega)), omega / (2.0 * math.pi)


@pytest.mark.parametrize('pole', POLES)
def test_the_limit_is_where_the_loop_gain_is_minus_one(pole: float) -> None:
    gain, frequency = phase_crossing_limit(pole)
    limit = stability_limit(load(), pole)
    assert limit == pytest.approx(gain, rel=1e-8)
    matrix = bias_loop(load(), limit, pole, rotors_held=True)
    fastest = max(np.linalg.eigvals(matrix), key=lambda root: root.real)
    assert abs(fastest.imag) / (2.0 * math.pi) == pytest.approx(frequency, rel=1e-6)


def test_the_limits_are_those_of_the_reference_model() -> None:
    drive = load()
    assert stability_limit(drive, POLES[0]) == pytest.approx(145.4, abs=0.05)
    assert stability_limit(drive, POLES[0], rotors_held=False) == pytest.approx(156.6, abs=0.05)
    assert stability_limit(drive, POLES[1]) == pytest.approx(189.0, abs=0.5)


@pytest.mark.parametrize('gain', [140.0, 143.0, 148.0, 150.0])
def test_simulation_and_eigenvalues_agree_on_how_fast_a_disturbance_grows(gain: float) -> None:
    drive = load('old_circuit')
    expected = growth(bias_loop(drive, gain, POLES[0], rotors_held=True))
    # the lock-step at 1 ms moves the limit by 0.4 of 145, and growth with it
    assert growth_rate(drive, gain, POLES[0]) == pytest.approx(expected, abs=0.06)
