# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The laws of single parts of the real antenna, compiled: teeth, friction, loads and delays."""

import math
from typing import Any

from lab.antenna.compiled import compiled
from lab.antenna.machine import GUST_WAVES, LAW_B
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@compiled
def gear_deflection(motor: Any, structure: Any, theta: float, w: float, theta_a: float,
                    w_a: float) -> tuple[float, float, float]:
    """Return the angle between motor and pinion, its rate, and the half gap [rad, rad/s, rad]."""
    ratio = structure.gear_ratio
    x = theta - ratio * theta_a
    x_rate = w - ratio * w_a
    if motor.mesh_error != 0.0:
        angle = motor.mesh_cycles * theta + motor.mesh_phase
        if motor.law == LAW_B:
            # Eccentricity and ovality: two harmonics.
            shape = math.sin(angle) + 0.3 * math.sin(2.0 * angle + 1.0)
            slope = math.cos(angle) + 0.6 * math.cos(2.0 * angle + 1.0)
        else:
            # A rounded saw-tooth: sum of q^(n-1) sin(n a) / n with q = 1/2.
            sine, cosine = 0.5 * math.sin(angle), 1.0 - 0.5 * math.cos(angle)
            shape = 2.0 * math.atan2(sine, cosine)
            slope = 2.0 * ((0.5 * math.cos(angle) * cosine - sine * sine) / (sine**2 + cosine**2))
        x -= motor.mesh_error * shape
        x_rate -= motor.mesh_error * slope * motor.mesh_cycles * w
    if motor.tooth_height != 0.0:
        # One raised tooth in each revolution of a slower shaft: a narrow von Mises bump.
        angle = theta / motor.tooth_ratio + motor.tooth_phase
        bump = motor.tooth_height * math.exp(40.0 * (math.cos(angle) - 1.0))
        x -= bump
        x_rate += bump * 40.0 * math.sin(angle) * w / motor.tooth_ratio
    half_gap = motor.half_gap
    if structure.bull_gap != 0.0:
        # Wear varies along the bull gear: by a fifth in twenty cycles, or by two fifths in one.
        if structure.law == LAW_B:
            half_gap += structure.bull_gap * (1.0 + 0.4 * math.sin(theta_a))
        else:
            half_gap += structure.bull_gap * (1.0 + 0.2 * math.cos(20.0 * theta_a))
    return x, x_rate, half_gap


@compiled
def contact_torque(motor: Any, depth: float, depth_rate: float, lag: float) -> float:
    """Return the torque of teeth pressed together by `depth` [rad], Eq. (1) with damping [N m]."""
    stiffness = motor.stiffness * (1.0 + motor.hardening * depth * depth)
    return (stiffness * depth * (1.0 + motor.hysteresis * lag)
            + motor.contact_damping * depth_rate)


@compiled
def viscous_torque(coefficient: float, rate: float, knee: float, law: float) -> float:
    """Return the drag of a lubricant that thins under shear, for B as Eyring's fluid [N m]."""
    if law == LAW_B:
        return coefficient * 5.0 * knee * math.asinh(rate / (5.0 * knee))
    return coefficient * rate * (1.0 + (rate / knee)**2)**-0.075


@compiled
def stribeck_torque(rise: float, rate: float, half_rate: float, law: float) -> float:
    """
    Return the friction above Coulomb's at low rate [N m].

    A hyperbola of the rate; for B the curve of Hess and Soom, J. Tribology 112 (1990) 147.
    """
    if law == LAW_B:
        return rise / (1.0 + (rate / half_rate)**2)
    return rise / (1.0 + abs(rate) / half_rate)


@compiled
def ripple_shape(angle: float, law: float) -> float:
    """Return the shape of a torque ripple over its angle, about -1 to 1."""
    if law == LAW_B:
        return math.tanh(2.0 * math.sin(angle)) / math.tanh(2.0)
    return (math.sin(angle) + 0.3 * math.sin(2.0 * angle + 1.0)) / 1.044


@compiled
def crossover(demand: float, half_width: float, law: float) -> float:
    """Return a demand behind a smooth dead zone [A]."""
    if law == LAW_B:
        return demand - half_width * demand / math.sqrt(demand**2 + half_width**2)
    return demand - half_width * math.tanh(demand / half_width)


@compiled
def motor_friction(motor: Any, rate: float, direction: float, gear: float,
                   middle: float) -> tuple[float, float]:
    """Return the size of kinetic friction and the stiction of a motor in one direction [N m]."""
    if motor.law == LAW_B:
        level = motor.coulomb * math.exp(motor.asymmetry * direction)
    else:
        level = motor.coulomb * (1.0 + motor.asymmetry * direction)
    if motor.load_friction != 0.0:
        if motor.law == LAW_B:
            level += motor.load_friction * gear * gear / (abs(gear) + 1.0)
        else:
            level += motor.load_friction * (math.sqrt(gear * gear + 0.25) - 0.5)
    if motor.brake_start < middle < motor.brake_end:
        level += motor.brake
    kinetic = level + stribeck_torque(motor.stribeck, rate, motor.stribeck_rate, motor.law)
    return kinetic, motor.stiction_ratio * level + motor.stribeck


@compiled
def axis_friction(structure: Any, angle: float, rate: float, t: float) -> tuple[float, float]:
    """Return the size of kinetic friction and the stiction of the axis, without Dahl's [N m]."""
    level = structure.coulomb * (1.0 - structure.dahl)
    if structure.bump != 0.0:
        phase = 2.0 * math.pi * angle / structure.bump_pitch + structure.bump_phase
        if structure.law == LAW_B:
            # Plates of the rail that rub more and less in turn.
            level *= 1.0 + structure.bump * math.tanh(3.0 * math.sin(phase)) / math.tanh(3.0)
        else:
            level *= 1.0 + structure.bump * (2.0 * math.exp(2.0 * (math.cos(phase) - 1.0)) - 0.617)
    if structure.hard_spot != 0.0:
        off = (angle - structure.hard_spot_at) / structure.hard_spot_width
        level *= 1.0 + structure.hard_spot / (1.0 + off**4)
    if structure.warming != 0.0:
        level *= 1.0 - structure.warming * (1.0 - math.exp(-t / structure.warming_time))
    kinetic = level + stribeck_torque(structure.stribeck, rate, structure.stribeck_rate,
                                      structure.law)
    return kinetic, structure.stiction_ratio * level + structure.stribeck


@compiled
def load_torque(structure: Any, angle: float, t: float, middle: float, elevation: float) -> float:
    """Return the torque of gravity, wind and shifted ballast about the axis [N m]."""
    torque = structure.wind
    if structure.gravity != 0.0:
        torque -= structure.gravity * math.cos(elevation + angle)
    if structure.cable != 0.0:
        torque -= structure.cable * angle
    if 0.0 <= structure.ballast_at < middle:
        torque += structure.ballast
    if structure.gust_frequency[0] > 0.0:
        for wave in range(GUST_WAVES):
            torque += structure.gust[wave] * math.sin(
                structure.gust_frequency[wave] * t + structure.gust_phase[wave])
    return torque


@compiled
def delayed(y: FloatArray, dy: FloatArray, at: int, value: float, delay: float) -> float:
    """Return a value after the [3/4] Pade approximant of a delay; its states start at `at`."""
    s = 1.0 / delay
    dy[at] = s * y[at + 1]
    dy[at + 1] = s * y[at + 2]
    dy[at + 2] = s * y[at + 3]
    dy[at + 3] = s * (value - 840.0 * y[at] - 480.0 * y[at + 1] - 120.0 * y[at + 2]
                      - 16.0 * y[at + 3])
    return 840.0 * y[at] - 360.0 * y[at + 1] + 60.0 * y[at + 2] - 4.0 * y[at + 3]


@compiled
def lagged(y: FloatArray, dy: FloatArray, at: int, value: float, delay: float) -> float:
    """Return a value after four equal lags that add up to a delay; their states start at `at`."""
    s = 4.0 / delay
    dy[at] = s * (value - y[at])
    for k in range(1, 4):
        dy[at + k] = s * (y[at + k - 1] - y[at + k])
    return y[at + 3]
