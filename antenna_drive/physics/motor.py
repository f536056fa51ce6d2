# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The motor's mechanics: torque of the current against the gear's and the friction's, Fig. 7."""

from antenna_drive.parameters.sets import Ammeter, Motor, Tachometer
from antenna_drive.physics.harmonics import wave, wave_slope
from antenna_drive.physics.table import tabled
from simgap.laws.compiling import inner
from simgap.laws.friction import drag, slip_level


@inner
def driving_torque(current: float, angle: float, p: Motor) -> float:
    """
    Return the torque of the armature on the rotor [N m].

    current : i [article A]
    angle : of the rotor [rad]
    p : Motor; torque_ripple is the unmodelled effect of a rotor with poles and slots
    """
    torque = p.torque_constant * current + wave(
        angle, p.torque_ripple, p.torque_ripple_second, p.torque_ripple_third,
        p.torque_ripple_cycles, p.torque_ripple_phase, p.torque_ripple_second_phase,
        p.torque_ripple_third_phase)
    if p.learnt != 0.0:
        torque += p.learnt * tabled(current, p.torque_by_current_reach, p.torque_by_current)
    return torque


@inner
def friction_level(rate: float, gear_torque: float, p: Motor) -> float:
    """
    Return the size of the rotor's friction torque while it slips [N m].

    rate : w of the rotor [rad/s]
    gear_torque : T_g on the shaft, for the effect of a friction that grows with load [N m]
    p : Motor
    """
    coulomb = p.coulomb_torque * p.friction_torque_per_ampere
    if p.load_dependent_friction != 0.0:
        coulomb += p.load_dependent_friction * abs(gear_torque)
    dragging = drag(rate, p.viscous_friction, p.viscous_rate, p.flow_index)
    level = slip_level(rate, coulomb, dragging, p.stribeck_torque, p.stribeck_rate,
                       p.stribeck_shape, p.friction_asymmetry)
    if p.learnt != 0.0:
        further = tabled(rate, p.friction_by_rate_reach, p.friction_by_rate) + tabled(
            gear_torque, p.friction_by_load_reach, p.friction_by_load)
        level = max(0.0, level + p.learnt * further)
    return level


@inner
def tachometer(rate: float, angle: float, p: Tachometer) -> float:
    """
    Return what the tachometer says [rad/s].

    rate, angle : of the rotor [rad/s], [rad]
    p : Tachometer; gain 1, offset 0 and ripple 0 in the article
    """
    return p.gain * rate + p.offset + rate * wave(
        angle, p.ripple, p.ripple_second, p.ripple_third, p.ripple_cycles, p.ripple_phase,
        p.ripple_second_phase, p.ripple_third_phase)


@inner
def tachometer_slope(rate: float, angle: float, acceleration: float, p: Tachometer) -> float:
    """
    Return the time derivative of what the tachometer says [rad/s^2].

    rate, angle, acceleration : of the rotor [rad/s], [rad], [rad/s^2]
    p : Tachometer
    """
    return p.gain * acceleration + acceleration * wave(
        angle, p.ripple, p.ripple_second, p.ripple_third, p.ripple_cycles, p.ripple_phase,
        p.ripple_second_phase, p.ripple_third_phase) + rate * rate * wave_slope(
            angle, p.ripple, p.ripple_second, p.ripple_third, p.ripple_cycles, p.ripple_phase,
            p.ripple_second_phase, p.ripple_third_phase)


@inner
def ammeter(current: float, p: Ammeter) -> float:
    """Return what the ammeter says [article A]; p : Ammeter, gain 1, offset 0 in the article."""
    return p.gain * current + p.offset
