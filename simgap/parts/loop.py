# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A cascaded loop as drives have it, called once per sample: position, velocity, current."""

from typing import Annotated, NamedTuple

from simgap.laws.compiling import inner
from simgap.parts.shaping import limited


@inner
def pi_controller(error: float, integral: float, gain: float, integral_time: float,
                  limit: float, step: float) -> tuple[float, float]:
    """
    Return the output of a PI controller and its new integral; it does not wind up at the limit.

    error, gain : in any unit, output per error
    integral : of the last call, in the unit of the output; 0 at first
    integral_time, step : [s], 0 for a proportional controller; since the last call [s]
    limit : of the output
    """
    grown = integral
    if integral_time > 0.0:
        grown = integral + gain * error * step / integral_time
    wanted = gain * error + grown
    output = limited(wanted, limit)
    # at the limit the integral may shrink and not grow
    if output != wanted and (wanted - output) * error > 0.0:
        grown = integral
    return output, grown


class Cascade(NamedTuple):
    """
    The numbers of a cascaded loop.

    position_gain, rate_limit : rate asked for per position error, and its limit
    velocity_gain, current_limit : current asked for per rate error, and its limit
    velocity_time : integral time of the velocity loop; 0 for none
    """

    position_gain: Annotated[float, '1/s']
    rate_limit: Annotated[float, 'rad/s']
    velocity_gain: Annotated[float, 'A s/rad']
    velocity_time: Annotated[float, 's']
    current_limit: Annotated[float, 'A']


@inner
def cascade(loop: Cascade, reference: float, feedforward: float, position: float, rate: float,
            integral: float, step: float) -> tuple[float, float]:
    """
    Return the current asked for [A] and the new integral of the velocity loop [A].

    reference, feedforward : position and rate asked for [rad], [rad/s]
    position, rate : as the drive reads them [rad], [rad/s]
    integral, step : of the last call [A], 0 at first; between two samples of the loop [s]
    """
    asked = limited(loop.position_gain * (reference - position) + feedforward, loop.rate_limit)
    return pi_controller(asked - rate, integral, loop.velocity_gain, loop.velocity_time,
                         loop.current_limit, step)
