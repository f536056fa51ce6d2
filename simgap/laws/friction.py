# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Friction with stiction, Eq. (2)-(8).

A body is in one of three modes: it slips forward (+1), slips backward (-1) or sticks (0). While it
sticks, friction equals the applied torque T_o of Eq. (8), computed with the rate at zero; it
breaks away when T_o exceeds the stiction torque, Eq. (4), and then slips against the Coulomb
torque. `friction_torque` is the law of Eq. (2) itself, as Fig. 3 draws it.
"""

import math

from simgap.laws.compiling import inner


@inner
def friction_torque(
        rate: float, applied: float, coulomb: float, stiction: float, threshold: float,
) -> float:
    """
    Return the friction torque on the body [N m], Eq. (2).

    rate, threshold : v, and v_t below which it counts as zero [rad/s]
    applied : T_o, the torque on the body but for friction [N m]
    coulomb, stiction : T_c and T_s [N m]
    """
    if abs(rate) > threshold:
        return -coulomb * ((rate > 0.0) - (rate < 0.0))
    return -min(abs(applied), stiction) * ((applied > 0.0) - (applied < 0.0))


@inner
def drag(rate: float, viscous: float, viscous_rate: float, flow_index: float) -> float:
    """
    Return the size of the viscous friction torque [N m]: a power law of the rate [rad/s].

    viscous, viscous_rate : torque per rate at that rate, zero in the article [N m s/rad], [rad/s]
    flow_index : exponent [1]: 1 for oil, 2 for windage, less than 1 for grease (2/3 for the
        bearings of Palmgren, Ball and Roller Bearing Engineering, 1959)
    """
    torque = viscous * abs(rate)
    if viscous != 0.0 and flow_index != 1.0 and rate != 0.0:
        torque *= (abs(rate) / viscous_rate) ** (flow_index - 1.0)
    return torque


@inner
def slip_level(
        rate: float, coulomb: float, dragging: float, stribeck: float, stribeck_rate: float,
        stribeck_shape: float, asymmetry: float,
) -> float:
    """
    Return the size of the friction torque of a slipping body [N m].

    rate : [rad/s]; where it is zero the level of forward slip is given
    coulomb, dragging : T_c, and viscous torque from `drag` [N m]
    stribeck : excess of torque as slipping begins, zero in the article [N m]; it fades as
        exp(-(rate / stribeck_rate)^stribeck_shape), [rad/s], [1]
    asymmetry : share by which forward friction exceeds, and backward friction falls short of, the
        mean of both, zero in the article [1]
    """
    level = coulomb
    if stribeck != 0.0:
        level += stribeck * math.exp(-(abs(rate) / stribeck_rate) ** stribeck_shape)
    if asymmetry != 0.0:
        level *= 1.0 + (asymmetry if rate >= 0.0 else -asymmetry)
    return level + dragging


@inner
def next_slip(
        slip: int, rate: float, applied: float, coulomb: float, stiction: float,
        threshold: float,
) -> int:
    """
    Return the mode that follows `slip`: +1 and -1 slip forward and backward, 0 sticks.

    A slipping body sticks when its rate [rad/s] changes sign, or slows down within the threshold
    while stiction can hold it; a sticking body breaks away when the applied torque T_o exceeds
    stiction, [N m].
    """
    if slip == 0:
        if applied > stiction:
            return 1
        if applied < -stiction:
            return -1
        return 0
    if slip * rate < 0.0:
        return 0
    if slip * rate <= threshold and slip * applied < coulomb and abs(applied) <= stiction:
        return 0
    return slip
