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
The antenna's structure: a hub on friction, with flexible modes, and all outputs of Fig. 4.

States: hub angle [rad], hub rate [rad/s], then angle and rate of each mode [rad], [rad/s].
Mode: friction of the axis (+1, -1 slips, 0 sticks).
Inputs: gear torques of both motors at the motor shaft [N m], what their extrapolation missed in
the last macro-step [N m s], external torque at the axis [N m].
Outputs: axis angle [rad], axis rate [rad/s], encoder [rad], pinion rate [rad/s], pointing errors
in elevation and cross-elevation [rad].
"""

from __future__ import annotations

import math

from antenna_drive.parameters.sets import Axis, Encoder, Plant
from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.compiling import compiled, inner, shared
from antenna_drive.physics.friction import drag, next_slip, slip_level
from antenna_drive.physics.harmonics import wave
from antenna_drive.physics.integrator import located_runge_kutta
import numpy as np

ANGLE, RATE = range(2)
MODES = 1
GEAR_TORQUE_1, GEAR_TORQUE_2, MISSED_1, MISSED_2, EXTERNAL_TORQUE = range(5)
INPUTS = 5
OUTPUTS = 6
_AT_REST = np.zeros((INPUTS, 2))


def states(mode_count: int) -> int:
    """Return the number of states of a structure with so many flexible modes."""
    return 2 + 2 * mode_count


@inner
def _mode_torque(x: FloatArray, j: int, p: Axis) -> float:
    """Return the torque of mode j on the hub [N m]."""
    omega = 2.0 * math.pi * p.mode_frequencies[j]
    return p.mode_inertias[j] * (
        omega * omega * (x[2 + 2 * j] - x[ANGLE])
        + 2.0 * p.mode_damping_ratios[j] * omega * (x[3 + 2 * j] - x[RATE]))


@inner
def _applied_torque(t: float, x: FloatArray, u: FloatArray, p: Axis) -> float:
    """Return T_o of Eq. (8): every torque on the hub but friction [N m], at t."""
    torque = p.gear_ratio * (u[GEAR_TORQUE_1, 0] + u[GEAR_TORQUE_2, 0]
                             + (u[GEAR_TORQUE_1, 1] + u[GEAR_TORQUE_2, 1]) * t)
    torque += u[EXTERNAL_TORQUE, 0] + u[EXTERNAL_TORQUE, 1] * t + p.steady_wind_torque
    if p.gravity_torque != 0.0:
        torque -= p.gravity_torque * math.cos(p.start_elevation + x[ANGLE])
    for j in range(p.mode_inertias_count):
        torque += _mode_torque(x, j, p)
    return torque


@inner
def _friction_level(rate: float, angle: float, p: Axis) -> float:
    """Return the size of the axis friction while it slips [N m]."""
    coulomb = p.coulomb_torque * p.friction_torque_per_ampere * p.gear_ratio
    if (p.friction_wave != 0.0 or p.friction_wave_second != 0.0
            or p.friction_wave_third != 0.0):
        coulomb *= max(0.0, 1.0 + wave(
            angle, p.friction_wave, p.friction_wave_second, p.friction_wave_third,
            p.friction_wave_cycles, p.friction_wave_phase, p.friction_wave_second_phase,
            p.friction_wave_third_phase))
    dragging = drag(rate, p.viscous_friction, p.viscous_rate, p.flow_index)
    return slip_level(rate, coulomb, dragging, p.stribeck_torque, p.stribeck_rate,
                      p.stribeck_shape, 0.0)


@inner
def _acceleration(t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Axis) -> float:
    """Return the hub's acceleration [rad/s^2] at t, Eq. (2)."""
    if mode[0] == 0:
        return 0.0
    friction = mode[0] * _friction_level(x[RATE], x[ANGLE], p)
    return (_applied_torque(t, x, u, p) - friction) / p.inertia_hub


@shared
def _rates(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Axis, dx: FloatArray,
) -> None:
    dx[ANGLE] = x[RATE]
    dx[RATE] = _acceleration(t, x, mode, u, p)
    for j in range(p.mode_inertias_count):
        dx[2 + 2 * j] = x[3 + 2 * j]
        dx[3 + 2 * j] = -_mode_torque(x, j, p) / p.mode_inertias[j]


@shared
def _switch(t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Axis, commit: bool) -> bool:
    slip = mode[0]
    if slip != 0 and slip * x[RATE] > p.velocity_threshold:
        return False
    level = _friction_level(0.0, x[ANGLE], p)
    slip = next_slip(slip, x[RATE], _applied_torque(t, x, u, p), level,
                     p.stiction_ratio * level, p.velocity_threshold)
    changed = slip != mode[0]
    if commit and changed:
        mode[0] = slip
        if slip == 0:
            x[RATE] = 0.0
    return changed


_advance = located_runge_kutta(_rates, _switch)


@inner
def encoder(angle: float, p: Encoder) -> float:
    """
    Return what the elevation encoder says [rad].

    Parameters
    ----------
    angle
        of the hub [rad]
    p
        Encoder; offset, cyclic error and step are zero in the article

    """
    reading = angle + p.offset
    if p.cyclic_error != 0.0 or p.cyclic_error_second != 0.0 or p.cyclic_error_third != 0.0:
        reading += wave(angle, p.cyclic_error, p.cyclic_error_second, p.cyclic_error_third,
                        p.cyclic_error_cycles, p.cyclic_error_phase,
                        p.cyclic_error_second_phase, p.cyclic_error_third_phase)
    if p.step != 0.0:
        reading = p.step * math.floor(reading / p.step + 0.5)
    return reading


@compiled
def outputs(
        x: FloatArray, mode: IntArray, u: FloatArray, t: float, p: Plant, y: FloatArray,
) -> None:
    """
    Write the outputs of Fig. 4 at t after the start of a macro-step, with their derivatives.

    Parameters
    ----------
    x, mode
        states and mode at t, shapes (2 + 2 modes,) and (1,)
    u
        inputs at the start of the macro-step, shape (5, 2)
    t
        [s]
    p
        record of Plant
    y
        receives value and derivative of each output, shape (6, 2)

    """
    axis = p.axis
    acceleration = _acceleration(t, x, mode, u, axis)
    y[0, 0] = x[ANGLE]
    y[0, 1] = x[RATE]
    y[1, 0] = x[RATE]
    y[1, 1] = acceleration
    y[2, 0] = encoder(x[ANGLE], p.encoder)
    y[2, 1] = x[RATE]
    y[3, 0] = axis.gear_ratio * x[RATE]
    y[3, 1] = axis.gear_ratio * acceleration
    y[4, :] = 0.0
    y[5, :] = 0.0
    for j in range(axis.mode_inertias_count):
        bend = x[2 + 2 * j] - x[ANGLE]
        bend_rate = x[3 + 2 * j] - x[RATE]
        y[4, 0] += axis.pointing_elevation[j] * bend
        y[4, 1] += axis.pointing_elevation[j] * bend_rate
        y[5, 0] += axis.pointing_cross_elevation[j] * bend
        y[5, 1] += axis.pointing_cross_elevation[j] * bend_rate


@compiled
def start(p: Plant, x: FloatArray, mode: IntArray, y: FloatArray) -> None:
    """Write the state at rest, at angle zero, into x and mode, and its outputs into y."""
    x[:] = 0.0
    mode[:] = 0
    outputs(x, mode, _AT_REST, 0.0, p, y)


@compiled
def step(
        x: FloatArray, mode: IntArray, u: FloatArray, p: Plant, h: float, steps: int,
        work: FloatArray, y: FloatArray,
) -> None:
    """
    Advance the structure over one macro-step.

    Parameters
    ----------
    x, mode
        states and mode, advanced in place, shapes (2 + 2 modes,) and (1,)
    u
        inputs, value and time derivative at the start of the macro-step, shape (5, 2)
    p
        record of Plant
    h
        macro-step [s]
    steps
        inner steps in it
    work
        from `integrator.work_space`
    y
        receives the outputs at the end, shape (6, 2)

    """
    # teeth that met within the last macro-step pushed in a way that nobody could extrapolate
    if mode[0] != 0:
        x[RATE] += p.axis.gear_ratio * (u[MISSED_1, 0] + u[MISSED_2, 0]) / p.axis.inertia_hub
    _advance(x, mode, u, p.axis, h, steps, work)
    outputs(x, mode, u, h, p, y)
