# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Coupling, shaping, sensors and loops against closed forms."""

from __future__ import annotations

import math
from pathlib import Path
import subprocess
import sys

import numpy as np
from numpy.typing import NDArray
import pytest
from simgap.parts import compiled, coupling, harmonics, loop, sensor, shaping, wave
from simgap.parts.loop import Cascade

FloatArray = NDArray[np.float64]


@compiled
def two_masses(inertia: float, load: float, half_gap: float, stiffness: float, damping: float,
               twist: float, step: float, twists: FloatArray) -> None:
    """Let two masses go that are twisted against each other."""
    q, w, ql, wl = twist, 0.0, 0.0, 0.0
    for k in range(twists.size):
        torque = coupling.tooth_torque(q - ql, w - wl, half_gap, stiffness, damping)
        w -= step * torque / inertia
        wl += step * torque / load
        q += step * w
        ql += step * wl
        twists[k] = q - ql


def test_two_masses_on_a_shaft_swing_at_the_resonance_of_the_textbook() -> None:
    """Frequency sqrt(k (1/J + 1/J_l)), decay c (1/J + 1/J_l) / 2."""
    inertia, load, stiffness, damping, step = 0.02, 0.05, 30.0, 0.004, 1e-5
    twists = np.empty(100_000)
    two_masses(inertia, load, 0.0, stiffness, damping, 1e-3, step, twists)
    both = 1.0 / inertia + 1.0 / load
    decay = 0.5 * damping * both
    omega = math.sqrt(stiffness * both - decay ** 2)
    time = step * np.arange(1, twists.size + 1)
    exact = 1e-3 * np.exp(-decay * time) * (np.cos(omega * time)
                                            + decay / omega * np.sin(omega * time))
    assert np.abs(twists - exact).max() < 2e-6


def test_a_shaft_is_teeth_without_a_gap_a_spring_and_a_damper() -> None:
    @compiled
    def shaft(twist: float, rate: float) -> float:
        return coupling.tooth_torque(twist, rate, 0.0, 40.0, 0.3)

    for twist, rate in ((0.02, -5.0), (-0.01, 1.0), (0.0, 2.0)):
        assert shaft(twist, rate) == pytest.approx(40.0 * twist + 0.3 * rate)


@pytest.mark.parametrize('stiffness', [30.0, 3e4])
def test_the_steps_that_a_shaft_needs_keep_its_frequency_within_a_percent(
        stiffness: float) -> None:
    @compiled
    def steps(span: float, stiffness: float) -> int:
        return coupling.steps_for(span, stiffness, 0.0, 0.02, 0.05)

    omega = math.sqrt(stiffness * (1.0 / 0.02 + 1.0 / 0.05))
    span = 50.0 * 2.0 * math.pi / omega
    count = steps(span, stiffness)
    twists = np.empty(count)
    two_masses(0.02, 0.05, 0.0, stiffness, 0.0, 1e-3, span / count, twists)
    crossings = np.count_nonzero(np.diff(np.sign(twists)))
    assert crossings == pytest.approx(100, abs=1)
    assert np.abs(twists).max() < 1.2e-3


def test_teeth_push_at_the_ends_of_the_gap_only() -> None:
    @compiled
    def torque(twist: float, rate: float) -> float:
        return coupling.tooth_torque(twist, rate, 0.01, 100.0, 2.0)

    assert [torque(x, 0.0) for x in (-0.03, -0.01, 0.0, 0.01, 0.02)] == pytest.approx(
        [-2.0, 0.0, 0.0, 0.0, 1.0])
    assert torque(0.02, -1.0) == 0.0  # flanks that part do not pull


def test_a_gap_is_crossed_at_a_constant_rate() -> None:
    twists = np.empty(2000)
    two_masses(1.0, 1.0, 0.02, 50.0, 0.0, 0.03, 1e-3, twists)
    inside = np.flatnonzero(np.abs(twists) < 0.019)[:50]
    assert np.diff(twists[inside], 2) == pytest.approx(np.zeros(48), abs=1e-12)
    # all the energy of the pressed teeth is motion: rate^2 / 2 / 2 = k x^2 / 2
    assert -np.diff(twists[inside]) / 1e-3 == pytest.approx(0.1 * np.ones(49), rel=0.01)


@compiled
def followed(time_constant: float, limit: float, step: float, lag: FloatArray,
             slew: FloatArray) -> None:
    first = second = 0.0
    for k in range(lag.size):
        first = shaping.lagged(first, 1.0, time_constant, step)
        second = shaping.rate_limited(second, 1.0, limit, step)
        lag[k], slew[k] = first, second


def test_a_lag_is_an_exponential_and_a_rate_limit_a_ramp() -> None:
    lag, slew = np.empty(100), np.empty(100)
    followed(0.2, 2.0, 0.01, lag, slew)
    time = 0.01 * np.arange(1, 101)
    assert lag == pytest.approx(1.0 - np.exp(-time / 0.2), abs=1e-12)
    assert slew == pytest.approx(np.minimum(2.0 * time, 1.0), abs=1e-12)


def test_the_mean_of_a_lag_is_its_integral_over_the_step() -> None:
    @compiled
    def over(time_constant: float) -> tuple[float, float]:
        return shaping.lagged_mean(3.0, 1.0, time_constant, 0.5)

    time = (np.arange(100_000) + 0.5) * 5e-6
    mean, end = over(0.2)
    assert mean == pytest.approx(np.mean(1.0 + 2.0 * np.exp(-time / 0.2)), rel=1e-9)
    assert end == pytest.approx(1.0 + 2.0 * math.exp(-2.5))
    # a lag far below the step still delays by its time: 2 tau / h
    assert over(1e-6)[0] == pytest.approx(1.0 + 2.0 * 1e-6 / 0.5, abs=1e-12)
    assert over(0.0) == (1.0, 1.0)


@compiled
def shaped(value: float) -> tuple[float, float, float, float]:
    return (shaping.limited(value, 2.0), shaping.dead_zone(value, 0.5),
            shaping.soft_limited(value, 0.25), shaping.lagged(9.0, value, 0.0, 0.1))


@pytest.mark.parametrize(('value', 'expected'), [
    (0.3, (0.3, 0.0, 0.3 / 1.075, 0.3)), (-3.0, (-2.0, -2.5, -3.0 / 1.75, -3.0))])
def test_limits_and_dead_zone(value: float, expected: tuple[float, ...]) -> None:
    assert shaped(value) == pytest.approx(expected)


@compiled
def sampled(time: FloatArray, values: FloatArray, moments: FloatArray, out: FloatArray) -> None:
    place = 0
    for k in range(moments.size):
        out[k], place = shaping.held(time, values, moments[k], place)


def test_a_delayed_command_is_the_command_of_an_earlier_moment() -> None:
    time = np.array([0.1 * k for k in range(50)])
    values: FloatArray = np.sin(10.0 * time)
    out = np.empty(50)
    sampled(time, values, time - 0.3, out)
    assert np.array_equal(out[3:], values[:-3])
    assert np.all(out[:3] == values[0])
    sampled(time, values, time[::-1] + 0.05, out)  # and back
    assert np.array_equal(out, values[::-1])


@compiled
def all_delayed(past: FloatArray, ticks: float, out: FloatArray) -> None:
    for k in range(past.size):
        out[k] = shaping.delayed(past, k, ticks)


@pytest.mark.parametrize('ticks', [0.0, 0.25, 1.0, 3.6])
def test_a_ramp_that_is_delayed_is_the_ramp_of_that_moment(ticks: float) -> None:
    """To any share of a tick; before its begin it stands still."""
    tick, out = np.arange(40.0), np.empty(40)
    all_delayed(3.0 + 2.0 * tick, ticks, out)
    assert out == pytest.approx(3.0 + 2.0 * np.maximum(tick - ticks, 0.0), abs=1e-12)


@compiled
def read(angle: float) -> tuple[float, float, float, float]:
    return (sensor.encoder(angle, 2.0, 0.01, -0.02), sensor.counts(angle, 4096.0),
            sensor.digitised(angle, 0.1), sensor.tachometer(3.0, angle, 0.02, 0.1, 4.0, 0.0, 0.05))


def test_sensors() -> None:
    angle = 1.234
    encoder, counts, digits, tachometer = read(angle)
    assert encoder == pytest.approx(angle + 0.01 * (math.cos(2 * angle) - 1.0)
                                    - 0.02 * math.sin(2 * angle))
    assert counts == math.floor(4096 * angle / (2 * math.pi))
    assert digits == pytest.approx(1.2)
    assert tachometer == pytest.approx(3.0 * (1.02 + 0.05 * math.sin(4 * angle)) + 0.1)
    assert read(0.0)[0] == 0.0


def test_a_wave_has_its_amplitudes_and_its_order() -> None:
    @compiled
    def of(angle: float) -> float:
        return wave(angle, 6.0, 0.3, 0.4)

    angles = np.linspace(0.0, 2.0 * np.pi, 4097)[:-1]
    values = np.array([of(angle) for angle in angles])
    spectrum = np.fft.rfft(values) / 2048
    assert spectrum[6] == pytest.approx(0.3 - 0.4j)
    assert np.abs(np.delete(spectrum, 6)).max() < 1e-12


def test_harmonics_have_their_amplitudes_at_multiples_of_the_order() -> None:
    @compiled
    def of(angle: float) -> float:
        return harmonics(angle, 4.0, (0.3, 0.4, -0.1, 0.0, 0.0, 0.2))

    angles = np.linspace(0.0, 2.0 * np.pi, 4097)[:-1]
    spectrum = np.fft.rfft([of(angle) for angle in angles]) / 2048
    assert spectrum[[4, 8, 12]] == pytest.approx([0.3 - 0.4j, -0.1, -0.2j])
    assert np.abs(np.delete(spectrum, [4, 8, 12])).max() < 1e-12


LOOP = Cascade(position_gain=20.0, rate_limit=3.0, velocity_gain=20.0, velocity_time=0.5,
               current_limit=1.0)


@compiled
def driven(cascade: Cascade, reference: float, load: float, step: float,
           out: FloatArray) -> None:
    """Let a cascade position a unit inertia with a torque of 1 N m/A against a load."""
    position = rate = integral = 0.0
    for k in range(len(out)):
        current, integral = loop.cascade(cascade, reference, 0.0, position, rate, integral, step)
        out[k, 0], out[k, 1], out[k, 2] = position, rate, current
        rate += step * (current - load)
        position += step * rate


def test_a_cascade_holds_its_goal_against_a_load_and_keeps_its_limits() -> None:
    out = np.empty((40_000, 3))
    driven(LOOP._replace(position_gain=1.0), 1.0, 0.3, 1e-3, out)
    assert out[-1] == pytest.approx([1.0, 0.0, 0.3], abs=1e-6)
    far = np.empty((4000, 3))
    driven(LOOP._replace(position_gain=1.0), 100.0, 0.3, 1e-3, far)
    assert far[:, 2].max() == 1.0 and far[:, 1].max() > 2.0
    # at the limit the integral stands still, so the rate goes hardly beyond what was asked for
    assert far[:, 1].max() < 3.5


def test_a_pi_controller_integrates_as_its_closed_form_and_does_not_wind_up() -> None:
    @compiled
    def stepped(count: int, limit: float) -> tuple[float, float]:
        output = integral = 0.0
        for _ in range(count):
            output, integral = loop.pi_controller(1.0, integral, 2.0, 0.5, limit, 0.01)
        return output, integral

    assert stepped(30, 1e9) == pytest.approx((2.0 + 2.0 * 0.3 / 0.5, 1.2))
    output, integral = stepped(1000, 2.5)
    assert output == 2.5 and integral <= 0.5


def test_an_edit_of_a_file_beside_the_model_counts(tmp_path: Path) -> None:
    """What is compiled is kept, and is stale when a function that it calls changes."""
    program = ('from beside import doubled\nfrom simgap.parts import compiled\n'
               '@compiled\ndef called(x):\n    return doubled(x)\nprint(called(2.0))\n')
    (tmp_path / 'main.py').write_text(program)
    beside = 'from simgap.parts import inner\n@inner\ndef doubled(x):\n    return {} * x\n'
    for factor in ('2.0', '3.0'):
        (tmp_path / 'beside.py').write_text(beside.format(factor))
        done = subprocess.run([sys.executable, '-B', 'main.py'], cwd=tmp_path, text=True,
                              capture_output=True, check=True)
        assert float(done.stdout) == 2.0 * float(factor)
