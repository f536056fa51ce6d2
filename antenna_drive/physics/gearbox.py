# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The gearbox between a motor and the axis, Fig. 7, referred to the motor shaft."""

from antenna_drive.parameters.sets import Gearbox
from antenna_drive.physics.harmonics import wave, wave_slope
from antenna_drive.physics.table import tabled
from simgap.laws.backlash import contact_torque
from simgap.laws.compiling import inner


@inner
def twist(motor_angle: float, axis_angle: float, gear_ratio: float, p: Gearbox) -> float:
    """
    Return the angle between motor and axis at the motor shaft [rad].

    motor_angle, axis_angle : [rad]
    gear_ratio : N [1]
    p : Gearbox; transmission_error is the unmodelled effect of eccentric or uneven teeth
    """
    return motor_angle - gear_ratio * axis_angle + wave(
        motor_angle, p.transmission_error, p.transmission_error_second,
        p.transmission_error_third, p.transmission_error_cycles, p.transmission_error_phase,
        p.transmission_error_second_phase, p.transmission_error_third_phase)


@inner
def twist_rate(
        motor_angle: float, motor_rate: float, axis_rate: float, gear_ratio: float, p: Gearbox,
) -> float:
    """Return the time derivative of `twist` [rad/s]; rates in rad/s, otherwise as there."""
    return motor_rate - gear_ratio * axis_rate + motor_rate * wave_slope(
        motor_angle, p.transmission_error, p.transmission_error_second,
        p.transmission_error_third, p.transmission_error_cycles, p.transmission_error_phase,
        p.transmission_error_second_phase, p.transmission_error_third_phase)


@inner
def gear_torque(side: int, angle: float, rate: float, presliding: float, p: Gearbox) -> float:
    """
    Return T_g, the torque of the gearbox at the motor shaft; positive drives the axis [N m].

    side : the flank that touches: +1, -1 or 0 for none
    angle, rate : `twist` and `twist_rate` [rad], [rad/s]
    presliding : state of the hysteresis, from -1 to 1
    p : Gearbox
    """
    torque = contact_torque(side, angle, rate, p.half_gap, p.stiffness, p.contact_damping)
    if torque != 0.0 and (p.learnt != 0.0 or p.hysteresis != 0.0 or p.hysteresis_share != 0.0):
        further = (p.hysteresis + p.hysteresis_share * abs(torque)) * presliding
        if p.learnt != 0.0:
            further += p.learnt * tabled(torque, p.torque_by_load_reach, p.torque_by_load)
        torque = max(torque + further, 0.0) if side > 0 else min(torque + further, 0.0)
    return torque


@inner
def presliding_rate(side: int, rate: float, presliding: float, p: Gearbox) -> float:
    """
    Return the time derivative of the hysteresis' state [1/s].

    The state follows Dahl's law: it comes to +-1 once the teeth have moved by a few
    hysteresis_angle in one direction. A friction that is there without load is forgotten while
    the teeth do not touch.
    """
    if p.hysteresis == 0.0 and p.hysteresis_share == 0.0:
        return 0.0
    if side == 0 and p.hysteresis != 0.0:
        return -presliding / _FORGETTING_S
    return (rate - abs(rate) * presliding) / p.hysteresis_angle


# Unloaded teeth give back their elastic slip within some milliseconds.
_FORGETTING_S = 0.01
