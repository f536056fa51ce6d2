# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What happens to a signal on its way: limits, a dead zone, a rate limit, a lag, a delay."""

import math

import numpy as np
from numpy.typing import NDArray
from simgap.laws.backlash import dead_zone
from simgap.laws.compiling import inner, shared

__all__ = ['dead_zone', 'delayed', 'held', 'lagged', 'lagged_mean', 'limited', 'rate_limited',
           'soft_limited']


@inner
def limited(value: float, limit: float) -> float:
    """Return a value within -limit and limit, in its own unit."""
    return min(max(value, -limit), limit)


@inner
def soft_limited(value: float, softness: float) -> float:
    """Return value / (1 + softness |value|), as of iron that saturates; softness in 1/unit."""
    return value / (1.0 + softness * abs(value))


@inner
def rate_limited(value: float, wanted: float, limit: float, step: float) -> float:
    """Return a value after a step [s] towards `wanted`, limited in its change per second."""
    return value + min(max(wanted - value, -limit * step), limit * step)


@inner
def lagged(value: float, source: float, time_constant: float, step: float) -> float:
    """
    Return the output of a first-order lag after a step [s] in which its input stands still.

    `value` is before the step, `source` is the input, and `time_constant` is in s; 0 for no lag.
    """
    if time_constant <= 0.0:
        return source
    return source + (value - source) * math.exp(-step / time_constant)


@inner
def lagged_mean(value: float, source: float, time_constant: float,
                step: float) -> tuple[float, float]:
    """
    Return the mean output of a first-order lag over a step, and its output at the end of it.

    A machine driven by the mean feels even a lag far below the step. Arguments as for `lagged`.
    """
    if time_constant <= 0.0:
        return source, source
    fall = math.exp(-step / time_constant)
    return (source + (value - source) * time_constant / step * (1.0 - fall),
            source + (value - source) * fall)


@inner
def delayed(past: NDArray[np.float64], k: int, ticks: float) -> float:
    """
    Return what a signal was some ticks ago, on the straight line between two samples.

    It has a derivative by the delay, which `held` has not.

    past, k : the signal at each tick so far, shape (n,), and the present tick
    ticks : delay, 0 or more; before the first sample the first value holds
    """
    whole, share = int(ticks), ticks % 1.0
    return (1.0 - share) * past[max(k - whole, 0)] + share * past[max(k - whole - 1, 0)]


@shared
def held(time: NDArray[np.float64], values: NDArray[np.float64], moment: float,
         place: int) -> tuple[float, int]:
    """
    Return the held value of a sampled signal at a moment [s], and the index of its sample.

    A delayed command is `held(time, command, now - delay, place)`.

    time, values : of the samples, shape (n,) [s], any unit; the first holds before it
    place : index from which the search starts, as the last call returned it; 0 at first
    """
    # a sample's time is a sum of steps, and a sum of steps is rounded
    while place + 1 < time.size and time[place + 1] <= moment + 1e-9:
        place += 1
    while place > 0 and time[place] > moment + 1e-9:
        place -= 1
    return values[place], place
