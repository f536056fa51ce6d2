# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Sine and cosine in a few nanoseconds, the same bits on every machine.

The sine of the C library takes several times as long, and its last bit depends on library and
processor. What repeats with an angle is computed some ten times in each step of the diagnosis.
The method is that of W. J. Cody and W. Waite, Software Manual for the Elementary Functions, 1980:
whole half-turns are taken off in parts that are exact, and a polynomial does the rest.
"""

import math

from simgap.laws.compiling import inner

# pi / 2 in three parts; the first two have 33 bits, so that up to 2^20 of them are exact.
_QUARTER_TURN = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
# (sin(r) / r - 1) / r^2 as a polynomial in r^2, which meets it at the Chebyshev nodes of
# 0 <= r^2 <= (pi / 2)^2; sin(r) is off by 4e-17 at most.
_SERIES = (-0.16666666666666666, 0.008333333333333316, -0.00019841269841254966,
           2.7557319219160833e-06, -2.505210761669045e-08, 1.6058977292642743e-10,
           -7.643969663988074e-13, 2.7314368769379893e-15)
_HALF_TURNS_PER_RADIAN = 1.0 / math.pi


@inner
def sine(angle: float) -> float:
    """Return the sine of an angle below a million [rad], off by 3e-16 at most."""
    half_turns = math.floor(angle * _HALF_TURNS_PER_RADIAN + 0.5)
    rest = _sine_beyond(angle, 2 * half_turns)
    return -rest if half_turns & 1 else rest


@inner
def cosine(angle: float) -> float:
    """Return the cosine of an angle below a million [rad], off by 3e-16 at most."""
    half_turns = math.floor(angle * _HALF_TURNS_PER_RADIAN)
    rest = _sine_beyond(angle, 2 * half_turns + 1)
    return rest if half_turns & 1 else -rest


@inner
def _sine_beyond(angle: float, quarter_turns: int) -> float:
    """Return the sine of what an angle has beyond whole quarter-turns, within one of them."""
    large, small, smallest = _QUARTER_TURN
    r = ((angle - quarter_turns * large) - quarter_turns * small) - quarter_turns * smallest
    y = r * r
    a, b, c, d, e, f, g, h = _SERIES
    return r + r * y * (a + y * (b + y * (c + y * (d + y * (e + y * (f + y * (g + y * h)))))))
