# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The antenna's structure: a hub on friction, with flexible modes, and all outputs of Fig. 4.

States: hub angle [rad], hub rate [rad/s], then angle and rate of each mode [rad], [rad/s].
Modes: friction of the axis (+1, -1 slips, 0 sticks).
Inputs: gear torques of both motors at the motor shaft [N m], what their extrapolation missed in
the last macro-step [N m s], external torque at the axis [N m].
"""

import math

from antenna_drive.parameters.sets import Axis, Encoder, Plant
from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.block import Block, Equation, held, output_rows, put, rest, rows, Signal
from antenna_drive.physics.harmonics import wave
from antenna_drive.physics.table import tabled
from antenna_drive.physics.trigonometry import cosine
from simgap.laws.compiling import inner, shared
from simgap.laws.friction import drag, next_slip, slip_level

STATE = rows('axis_angle', 'axis_rate')  # and two for each mode of the structure
MODE = rows('slip')
INPUT = rows('gear_torque_1', 'gear_torque_2', 'missed_impulse_1', 'missed_impulse_2',
             'external_torque')
OUTPUTS = (
    Signal('axis_angle', 'rad', 'elevation of the hub from its start'),
    Signal('axis_rate', 'rad/s', 'elevation rate of the hub'),
    Signal('encoder', 'rad', 'elevation encoder reading', exchanged=False),
    Signal('pinion_rate', 'rad/s', 'axis rate times the gear ratio', exchanged=False),
    Signal('pointing_error_elevation', 'rad', 'beam minus encoder in elevation',
           exchanged=False),
    Signal('pointing_error_cross_elevation', 'rad', 'beam offset in cross-elevation',
           exchanged=False),
)
OUTPUT = output_rows(OUTPUTS)


@inner
def _mode_torque(x: FloatArray, j: int, p: Axis) -> float:
    """Return the torque of mode j on the hub [N m]."""
    omega = 2.0 * math.pi * p.mode_frequencies[j]
    return p.mode_inertias[j] * (
        omega * omega * (x[2 + 2 * j] - x[STATE.axis_angle])
        + 2.0 * p.mode_damping_ratios[j] * omega * (x[3 + 2 * j] - x[STATE.axis_rate]))


@inner
def _driving_torque(t: float, x: FloatArray, u: FloatArray, p: Axis) -> float:
    """Return every torque on the hub but those of friction and modes [N m], at t."""
    one, two = INPUT.gear_torque_1, INPUT.gear_torque_2
    torque = p.gear_ratio * (u[one, 0] + u[two, 0] + (u[one, 1] + u[two, 1]) * t)
    torque += held(u, INPUT.external_torque, t) + p.steady_wind_torque
    if p.gravity_torque != 0.0:
        torque -= p.gravity_torque * cosine(p.start_elevation + x[STATE.axis_angle])
    if p.learnt != 0.0:
        torque += p.learnt * tabled(x[STATE.axis_angle] - p.torque_by_angle_middle,
                                    p.torque_by_angle_reach, p.torque_by_angle)
    return torque


@inner
def _applied_torque(t: float, x: FloatArray, u: FloatArray, p: Axis) -> float:
    """Return T_o of Eq. (8): every torque on the hub but friction [N m], at t."""
    torque = _driving_torque(t, x, u, p)
    for j in range(p.mode_inertias_count):
        torque += _mode_torque(x, j, p)
    return torque


@inner
def _friction_level(rate: float, angle: float, p: Axis) -> float:
    """Return the size of the axis friction while it slips [N m]."""
    coulomb = p.coulomb_torque * p.friction_torque_per_ampere * p.gear_ratio
    coulomb *= max(0.0, 1.0 + wave(
        angle, p.friction_wave, p.friction_wave_second, p.friction_wave_third,
        p.friction_wave_cycles, p.friction_wave_phase, p.friction_wave_second_phase,
        p.friction_wave_third_phase))
    dragging = drag(rate, p.viscous_friction, p.viscous_rate, p.flow_index)
    level = slip_level(rate, coulomb, dragging, p.stribeck_torque, p.stribeck_rate,
                       p.stribeck_shape, 0.0)
    if p.learnt != 0.0:
        level = max(0.0, level + p.learnt * tabled(
            rate, p.friction_by_rate_reach, p.friction_by_rate))
    return level


@inner
def _acceleration(x: FloatArray, mode: IntArray, torque: float, p: Axis) -> float:
    """Return the hub's acceleration [rad/s^2] under an applied torque [N m], Eq. (2)."""
    if mode[MODE.slip] == 0:
        return 0.0
    friction = mode[MODE.slip] * _friction_level(x[STATE.axis_rate], x[STATE.axis_angle], p)
    return (torque - friction) / p.inertia_hub


@shared
def rates(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Plant, dx: FloatArray,
) -> None:
    """Write the time derivatives of the states."""
    axis = p.axis
    dx[STATE.axis_angle] = x[STATE.axis_rate]
    torque = _driving_torque(t, x, u, axis)
    for j in range(axis.mode_inertias_count):
        of_mode = _mode_torque(x, j, axis)
        dx[2 + 2 * j] = x[3 + 2 * j]
        dx[3 + 2 * j] = -of_mode / axis.mode_inertias[j]
        torque += of_mode
    dx[STATE.axis_rate] = _acceleration(x, mode, torque, axis)


@shared
def switch(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Plant, commit: bool,
) -> bool:
    """Return whether the axis begins to slip or to stick; write the new mode if `commit`."""
    axis = p.axis
    slip = mode[MODE.slip]
    if slip != 0 and slip * x[STATE.axis_rate] > axis.velocity_threshold:
        return False
    level = _friction_level(0.0, x[STATE.axis_angle], axis)
    slip = next_slip(slip, x[STATE.axis_rate], _applied_torque(t, x, u, axis), level,
                     axis.stiction_ratio * level, axis.velocity_threshold)
    changed = slip != mode[MODE.slip]
    if commit and changed:
        mode[MODE.slip] = slip
        if slip == 0:
            x[STATE.axis_rate] = 0.0
    return changed


@inner
def encoder(angle: float, p: Encoder) -> float:
    """
    Return what the elevation encoder says [rad].

    angle : of the hub [rad]
    p : Encoder; offset, cyclic error and step are zero in the article
    """
    reading = angle + p.offset + wave(
        angle, p.cyclic_error, p.cyclic_error_second, p.cyclic_error_third,
        p.cyclic_error_cycles, p.cyclic_error_phase, p.cyclic_error_second_phase,
        p.cyclic_error_third_phase)
    if p.step != 0.0:
        reading = p.step * math.floor(reading / p.step + 0.5)
    return reading


@shared
def read(
        x: FloatArray, mode: IntArray, u: FloatArray, t: float, p: Plant, y: FloatArray,
) -> None:
    """Write the outputs of Fig. 4."""
    axis = p.axis
    angle, rate = x[STATE.axis_angle], x[STATE.axis_rate]
    acceleration = _acceleration(x, mode, _applied_torque(t, x, u, axis), axis)
    put(y, OUTPUT.axis_angle, angle, rate)
    put(y, OUTPUT.axis_rate, rate, acceleration)
    put(y, OUTPUT.encoder, encoder(angle, p.encoder), rate)
    put(y, OUTPUT.pinion_rate, axis.gear_ratio * rate, axis.gear_ratio * acceleration)
    elevation = elevation_rate = cross = cross_rate = 0.0
    for j in range(axis.mode_inertias_count):
        bend = x[2 + 2 * j] - angle
        bend_rate = x[3 + 2 * j] - rate
        elevation += axis.pointing_elevation[j] * bend
        elevation_rate += axis.pointing_elevation[j] * bend_rate
        cross += axis.pointing_cross_elevation[j] * bend
        cross_rate += axis.pointing_cross_elevation[j] * bend_rate
    put(y, OUTPUT.pointing_error_elevation, elevation, elevation_rate)
    put(y, OUTPUT.pointing_error_cross_elevation, cross, cross_rate)


@inner
def begin(
        x: FloatArray, mode: IntArray, u: FloatArray, p: Plant, h: float, y: FloatArray,
) -> None:
    """Make up for teeth that met within the last macro-step, which nobody could extrapolate."""
    if mode[MODE.slip] != 0:
        missed = u[INPUT.missed_impulse_1, 0] + u[INPUT.missed_impulse_2, 0]
        x[STATE.axis_rate] += p.axis.gear_ratio * missed / p.axis.inertia_hub


@inner
def _encoder(t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Plant) -> float:
    return encoder(x[STATE.axis_angle], p.encoder)


BLOCK = Block(
    kind=Plant, bare='axis', states=STATE, modes=MODE, inputs=INPUT, outputs=OUTPUTS,
    more_states=lambda p: 2 * p['axis']['mode_inertias_count'],
    start=rest, rates=rates, switch=switch, read=read, begin=begin,
    values={'encoder': Equation(_encoder)})
