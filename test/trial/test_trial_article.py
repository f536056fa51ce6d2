# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The real antenna against the table of published and reference figures, T1 to T4."""

from __future__ import annotations

import functools
import math

from lab.antenna.machine import reference_machine
from lab.antenna.real_antenna import simulate, TrueSignals
from lab.antenna.sheet import CaseSheet
import numpy as np
from numpy.typing import NDArray
import pytest

N = 14868.0
HALF_PERIOD_S = 3.15
CURRENT_LIMIT_A = 5.049
OLD_POLE = 1.369863


@functools.cache
def square(bias_v: float) -> TrueSignals:
    """Run T1 or T2: a square wave of 0.013 deg/s and 6.3 s."""
    sheet = CaseSheet('old', 'old', {'type': 'fixed', 'voltage_V': bias_v},
                      {'type': 'square', 'amplitude_deg_s': 0.013, 'period_s': 6.3})
    return simulate(reference_machine(), sheet, np.arange(0.0, 31.499, 0.0005))


def after_reversal(history: TrueSignals, first: float, last: float) -> NDArray[np.bool_]:
    """Select the samples so long after a reversal, the first period left out."""
    since = np.mod(history.time, HALF_PERIOD_S)
    return (history.time > 2.0 * HALF_PERIOD_S) & (since >= first) & (since <= last)


def rms(values: NDArray[np.float64]) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


@functools.cache
def sawtooth(circuit: str, pot: float) -> NDArray[np.float64]:
    """Run T3 and return the bias voltage after the first period."""
    sheet = CaseSheet(circuit, circuit, {'type': 'circuit', 'bias_pot': pot, 'start': 'steady'},
                      {'type': 'triangle', 'amplitude_deg_s': 0.685, 'period_s': 5.0})
    history = simulate(reference_machine(circuit, circuit, pot), sheet,
                       np.arange(0.0, 30.0, 0.001))
    return history.bias[history.time > 5.0]


def bias_step(circuit: str, gain: float, pole: float,
              seconds: float = 20.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Run T4 and return times and the relative torque bias in percent."""
    machine = reference_machine(circuit, circuit, 0.7)
    machine.circuit['filter_gain'] = gain
    machine.circuit['filter_pole'] = pole
    sheet = CaseSheet(circuit, circuit, {'type': 'circuit', 'bias_pot': 0.7, 'start': 'zero'}, {})
    history = simulate(machine, sheet, np.arange(0.0, seconds, 0.001))
    return history.time, 100.0 * (history.current[1] - history.current[0]) / CURRENT_LIMIT_A


def step_figures(circuit: str, gain: float, pole: float) -> tuple[float, float, float]:
    """Return final value [percent], overshoot [percent] and settling time to 5 percent [s]."""
    time, bias = bias_step(circuit, gain, pole)
    final = float(np.mean(bias[-2000:]))
    outside = np.nonzero(np.abs(bias - final) > 0.05 * final)[0]
    return final, 100.0 * (float(bias.max()) / final - 1.0), float(time[outside[-1] + 1])


def growth(gain: float) -> float:
    """Return how fast the oscillation about the settled bias grows [1/s]."""
    time, bias = bias_step('old', gain, OLD_POLE)
    early, late = (float(np.std(bias[(time > start) & (time < start + 2.0)]))
                   for start in (8.0, 13.0))
    return math.log(late / early) / 5.0


def test_t1_plateau_and_friction_current() -> None:
    history = square(0.0)
    inside = after_reversal(history, 1.5, 3.0)
    sign = np.sign(history.command[inside])
    assert np.degrees(np.mean(history.tach[:, inside] * sign, axis=1)) == pytest.approx(
        [193.1, 193.1], abs=0.05)
    assert np.mean(history.current[:, inside] * sign, axis=1) == pytest.approx(
        [1.0, 1.0], abs=0.005)


def test_t2a_currents_part_under_bias() -> None:
    history = square(6.204)
    later = history.time >= 2.0 * HALF_PERIOD_S
    assert np.mean(history.current[:, later], axis=1) == pytest.approx([-0.38, 0.38], abs=0.005)


def test_t2b_less_chaotic_under_bias() -> None:
    free, biased = square(0.0), square(6.204)
    inside = after_reversal(free, 0.25, 2.0)

    def change(error_biased: NDArray[np.float64], error_free: NDArray[np.float64]) -> float:
        return 100.0 * (rms(error_biased[inside]) / rms(error_free[inside]) - 1.0)

    tach = [np.mean(h.tach, axis=0) - N * h.command for h in (biased, free)]
    axis = [h.axis_rate - h.command for h in (biased, free)]
    one = [h.tach[0] - N * h.command for h in (biased, free)]
    assert change(*tach) == pytest.approx(-20.0, abs=0.5)
    assert change(*axis) == pytest.approx(-6.0, abs=0.5)
    assert change(*one) == pytest.approx(-11.0, abs=0.5)


def test_t3a_old_circuit_loses_its_bias() -> None:
    bias = sawtooth('old', 0.8)
    assert bias.min() == 0.0
    assert bias.max() == pytest.approx(10.4, abs=0.05)
    assert 100.0 * np.mean(bias <= 0.0) == pytest.approx(16.5, abs=0.05)


def test_t3b_new_circuit_keeps_its_bias() -> None:
    bias = sawtooth('new', 0.892)
    assert bias.min() == pytest.approx(7.24, abs=0.005)
    assert bias.max() == pytest.approx(11.60, abs=0.005)


@pytest.mark.parametrize(('gain', 'overshoot', 'settling'), [
    (3.31, 80.0, 2.43), (33.14, 19.0, 0.80), (48.67, 10.0, 0.61), (69.60, 8.0, 0.69),
    (106.03, 5.0, 0.55)])
def test_t4b_gain_of_filter_1(gain: float, overshoot: float, settling: float) -> None:
    final, over, settled = step_figures('old', gain * OLD_POLE, OLD_POLE)
    assert final == pytest.approx(22.0, abs=0.05)
    assert over == pytest.approx(overshoot, abs=0.5)
    assert settled == pytest.approx(settling, abs=0.006)


@pytest.mark.parametrize(('time_constant', 'overshoot', 'settling'), [
    (0.20, 38.0, 1.25), (0.1125, 13.0, 0.93), (0.073, 1.0, 0.90), (0.050, 0.0, 1.35)])
def test_t4d_pole_of_filter_1(time_constant: float, overshoot: float, settling: float) -> None:
    _, over, settled = step_figures('old', 4.54, 1.0 / time_constant)
    assert over == pytest.approx(overshoot, abs=0.5)
    assert settled == pytest.approx(settling, abs=0.006)


def test_t4c_stability_limit() -> None:
    assert growth(145.0) < 0.0
    assert 0.04 < growth(146.0) < 0.05


def test_t4e_new_filter_and_circuit() -> None:
    _, over, settled = step_figures('new', 66.67, 8.889)
    assert over == pytest.approx(2.0, abs=0.5)
    assert settled == pytest.approx(0.76, abs=0.006)
