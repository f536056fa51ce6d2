# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
One motor with its amplifiers and its gearbox: the subsystem G_o of Figs. 6 and 7.

States: command voltage [V], integral of amplifier 1 [article A], lagged demand [article A],
current [article A], motor angle [rad], motor rate [rad/s], hysteresis of the gearbox [1], and
the gear torque's impulse since the start of the macro-step [N m s].
Mode: friction (+1, -1 slips, 0 sticks), contact (+1, -1 flank, 0 gap), integral of
amplifier 1 (FREE, FROZEN, HELD).
Inputs: rate command [rad/s], counter torque [V], axis angle [rad], axis rate [rad/s].
Outputs: current [article A], gear torque [N m], impulse missed [N m s], tachometer [rad/s],
ammeter [article A].
"""

from __future__ import annotations

from antenna_drive.parameters.sets import MotorDrive
from antenna_drive.physics.amplifier import (
    armature_voltage, error_slope, FREE, HELD, integral_rate, limit_centre, limited,
    next_winding, rate_error,
)
from antenna_drive.physics.armature import current_rate
from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.backlash import contact_side, contact_torque_rate
from antenna_drive.physics.compiling import compiled, inner, shared
from antenna_drive.physics.friction import next_slip
from antenna_drive.physics.gearbox import gear_torque, presliding_rate, twist, twist_rate
from antenna_drive.physics.integrator import located_runge_kutta
from antenna_drive.physics.motor import ammeter, driving_torque, friction_level, tachometer
from antenna_drive.physics.rate_command import command_voltage_rate
import numpy as np

VOLTAGE, INTEGRAL, DEMAND, CURRENT, ANGLE, RATE, PRESLIDING, IMPULSE = range(8)
STATES = 8
SLIP, SIDE, WINDING = range(3)
MODES = 3
RATE_COMMAND, COUNTER_TORQUE, AXIS_ANGLE, AXIS_RATE = range(4)
INPUTS = 4
OUTPUTS = 5
_AT_REST = np.zeros((INPUTS, 2))


@inner
def _held(u: FloatArray, signal: int, t: float) -> float:
    """Return an input at t after the start of the macro-step: the first-order hold."""
    return u[signal, 0] + u[signal, 1] * t


@inner
def _axis_angle(u: FloatArray, t: float) -> float:
    """Return the axis angle at t; its second derivative is known, so the hold is a parabola."""
    return u[AXIS_ANGLE, 0] + (u[AXIS_RATE, 0] + 0.5 * u[AXIS_RATE, 1] * t) * t


@inner
def _gear(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive,
) -> tuple[float, float]:
    """Return twist rate [rad/s] and gear torque [N m] at t."""
    angle = twist(x[ANGLE], _axis_angle(u, t), p.gear_ratio, p.gearbox)
    rate = twist_rate(x[ANGLE], x[RATE], _held(u, AXIS_RATE, t), p.gear_ratio, p.gearbox)
    return rate, gear_torque(mode[SIDE], angle, rate, x[PRESLIDING], p.gearbox)


@inner
def _acceleration(x: FloatArray, mode: IntArray, torque: float, p: MotorDrive) -> float:
    """Return the rotor's acceleration [rad/s^2] against the gear torque [N m], Eq. (2)."""
    if mode[SLIP] == 0:
        return 0.0
    applied = driving_torque(x[CURRENT], x[ANGLE], p.motor) - torque
    friction = mode[SLIP] * friction_level(x[RATE], torque, p.motor)
    return (applied - friction) / p.motor.rotor_inertia


@inner
def _error_slope(
        t: float, x: FloatArray, u: FloatArray, error: float, acceleration: float, p: MotorDrive,
) -> float:
    """Return the time derivative of the rate error [article A/s]."""
    return error_slope(
        error, command_voltage_rate(x[VOLTAGE], _held(u, RATE_COMMAND, t), p.rate_command),
        p.tachometer.gain * acceleration,
        p.sign * p.amplifier.bias_command_gain * u[COUNTER_TORQUE, 1], p.amplifier)


@inner
def _demand(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive,
) -> tuple[float, float, float]:
    """Return error, demand before its limit, and centre of the limit [article A] at t."""
    bias_command = p.sign * p.amplifier.bias_command_gain * _held(u, COUNTER_TORQUE, t)
    tach_rate = tachometer(x[RATE], x[ANGLE], p.tachometer)
    error = rate_error(x[VOLTAGE], tach_rate, bias_command, p.amplifier)
    if p.amplifier.delay > 0.0:
        # the error of a little while ago, to first order
        _, torque = _gear(t, x, mode, u, p)
        error -= p.amplifier.delay * _error_slope(
            t, x, u, error, _acceleration(x, mode, torque, p), p)
    return error, error + x[INTEGRAL], limit_centre(x[RATE], p.amplifier, p.armature)


@inner
def _needed(
        t: float, x: FloatArray, u: FloatArray, error: float, acceleration: float, p: MotorDrive,
) -> float:
    """Return the rate at which the integral would keep the demand at its limit [article A/s]."""
    slope = _error_slope(t, x, u, error, acceleration, p)
    needed = limit_centre(acceleration, p.amplifier, p.armature) - slope
    return needed if error > 0.0 else -needed


@inner
def _current_rate(x: FloatArray, p: MotorDrive) -> float:
    volts = armature_voltage(x[DEMAND], x[CURRENT], p.amplifier, p.armature)
    return current_rate(volts, x[CURRENT], x[RATE], p.armature)


@shared
def _rates(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive, dx: FloatArray,
) -> None:
    error, demand, centre = _demand(t, x, mode, u, p)
    rate, torque = _gear(t, x, mode, u, p)
    dx[VOLTAGE] = command_voltage_rate(x[VOLTAGE], _held(u, RATE_COMMAND, t), p.rate_command)
    acceleration = _acceleration(x, mode, torque, p)
    needed = _needed(t, x, u, error, acceleration, p) if mode[WINDING] == HELD else 0.0
    dx[INTEGRAL] = integral_rate(mode[WINDING], error, needed, p.amplifier)
    dx[DEMAND] = (limited(demand, centre, p.motor.current_limit) - x[DEMAND]) / p.amplifier.lag
    dx[CURRENT] = _current_rate(x, p)
    dx[ANGLE] = x[RATE]
    dx[RATE] = acceleration
    dx[PRESLIDING] = presliding_rate(mode[SIDE], rate, x[PRESLIDING], p.gearbox)
    dx[IMPULSE] = torque


@shared
def _switch(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive, commit: bool,
) -> bool:
    gear = p.gearbox
    side = contact_side(
        twist(x[ANGLE], _axis_angle(u, t), p.gear_ratio, gear),
        twist_rate(x[ANGLE], x[RATE], _held(u, AXIS_RATE, t), p.gear_ratio, gear),
        gear.half_gap, gear.stiffness, gear.contact_damping)
    error, demand, centre = _demand(t, x, mode, u, p)
    excess = (demand - centre if error > 0.0 else centre - demand) - p.motor.current_limit
    winding = mode[WINDING]
    if excess > 0.0 or winding != FREE:
        _, torque = _gear(t, x, mode, u, p)
        needed = _needed(t, x, u, error, _acceleration(x, mode, torque, p), p)
        winding = next_winding(winding, error, excess, needed, p.amplifier)
    slip = mode[SLIP]
    if slip == 0 or slip * x[RATE] <= p.motor.velocity_threshold:
        _, torque = _gear(t, x, mode, u, p)
        applied = driving_torque(x[CURRENT], x[ANGLE], p.motor) - torque
        level = friction_level(0.0, torque, p.motor)
        slip = next_slip(slip, x[RATE], applied, level, p.motor.stiction_ratio * level,
                         p.motor.velocity_threshold)
    changed = (slip != mode[SLIP]) or (side != mode[SIDE]) or (winding != mode[WINDING])
    if commit and changed:
        mode[SLIP] = slip
        mode[SIDE] = side
        mode[WINDING] = winding
        if slip == 0:
            x[RATE] = 0.0
    return changed


_advance = located_runge_kutta(_rates, _switch, STATES)


@compiled
def outputs(
        x: FloatArray, mode: IntArray, u: FloatArray, t: float, p: MotorDrive, y: FloatArray,
) -> None:
    """
    Write the outputs at t after the start of a macro-step, with their time derivatives.

    Parameters
    ----------
    x, mode
        states and mode at t, shapes (8,) and (3,)
    u
        inputs at the start of the macro-step, shape (4, 2)
    t
        [s]
    p
        record of MotorDrive
    y
        receives value and derivative of each output, shape (5, 2)

    """
    rate, torque = _gear(t, x, mode, u, p)
    acceleration = _acceleration(x, mode, torque, p)
    current_slope = _current_rate(x, p)
    y[0, 0] = x[CURRENT]
    y[0, 1] = current_slope
    y[1, 0] = torque
    y[1, 1] = contact_torque_rate(
        torque, rate, acceleration - p.gear_ratio * u[AXIS_RATE, 1],
        p.gearbox.stiffness, p.gearbox.contact_damping)
    y[2, 0] = 0.0
    y[2, 1] = 0.0
    y[3, 0] = tachometer(x[RATE], x[ANGLE], p.tachometer)
    y[3, 1] = p.tachometer.gain * acceleration
    y[4, 0] = ammeter(x[CURRENT], p.ammeter)
    y[4, 1] = p.ammeter.gain * current_slope


@compiled
def start(p: MotorDrive, x: FloatArray, mode: IntArray, y: FloatArray) -> None:
    """
    Write the state at rest into x and mode, and its outputs into y; shapes as in `outputs`.

    The axis is at zero; the motor stands where start_in_gap puts it inside its gap.
    """
    x[:] = 0.0
    mode[:] = 0
    x[ANGLE] = p.start_in_gap * p.gearbox.half_gap
    outputs(x, mode, _AT_REST, 0.0, p, y)


@compiled
def step(
        x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive, h: float, steps: int,
        work: FloatArray, y: FloatArray,
) -> None:
    """
    Advance the motor drive over one macro-step.

    Parameters
    ----------
    x, mode
        states and mode, advanced in place, shapes (8,) and (3,)
    u
        inputs, value and time derivative at the start of the macro-step, shape (4, 2)
    p
        record of MotorDrive
    h
        macro-step [s]
    steps
        inner steps in it
    work
        from `integrator.work_space`
    y
        receives the outputs at the end, shape (5, 2); still holds those at the start

    """
    held = (y[1, 0] + 0.5 * y[1, 1] * h) * h
    x[IMPULSE] = 0.0
    _advance(x, mode, u, p, h, steps, work)
    outputs(x, mode, u, h, p, y)
    y[2, 0] = x[IMPULSE] - held
