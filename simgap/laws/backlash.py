# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Backlash: the torque of a pair of gears with a gap between their teeth, Eq. (1)."""

from simgap.laws.compiling import inner


@inner
def dead_zone(twist: float, half_gap: float) -> float:
    """Return how far teeth are pressed into each other [rad], Eq. (1) with k = 1."""
    if twist > half_gap:
        return twist - half_gap
    if twist < -half_gap:
        return twist + half_gap
    return 0.0


@inner
def contact_side(
        twist: float, twist_rate: float, half_gap: float, stiffness: float, damping: float,
) -> int:
    """Return which flank pushes: +1, -1, or 0 for none; arguments as in `contact_torque`."""
    # flanks that move apart faster than they spring back no longer push, even if pressed
    if twist > half_gap and stiffness * (twist - half_gap) + damping * twist_rate > 0.0:
        return 1
    if twist < -half_gap and stiffness * (twist + half_gap) + damping * twist_rate < 0.0:
        return -1
    return 0


@inner
def contact_torque(
        side: int, twist: float, twist_rate: float, half_gap: float, stiffness: float,
        damping: float,
) -> float:
    """
    Return the torque of flanks on the driven gear [N m], Eq. (1) with a contact damping.

    side : the flank that pushes, from `contact_side`; the torque has its sign
    twist, twist_rate : angle and rate between the two gears [rad], [rad/s]
    half_gap : b, the gap reaches from -b to b [rad]
    stiffness, damping : k [N m/rad], [N m s/rad] in contact; the damping is not in the article
    """
    if side > 0:
        return stiffness * (twist - half_gap) + damping * twist_rate
    if side < 0:
        return stiffness * (twist + half_gap) + damping * twist_rate
    return 0.0


@inner
def contact_torque_rate(
        torque: float, twist_rate: float, twist_acceleration: float, stiffness: float,
        damping: float,
) -> float:
    """Return the time derivative of `contact_torque` [N m/s]: zero while nothing is pushed."""
    if torque == 0.0:
        return 0.0
    return stiffness * twist_rate + damping * twist_acceleration
