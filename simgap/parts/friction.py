# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Friction of a body that moves, and true sticking: level, drag, and the rate after a step.

`rate_after` applies the level as an impulse against the motion that can bring the body to an exact
stop and hold it there: no threshold rate and no stiff equation is needed. Torques and forces are
alike: read N m or N, rad/s or m/s, kg m^2 or kg throughout.
"""

import math
from typing import Annotated, NamedTuple

from simgap.laws.compiling import inner
from simgap.laws.friction import slip_level
from simgap.parts.ripple import wave


class Friction(NamedTuple):
    """
    The numbers of a friction; zero switches each of them off.

    coulomb, viscous : friction that does not depend on the rate, and drag per rate
    asymmetry : share by which Coulomb and Stribeck friction are larger forward than their mean
    viscous_asymmetry : the same of the drag
    thinning : 1 minus the exponent of the drag: 0, or 1/3 for grease (Palmgren, Ball and Roller
        Bearing Engineering, 1959)
    thinning_rate : rate at which `viscous` holds whatever the thinning
    stribeck : excess at rest, which fades as exp(-(rate / stribeck_rate)^stribeck_shape)
    load_share : friction per load that the contact carries
    wave_order, wave_cosine, wave_sine : wave by the angle, as a share of the level
    """

    coulomb: Annotated[float, 'N m'] = 0.0
    viscous: Annotated[float, 'N m s/rad'] = 0.0
    asymmetry: Annotated[float, '1'] = 0.0
    viscous_asymmetry: Annotated[float, '1'] = 0.0
    thinning: Annotated[float, '1'] = 0.0
    thinning_rate: Annotated[float, 'rad/s'] = 1.0
    stribeck: Annotated[float, 'N m'] = 0.0
    stribeck_rate: Annotated[float, 'rad/s'] = 1.0
    stribeck_shape: Annotated[float, '1'] = 2.0
    load_share: Annotated[float, '1'] = 0.0
    wave_order: Annotated[float, '1/rev'] = 0.0
    wave_cosine: Annotated[float, '1'] = 0.0
    wave_sine: Annotated[float, '1'] = 0.0


@inner
def level(friction: Friction, rate: float, load: float, angle: float) -> float:
    """
    Return the size of the friction that does not grow with the rate [N m], never below zero.

    rate : of the body; at rest, the direction in which it would move decides, see `direction`
    load, angle : on the contact [N m], of the body [rad]
    """
    size = slip_level(rate, friction.coulomb, 0.0, friction.stribeck, friction.stribeck_rate,
                      friction.stribeck_shape, friction.asymmetry)
    size += friction.load_share * abs(load)
    if friction.wave_cosine != 0.0 or friction.wave_sine != 0.0:
        size *= 1.0 + wave(angle, friction.wave_order, friction.wave_cosine, friction.wave_sine)
    return max(size, 0.0)


@inner
def drag(friction: Friction, rate: float) -> float:
    """Return the drag per rate at a rate [N m s/rad]."""
    slope = friction.viscous
    if friction.viscous_asymmetry != 0.0:
        slope *= 1.0 + (friction.viscous_asymmetry if rate >= 0.0 else -friction.viscous_asymmetry)
    if friction.thinning != 0.0:
        # below a thousandth of the rate at which it holds, the drag counts as proportional
        slope *= max(abs(rate) / friction.thinning_rate, 1e-3) ** -friction.thinning
    return slope


@inner
def direction(rate: float, torque: float) -> float:
    """Return the rate, or at rest a vanishing one in the direction of the torque."""
    if rate != 0.0:
        return rate
    return math.copysign(1e-300, torque)


@inner
def rate_after(step: float, rate: float, torque: float, level: float, drag: float,
               inertia: float) -> float:
    """
    Return the rate after a step, exactly zero where the level exceeds what would move the body.

    step, rate : [s], before it [rad/s]; the drag acts at the mean rate, the level as an impulse
    torque : on the body but for friction [N m]
    level, drag : of friction [N m], [N m s/rad]
    inertia : [kg m^2]
    """
    free = rate + step * (torque - 0.5 * drag * rate) / inertia
    impulse = step * level / inertia
    free = max(free - impulse, 0.0) if free > 0.0 else min(free + impulse, 0.0)
    return free / (1.0 + 0.5 * step * drag / inertia)


@inner
def presliding(share: float, rate: float, distance: float, step: float) -> float:
    """
    Return the share of the friction level that acts after a step, from -1 to 1 (Dahl's model).

    Apply level * share as a torque against the motion, and no level in `rate_after`: the contact
    is a spring before it slides.

    share : before the step
    rate, step : of the body in it [rad/s], [s]
    distance : over which friction builds up after a reversal [rad]; 0 for at once
    """
    if rate == 0.0:
        return share
    side = math.copysign(1.0, rate)
    if distance <= 0.0:
        return side
    return side + (share - side) * math.exp(-abs(rate) * step / distance)
