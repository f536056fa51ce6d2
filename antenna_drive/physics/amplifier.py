# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The two amplifiers in front of each motor, Fig. 6.

Amplifier 1 compares the command with the motor's own tachometer and asks for a current
(proportional and integral, limited, with a lag); amplifier 2 drives the armature so that the
current follows. The equations are those of docs/model.md; the article leaves them to its
companion papers.
"""

from antenna_drive.parameters.sets import Amplifier, Armature
from antenna_drive.physics.table import tabled
from simgap.laws.compiling import inner


@inner
def rate_error(
        command_voltage: float, tach_rate: float, bias_command: float, p: Amplifier,
) -> float:
    """
    Return the error e of amplifier 1 [article A].

    command_voltage : v_c [V]
    tach_rate : tachometer reading [rad/s]
    bias_command : s s_F x_F, the counter-torque with the sign of this motor [V]
    p : Amplifier
    """
    volts = command_voltage - p.tach_gain * tach_rate + bias_command + p.offset
    if p.dead_zone > 0.0:
        if volts > p.dead_zone:
            volts -= p.dead_zone
        elif volts < -p.dead_zone:
            volts += p.dead_zone
        else:
            volts = 0.0
    return p.rate_gain * volts


@inner
def limit_centre(rate: float, p: Amplifier, armature: Armature) -> float:
    """
    Return k_e w, about which the demand is limited [article A].

    A demand of k_e w plus the current limit lets just that current flow against the back-EMF.

    rate : w of the motor [rad/s]
    p : Amplifier
    armature : Armature
    """
    kappa = armature.physical_amperes_per_article_ampere
    return armature.back_emf_constant / kappa / (armature.resistance
                                                 + p.current_feedback_gain) * rate


@inner
def limited(demand: float, centre: float, current_limit: float, p: Amplifier) -> float:
    """Return the demand within its limit about `centre`, with what was learnt; in article A."""
    kept = min(max(demand, centre - current_limit), centre + current_limit)
    if p.learnt != 0.0:
        kept += p.learnt * tabled(kept - centre, p.current_by_demand_reach, p.current_by_demand)
    return kept


# What the integral of amplifier 1 does: it integrates; it stands still while the demand is beyond
# the limit; or it moves just so that the demand stays at the limit. The third is where the rule
# of the first two would switch to and fro without end.
FREE, FROZEN, HELD = range(3)


@inner
def error_slope(
        error: float, command_slope: float, tach_slope: float, bias_slope: float, p: Amplifier,
) -> float:
    """
    Return the time derivative of `rate_error` [article A/s].

    error : e [article A], zero within the dead zone
    command_slope, tach_slope, bias_slope : derivatives of its arguments [V/s], [rad/s^2], [V/s]
    p : Amplifier
    """
    if p.dead_zone > 0.0 and error == 0.0:
        return 0.0
    return p.rate_gain * (command_slope - p.tach_gain * tach_slope + bias_slope)


@inner
def next_winding(winding: int, error: float, excess: float, needed: float, p: Amplifier) -> int:
    """
    Return what the integral does next: it must not wind up while the demand is limited.

    winding : FREE, FROZEN or HELD so far
    error : e [article A]
    excess : how far the demand is beyond the limit, in the direction of the error [article A]
    needed : rate of the integral, in that direction, that keeps the excess as it is [article A/s]
    p : Amplifier
    """
    free = abs(error) / p.integral_time
    if winding == HELD:
        if needed >= free:
            return FREE
        return FROZEN if needed < 0.0 else HELD
    if excess > 0.0:
        if winding == FREE and needed > 0.0:
            return FREE if needed >= free else HELD
        return FROZEN
    if winding == FROZEN and 0.0 < needed < free:
        return HELD
    return FREE


@inner
def integral_rate(winding: int, error: float, needed: float, p: Amplifier) -> float:
    """Return the time derivative of the integral of amplifier 1 [article A/s]."""
    if winding == FREE:
        return error / p.integral_time
    if winding == FROZEN:
        return 0.0
    held = min(max(needed, 0.0), abs(error) / p.integral_time)
    return held if error > 0.0 else -held


@inner
def armature_voltage(
        lagged_demand: float, current: float, p: Amplifier, armature: Armature,
) -> float:
    """
    Return the voltage of amplifier 2 at the armature [V], limited to +- V_max.

    lagged_demand : v, the demand behind the lag T_a [article A]
    current : i [article A]
    p : Amplifier
    armature : Armature
    """
    kappa = armature.physical_amperes_per_article_ampere
    gain = p.current_feedback_gain
    if p.crossover > 0.0:
        lagged_demand *= abs(lagged_demand) / (abs(lagged_demand) + p.crossover)
    forward = (armature.resistance + gain) * p.forward_gain_share
    volts = kappa * (forward * lagged_demand - gain * current)
    return min(max(volts, -armature.voltage_limit), armature.voltage_limit)
