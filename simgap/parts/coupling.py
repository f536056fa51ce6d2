# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What connects two shafts: a compliance, with or without a gap between teeth."""

import math

from simgap.laws.backlash import contact_side, contact_torque
from simgap.laws.compiling import inner


@inner
def tooth_torque(twist: float, twist_rate: float, half_gap: float, stiffness: float,
                 damping: float) -> float:
    """
    Return the torque of teeth that push and do not pull [N m]; without a gap, that of a shaft.

    twist, twist_rate : driving minus driven angle and rate [rad], [rad/s]
    half_gap : the gap reaches from -half_gap to half_gap [rad]
    stiffness, damping : of the flanks [N m/rad], [N m s/rad]
    """
    if half_gap <= 0.0:
        return stiffness * twist + damping * twist_rate
    side = contact_side(twist, twist_rate, half_gap, stiffness, damping)
    return contact_torque(side, twist, twist_rate, half_gap, stiffness, damping)


@inner
def steps_for(span: float, stiffness: float, damping: float, inertia: float, load: float) -> int:
    """
    Return in how many steps a span [s] has to be integrated for the shaft's own motion.

    A twentieth of the period and a fifth of the time in which damping decays keep a semi-implicit
    Euler method within a percent.

    stiffness, damping : [N m/rad], [N m s/rad]
    inertia, load : of the two ends [kg m^2]
    """
    both = 1.0 / inertia + 1.0 / load
    fastest = math.sqrt(stiffness * both) * 20.0 / (2.0 * math.pi) + 5.0 * damping * both
    return max(1, int(math.ceil(span * fastest)))
