# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Motor and gearbox against closed forms: a free rotor, an impact, a ripple, a tooth's error."""

from dataclasses import replace
import math

from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed, MotorDrive
from antenna_drive.physics import motor_drive
from antenna_drive.physics.gearbox import gear_torque, presliding_rate, twist, twist_rate
from antenna_drive.physics.motor import ammeter, driving_torque, tachometer, tachometer_slope
import numpy as np
import pytest
from stepping import Stepped

H = 1e-3
STATE = motor_drive.STATE


def _motor(**values: object) -> MotorDrive:
    return changed(load().motor_2, {name.replace('__', '.'): value
                                    for name, value in values.items()})


def _simulate(parameters: MotorDrive, x0: np.ndarray, mode0: list[int], steps: int,
              h: float = H) -> np.ndarray:
    """Return the states at every step with the axis held at zero, shape (steps + 1, states)."""
    motor = Stepped(motor_drive.BLOCK, parameters)
    motor.x[:], motor.mode[:] = x0, mode0
    rows = [motor.x.copy()]
    for _ in range(steps):
        motor.step(h)
        rows.append(motor.x.copy())
    return np.array(rows)


def _state(**values: float) -> np.ndarray:
    x = np.zeros(len(STATE))
    for name, value in values.items():
        x[getattr(STATE, name)] = value
    return x


# A rotor that only inertia, friction and teeth act on: the amplifiers are as good as off.
OFF = {'amplifier__rate_gain': 1e-3, 'amplifier__integral_time': 100.0,
       'armature__back_emf_constant': 1e-4, 'armature__inductance': 10.0}


def test_a_free_rotor_slows_down_by_its_coulomb_friction() -> None:
    parameters = _motor(gearbox__half_gap=10.0, **OFF)
    motor = parameters.motor
    friction = motor.coulomb_torque * motor.friction_torque_per_ampere
    states = _simulate(parameters, _state(rate=1.0), [1, 0, 0], 300)
    stop = 1.0 * motor.rotor_inertia / friction
    time = np.arange(states.shape[0]) * H
    expected = np.where(time < stop, 1.0 - friction / motor.rotor_inertia * time, 0.0)
    np.testing.assert_allclose(states[:, STATE.rate], expected, atol=2e-3)
    assert states[-1, STATE.rate] == 0.0


def test_teeth_meet_when_the_gap_is_crossed_and_throw_the_rotor_back() -> None:
    parameters = _motor(motor__coulomb_torque=0.0, gearbox__contact_damping=0.0, **OFF)
    gearbox, inertia = parameters.gearbox, parameters.motor.rotor_inertia
    rate = 5.0
    states = _simulate(parameters, _state(rate=rate), [1, 0, 0], 250)
    meet = gearbox.half_gap / rate
    omega = math.sqrt(gearbox.stiffness / inertia)
    time = np.arange(251) * H
    pressed = gearbox.half_gap + rate / omega * np.sin(omega * (time - meet))
    leave = meet + math.pi / omega
    expected = np.where(time < meet, rate * time,
                        np.where(time < leave, pressed,
                                 gearbox.half_gap - rate * (time - leave)))
    np.testing.assert_allclose(states[:, STATE.angle], expected, atol=1e-4)


def test_contact_damping_takes_energy_and_nothing_gives_any() -> None:
    parameters = _motor(motor__coulomb_torque=0.0, **OFF)
    states = _simulate(parameters, _state(rate=5.0), [1, 0, 0], 2000)
    twist_now = np.abs(states[:, STATE.angle]) - parameters.gearbox.half_gap
    energy = (0.5 * parameters.motor.rotor_inertia * states[:, STATE.rate] ** 2
              + 0.5 * parameters.gearbox.stiffness * np.maximum(twist_now, 0.0) ** 2)
    # what little the amplifiers, which are not quite off, do is far below a thousandth
    assert np.all(np.diff(energy) <= 1e-3 * energy[0])
    assert energy[-1] < 0.5 * energy[0]


def test_halving_the_step_divides_the_error_of_an_impact_by_about_sixteen() -> None:
    parameters = _motor(motor__coulomb_torque=0.0, **OFF)
    start = _state(rate=7.3)

    def end(h: float) -> float:
        return float(_simulate(parameters, start, [1, 0, 0], round(0.24 / h), h)
                     [-1, STATE.angle])

    exact = end(2.5e-4)
    coarse, fine = abs(end(8e-3) - exact), abs(end(4e-3) - exact)
    assert 12.0 < coarse / fine < 20.0


def test_the_impulse_that_an_extrapolation_missed_is_sent_after_it() -> None:
    parameters = _motor(motor__coulomb_torque=0.0, **OFF)
    motor = Stepped(motor_drive.BLOCK, parameters)
    motor.x[STATE.rate], motor.mode[:] = 5.0, [1, 0, 0]
    output = motor_drive.OUTPUT
    believed = given = 0.0
    for _ in range(400):
        before = motor.x[STATE.rate]
        torque, slope = motor.y[output.gear_torque]
        believed += (torque + 0.5 * slope * H) * H
        motor.step(H)
        believed += motor.y[output.missed_impulse, 0]
        given += parameters.motor.rotor_inertia * (before - motor.x[STATE.rate])
    # what the axis was told adds up to the momentum that the rotor lost to the teeth
    assert believed == pytest.approx(given, rel=2e-3)


def test_ripple_transmission_error_and_sensors_are_sines_of_the_angle() -> None:
    motor = record_of(replace(load().motor_1.motor, torque_ripple=0.5, torque_ripple_cycles=6.0,
                              torque_ripple_phase=0.2))[0]
    assert driving_torque(2.0, 0.3, motor) == pytest.approx(
        2.0 * 6.892 + 0.5 * math.sin(6.0 * 0.3 + 0.2))
    gearbox = record_of(replace(load().motor_1.gearbox, transmission_error=0.01,
                                transmission_error_cycles=3.0))[0]
    assert twist(0.3, 1e-5, 14868.0, gearbox) == pytest.approx(
        0.3 - 0.14868 + 0.01 * math.sin(0.9))
    dt = 1e-6
    slope = (twist(0.3 + 2.0 * dt, 1e-5 + 1e-4 * dt, 14868.0, gearbox)
             - twist(0.3 - 2.0 * dt, 1e-5 - 1e-4 * dt, 14868.0, gearbox)) / (2.0 * dt)
    assert twist_rate(0.3, 2.0, 1e-4, 14868.0, gearbox) == pytest.approx(slope, rel=1e-6)
    tach = record_of(replace(load().motor_1.tachometer, gain=1.1, offset=0.2, ripple=0.05,
                             ripple_cycles=2.0))[0]
    assert tachometer(3.0, 0.4, tach) == pytest.approx(
        3.3 + 0.2 + 0.15 * math.sin(0.8))
    assert ammeter(2.0, record_of(replace(load().motor_1.ammeter, gain=0.9, offset=0.1))[0]
                   ) == pytest.approx(1.9)


def test_a_tachometers_slope_is_the_derivative_of_its_reading() -> None:
    tach = record_of(replace(
        load().motor_1.tachometer, gain=1.1, offset=0.2, ripple=0.05, ripple_cycles=7.0,
        ripple_second=0.02, ripple_second_phase=0.4, ripple_third=0.01))[0]
    rate, angle, acceleration, dt = 30.0, 0.4, 50.0, 1e-6

    def reading(t: float) -> float:
        return float(tachometer(rate + acceleration * t,
                                angle + rate * t + 0.5 * acceleration * t * t, tach))

    slope = (reading(dt) - reading(-dt)) / (2.0 * dt)
    assert abs(slope - 1.1 * acceleration) > 50.0  # most of it is the ripple's
    assert tachometer_slope(rate, angle, acceleration, tach) == pytest.approx(slope, rel=1e-6)


def test_hysteresis_dissipates_over_a_cycle_what_its_loop_encloses() -> None:
    torque, angle = 2.0, 0.02
    gearbox = replace(load().motor_1.gearbox, half_gap=0.0, contact_damping=0.0,
                      hysteresis=torque, hysteresis_angle=angle)
    record = record_of(gearbox)[0]
    twist_mean, swing, state, work = 1.0, 0.5, 0.0, 0.0
    steps = 20000
    time = np.linspace(0.0, 4.0 * math.pi, 2 * steps + 1)
    for k, (t, dt) in enumerate(zip(time[:-1], np.diff(time))):
        rate = swing * math.cos(t)
        state += presliding_rate(1, rate, state, record) * dt
        if k >= steps:
            work += gear_torque(1, twist_mean + swing * math.sin(t), rate, state, record
                                ) * rate * dt
    # a wide loop is a rectangle of twice the torque over twice the swing, less its rounded ends
    rounded = 2.0 * (2.0 * torque) * angle * math.log(2.0)
    assert work == pytest.approx(4.0 * torque * swing - rounded, rel=0.02)
