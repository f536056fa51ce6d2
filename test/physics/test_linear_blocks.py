# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The blocks that are linear against scipy.signal, and against closed forms.

Whatever a unit is fed here is constant or a ramp over each macro-step, which its first-order
hold reproduces exactly; what remains is the error of the integration.
"""

from dataclasses import replace

from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed
from antenna_drive.physics import motor_drive, torque_share
import numpy as np
import pytest
from scipy import signal
from stepping import Stepped

H = 1e-3


def _share(**settings: object) -> object:
    return changed(load().torque_share, {name.replace('__', '.'): value
                                         for name, value in settings.items()})


def _run_share(parameters: object, current_1: np.ndarray, current_2: np.ndarray) -> np.ndarray:
    """Return the outputs of the share unit, shape (n, 2), for currents held over each step."""
    share = Stepped(torque_share.BLOCK, parameters)
    rows = [share.y[:, 0].copy()]
    for one, two in zip(current_1[:-1], current_2[:-1]):
        share.u[:, 0] = one, two
        share.step(H)
        rows.append(share.y[:, 0].copy())
    return np.array(rows)


def test_filter_1_is_eq_15() -> None:
    parameters = _share(circuit__bias_source='fixed', circuit__fixed_voltage=6.0)
    time = np.arange(3000) * H
    zero = np.zeros(time.size)
    counter_torque = _run_share(parameters, zero, zero)[:, 0]
    gain, pole = parameters.filter_1.gain, parameters.filter_1.pole  # type: ignore[attr-defined]
    _, expected = signal.step(signal.TransferFunction([gain], [1.0, pole]), T=time)
    np.testing.assert_allclose(counter_torque, 6.0 * expected, atol=1e-9)
    # Eq. (15) in its own numbers, k_ctfr / (1 + tau_6 s): the article's 3.31 and 0.73 s
    _, published = signal.step(signal.TransferFunction([3.31], [0.73, 1.0]), T=time)
    np.testing.assert_allclose(counter_torque, 6.0 * published, rtol=2e-3, atol=1e-3)


def test_filter_1_acts_on_the_difference_of_the_currents() -> None:
    parameters = _share(circuit__bias_source='fixed', circuit__fixed_voltage=0.0)
    ones = np.ones(500)
    both = _run_share(parameters, ones, ones)[:, 0]
    np.testing.assert_array_equal(both, 0.0)
    apart = _run_share(parameters, -ones, ones)[:, 0]
    filter_1 = parameters.filter_1  # type: ignore[attr-defined]
    final = -2.0 * filter_1.difference_gain * filter_1.gain / filter_1.pole
    expected = final * (1.0 - np.exp(-filter_1.pole * H * np.arange(ones.size)))
    np.testing.assert_allclose(apart, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize('circuit', ['old_circuit', 'new_circuit'])
def test_the_torque_share_is_eq_9(circuit: str) -> None:
    share = replace(load(circuit).torque_share.circuit, start='steady', bias_pot=0.8,
                    fade_out_voltage=-3.0, saturation_high=50.0)
    unit = replace(load(circuit).torque_share, circuit=share)
    time = np.arange(6000) * H
    current = 0.3 + 0.2 * np.sin(2.0 * np.pi * np.floor(time / 0.5) / 7.0)  # a staircase
    voltage = _run_share(unit, current, current)[:, 1]
    # transfer functions 2, 3 and 4 as rational functions, driven through scipy
    g_3 = signal.TransferFunction([-share.k_3 * share.current_to_voltage], [1.0, share.k_3])
    load_voltage = signal.lsim(g_3, 2.0 * np.append(current[:-1], current[-2]), time,
                               interp=False)[1]
    assert load_voltage.max() <= 0.0  # one sign, so that its size is linear in the current
    # v_b follows |x_3| as well as f_o: superpose the steady part and the response to the load
    series = signal.TransferFunction(
        np.polymul([share.k_2 * share.g_4], [share.k_3 * share.current_to_voltage]),
        np.polymul([1.0, share.s_2], [1.0, share.k_3]))
    share_voltage = (share.k_2 / share.s_2 * share.fade_out_voltage
                     + signal.lsim(series, 2.0 * current, time, interp=False)[1])
    expected = share.bias_pot * np.clip(share_voltage, 0.0, 50.0)
    np.testing.assert_allclose(voltage, expected, atol=1e-6)


@pytest.mark.parametrize(('k_2', 's_2', 'g_2'), [(-3.502, 1.093, -3.20), (-2.114, 0.8895, -2.38)])
def test_the_dc_gains_of_eq_13(k_2: float, s_2: float, g_2: float) -> None:
    assert k_2 / s_2 == pytest.approx(g_2, abs=0.006)


@pytest.mark.parametrize(('fade_out', 'flat', 'zero'), [
    (-9.0, 1.90, 3.46), (-7.0, 1.13, 2.69), (-11.0, 2.67, 4.23)])
def test_the_corners_of_fig_15a(fade_out: float, flat: float, zero: float) -> None:
    share = record_of(replace(
        load().torque_share.circuit, bias_pot=0.7, fade_out_voltage=fade_out,
        current_to_voltage=1.0, g_4=2.6))[0]
    greatest = 0.7 * 13.0
    assert torque_share.steady_bias_voltage(flat - 0.01, share) == greatest
    assert torque_share.steady_bias_voltage(flat + 0.01, share) < greatest
    assert torque_share.steady_bias_voltage(zero - 0.01, share) > 0.0
    assert torque_share.steady_bias_voltage(zero + 0.01, share) == 0.0
    assert torque_share.steady_bias_voltage(-zero - 0.01, share) == 0.0


def _held_motor() -> object:
    """Return motor 2 with a friction that no torque of it overcomes."""
    return changed(load().motor_2, {'motor.coulomb_torque': 100.0})


def test_amplifiers_and_armature_with_the_rotor_held() -> None:
    parameters = _held_motor()
    motor = Stepped(motor_drive.BLOCK, parameters)
    command = 2e-5  # rad/s: too little to reach any limit within the time watched
    motor.u[motor_drive.INPUT.rate_command, 0] = command
    rows = [motor.x[:4].copy()]
    for _ in range(150):
        motor.step(H, 10)
        rows.append(motor.x[:4].copy())
    m: object = parameters
    amp, arm, rc = m.amplifier, m.armature, m.rate_command  # type: ignore[attr-defined]
    resistance, gain = arm.resistance, amp.current_feedback_gain
    a = np.array([
        [-1.0 / rc.tau_1, 0.0, 0.0, 0.0],
        [amp.rate_gain / amp.integral_time, 0.0, 0.0, 0.0],
        [amp.rate_gain / amp.lag, 1.0 / amp.lag, -1.0 / amp.lag, 0.0],
        [0.0, 0.0, (resistance + gain) / arm.inductance, -(resistance + gain) / arm.inductance]])
    b = np.array([[rc.k_s * rc.k_1 / rc.tau_1], [0.0], [0.0], [0.0]])
    system = signal.StateSpace(a, b, np.eye(4), np.zeros((4, 1)))
    time = np.arange(len(rows)) * H
    _, expected, _ = signal.lsim(system, np.full(time.size, command), time)
    assert abs(rows[-1][3]) < parameters.motor.current_limit  # type: ignore[attr-defined]
    np.testing.assert_allclose(np.array(rows), expected, rtol=1e-7, atol=1e-9)
    state = motor_drive.STATE
    assert motor.x[state.angle] == motor.x[state.rate] == 0.0


def test_the_current_settles_at_its_limit_whatever_is_asked() -> None:
    parameters = _held_motor()
    motor = Stepped(motor_drive.BLOCK, parameters)
    motor.u[motor_drive.INPUT.rate_command, 0] = 0.01
    for _ in range(2000):
        motor.step(H)
    limit = parameters.motor.current_limit  # type: ignore[attr-defined]
    assert motor.x[motor_drive.STATE.current] == pytest.approx(limit, rel=1e-9)
    # the integral has not wound up: when the command turns, the current turns within the lags
    motor.u[motor_drive.INPUT.rate_command, 0] = -0.01
    for _ in range(150):
        motor.step(H)
    assert motor.x[motor_drive.STATE.current] == pytest.approx(-limit, rel=1e-3)
