# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What sensors make of a motion: encoder, tachometer, current reading.

A reading with its digit is a staircase without a derivative. In a simulation that is to be fitted,
give the digit to the `reading`; `digitised` and `counts` are for controllers.
"""

import math

from simgap.laws.compiling import inner
from simgap.parts.ripple import wave


@inner
def encoder(angle: float, order: float, cosine: float, sine: float) -> float:
    """
    Return the reading of a scale with a cyclic error, such as one mounted off centre [rad].

    angle : true [rad]
    order : cycles per revolution: 1 for eccentricity, that of the lines for interpolation
    cosine, sine : amplitudes of the error [rad]; it is counted from that at angle zero
    """
    return angle + wave(angle, order, cosine, sine) - cosine


@inner
def counts(angle: float, counts_per_revolution: float) -> float:
    """Return the counts of an incremental encoder: whole lines passed."""
    return math.floor(angle * counts_per_revolution / (2.0 * math.pi))


@inner
def digitised(value: float, digit: float) -> float:
    """Return the nearest whole multiple of a digit; the value itself if the digit is 0."""
    if digit <= 0.0:
        return value
    return digit * math.floor(value / digit + 0.5)


@inner
def tachometer(rate: float, angle: float, gain_error: float, zero: float, order: float,
               cosine: float, sine: float) -> float:
    """
    Return the reading of a tachometer in the unit of the rate.

    rate, angle : of its shaft [rad/s], [rad]
    gain_error, zero : share by which it reads too much, and reading at rest [rad/s]
    order, cosine, sine : ripple: cycles per revolution, amplitudes as shares of the rate
    """
    return rate * (1.0 + gain_error + wave(angle, order, cosine, sine)) + zero
