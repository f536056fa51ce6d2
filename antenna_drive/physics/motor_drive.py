# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
One motor with its amplifiers and its gearbox: the subsystem G_o of Figs. 6 and 7.

States: command voltage [V], integral of amplifier 1 [article A], lagged demand [article A],
current [article A], motor angle [rad], motor rate [rad/s], hysteresis of the gearbox [1], and
the gear torque's impulse since the start of the macro-step [N m s].
Modes: friction (+1, -1 slips, 0 sticks), contact (+1, -1 flank, 0 gap), integral of
amplifier 1 (FREE, FROZEN, HELD).
Inputs: rate command [rad/s], counter torque [V], axis angle [rad], axis rate [rad/s].
"""

from antenna_drive.parameters.sets import MotorDrive
from antenna_drive.physics.amplifier import (
    armature_voltage, error_slope, FREE, HELD, integral_rate, limit_centre, limited, next_winding,
    rate_error,
)
from antenna_drive.physics.armature import current_rate
from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.block import Block, Equation, held, output_rows, put, rows, Signal
from antenna_drive.physics.gearbox import gear_torque, presliding_rate, twist, twist_rate
from antenna_drive.physics.motor import (
    ammeter, driving_torque, friction_level, tachometer, tachometer_slope,
)
from antenna_drive.physics.rate_command import command_voltage_rate
from simgap.laws.backlash import contact_side, contact_torque_rate
from simgap.laws.compiling import inner, shared
from simgap.laws.friction import next_slip

STATE = rows('voltage', 'integral', 'demand', 'current', 'angle', 'rate', 'presliding', 'impulse')
MODE = rows('slip', 'side', 'winding')
INPUT = rows('rate_command', 'counter_torque', 'axis_angle', 'axis_rate')
OUTPUTS = (
    Signal('current', 'article A', 'motor current, article amperes'),
    Signal('gear_torque', 'N m', 'gearbox torque at the motor shaft, positive drives the axis'),
    Signal('missed_impulse', 'N m s', 'impulse of the gear torque that its extrapolation missed'),
    Signal('tach_rate', 'rad/s', 'tachometer reading', exchanged=False),
    Signal('ammeter', 'article A', 'ammeter reading, article amperes', exchanged=False),
)
OUTPUT = output_rows(OUTPUTS)


@inner
def _axis_angle(u: FloatArray, t: float) -> float:
    """Return the axis angle at t; its second derivative is known, so the hold is a parabola."""
    return u[INPUT.axis_angle, 0] + (u[INPUT.axis_rate, 0] + 0.5 * u[INPUT.axis_rate, 1] * t) * t


@inner
def _gear(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive,
) -> tuple[float, float, float]:
    """Return twist [rad], its rate [rad/s] and the gear torque [N m] at t."""
    angle = twist(x[STATE.angle], _axis_angle(u, t), p.gear_ratio, p.gearbox)
    rate = twist_rate(x[STATE.angle], x[STATE.rate], held(u, INPUT.axis_rate, t), p.gear_ratio,
                      p.gearbox)
    return angle, rate, gear_torque(
        mode[MODE.side], angle, rate, x[STATE.presliding], p.gearbox)


@inner
def _acceleration(x: FloatArray, mode: IntArray, torque: float, p: MotorDrive) -> float:
    """Return the rotor's acceleration [rad/s^2] against the gear torque [N m], Eq. (2)."""
    if mode[MODE.slip] == 0:
        return 0.0
    applied = driving_torque(x[STATE.current], x[STATE.angle], p.motor) - torque
    friction = mode[MODE.slip] * friction_level(x[STATE.rate], torque, p.motor)
    return (applied - friction) / p.motor.rotor_inertia


@inner
def _voltage_rate(t: float, x: FloatArray, u: FloatArray, p: MotorDrive) -> float:
    """Return the time derivative of the command voltage [V/s]."""
    command = held(u, INPUT.rate_command, t)
    return command_voltage_rate(x[STATE.voltage], command, p.rate_command)


@inner
def _error_slope(
        t: float, x: FloatArray, u: FloatArray, error: float, acceleration: float, p: MotorDrive,
) -> float:
    """Return the time derivative of the rate error [article A/s]."""
    return error_slope(
        error, _voltage_rate(t, x, u, p),
        tachometer_slope(x[STATE.rate], x[STATE.angle], acceleration, p.tachometer),
        p.sign * p.amplifier.bias_command_gain * u[INPUT.counter_torque, 1], p.amplifier)


@inner
def _demand(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive,
) -> tuple[float, float, float]:
    """Return error, demand before its limit, and centre of the limit [article A] at t."""
    bias_command = p.sign * p.amplifier.bias_command_gain * held(u, INPUT.counter_torque, t)
    tach_rate = tachometer(x[STATE.rate], x[STATE.angle], p.tachometer)
    error = rate_error(x[STATE.voltage], tach_rate, bias_command, p.amplifier)
    if p.amplifier.delay > 0.0:
        # the error of a little while ago, to first order
        _, _, torque = _gear(t, x, mode, u, p)
        error -= p.amplifier.delay * _error_slope(
            t, x, u, error, _acceleration(x, mode, torque, p), p)
    return error, error + x[STATE.integral], limit_centre(x[STATE.rate], p.amplifier, p.armature)


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
    volts = armature_voltage(x[STATE.demand], x[STATE.current], p.amplifier, p.armature)
    return current_rate(volts, x[STATE.current], x[STATE.rate], p.armature)


@shared
def rates(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive, dx: FloatArray,
) -> None:
    """Write the time derivatives of the states."""
    error, demand, centre = _demand(t, x, mode, u, p)
    _, rate, torque = _gear(t, x, mode, u, p)
    dx[STATE.voltage] = _voltage_rate(t, x, u, p)
    acceleration = _acceleration(x, mode, torque, p)
    needed = _needed(t, x, u, error, acceleration, p) if mode[MODE.winding] == HELD else 0.0
    dx[STATE.integral] = integral_rate(mode[MODE.winding], error, needed, p.amplifier)
    demand = limited(demand, centre, p.motor.current_limit, p.amplifier)
    dx[STATE.demand] = (demand - x[STATE.demand]) / p.amplifier.lag
    dx[STATE.current] = _current_rate(x, p)
    dx[STATE.angle] = x[STATE.rate]
    dx[STATE.rate] = acceleration
    dx[STATE.presliding] = presliding_rate(mode[MODE.side], rate, x[STATE.presliding], p.gearbox)
    dx[STATE.impulse] = torque


@shared
def switch(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive, commit: bool,
) -> bool:
    """Return whether the modes no longer hold; write the new ones if `commit`."""
    gear = p.gearbox
    angle, rate, torque = _gear(t, x, mode, u, p)
    side = contact_side(angle, rate, gear.half_gap, gear.stiffness, gear.contact_damping)
    error, demand, centre = _demand(t, x, mode, u, p)
    excess = (demand - centre if error > 0.0 else centre - demand) - p.motor.current_limit
    winding = mode[MODE.winding]
    if excess > 0.0 or winding != FREE:
        needed = _needed(t, x, u, error, _acceleration(x, mode, torque, p), p)
        winding = next_winding(winding, error, excess, needed, p.amplifier)
    slip = mode[MODE.slip]
    if slip == 0 or slip * x[STATE.rate] <= p.motor.velocity_threshold:
        applied = driving_torque(x[STATE.current], x[STATE.angle], p.motor) - torque
        level = friction_level(0.0, torque, p.motor)
        slip = next_slip(slip, x[STATE.rate], applied, level, p.motor.stiction_ratio * level,
                         p.motor.velocity_threshold)
    changed = (slip != mode[MODE.slip] or side != mode[MODE.side]
               or winding != mode[MODE.winding])
    if commit and changed:
        mode[MODE.slip] = slip
        mode[MODE.side] = side
        mode[MODE.winding] = winding
        if slip == 0:
            x[STATE.rate] = 0.0
    return changed


@shared
def read(
        x: FloatArray, mode: IntArray, u: FloatArray, t: float, p: MotorDrive, y: FloatArray,
) -> None:
    """Write the outputs but for the missed impulse, which `end` knows."""
    _, rate, torque = _gear(t, x, mode, u, p)
    acceleration = _acceleration(x, mode, torque, p)
    current_slope = _current_rate(x, p)
    torque_slope = contact_torque_rate(
        torque, rate, acceleration - p.gear_ratio * u[INPUT.axis_rate, 1],
        p.gearbox.stiffness, p.gearbox.contact_damping)
    put(y, OUTPUT.current, x[STATE.current], current_slope)
    put(y, OUTPUT.gear_torque, torque, torque_slope)
    put(y, OUTPUT.tach_rate, tachometer(x[STATE.rate], x[STATE.angle], p.tachometer),
        tachometer_slope(x[STATE.rate], x[STATE.angle], acceleration, p.tachometer))
    put(y, OUTPUT.ammeter, ammeter(x[STATE.current], p.ammeter), p.ammeter.gain * current_slope)


@inner
def start(p: MotorDrive, x: FloatArray, mode: IntArray) -> None:
    """Put the motor where start_in_gap says, inside its gap; the axis is at zero."""
    x[STATE.angle] = p.start_in_gap * p.gearbox.half_gap


@inner
def begin(
        x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive, h: float, y: FloatArray,
) -> None:
    """Note the impulse that others expect of the macro-step, and measure the true one."""
    torque, slope = y[OUTPUT.gear_torque, 0], y[OUTPUT.gear_torque, 1]
    y[OUTPUT.missed_impulse, 0] = (torque + 0.5 * slope * h) * h
    x[STATE.impulse] = 0.0


@inner
def end(
        x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive, h: float, y: FloatArray,
) -> None:
    """Write the missed impulse."""
    y[OUTPUT.missed_impulse, 0] = x[STATE.impulse] - y[OUTPUT.missed_impulse, 0]


@inner
def _gear_torque(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: MotorDrive,
) -> float:
    return _gear(t, x, mode, u, p)[2]


BLOCK = Block(
    kind=MotorDrive, states=STATE, modes=MODE, inputs=INPUT, outputs=OUTPUTS,
    start=start, rates=rates, switch=switch, read=read, begin=begin, end=end,
    values={'gear_torque': Equation(_gear_torque, ('axis_angle', 'axis_rate'), 'impulse'),
            'missed_impulse': None},
    slopes_used=('counter_torque',))
