# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Readings at other times than the simulation's.

Recorders read some channels late, and their clocks are off. A run therefore keeps its outputs at
some times between the samples, too, and a reading is interpolated between them by values and
slopes. To first order alone, a delay of 7 ms at 5 Hz is off by 2 percent of the signal.
"""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any

from antenna_drive.physics.compiling import compiled
from antenna_drive.physics.motor import tachometer, tachometer_slope
import numpy as np
from simgap.machine.contract import FloatArray

# Greatest time between two outputs [s]: two of the longest steps of a whole run, and less than one
# of a search.
_SPACING_S = 5.3e-3


def parts_of(period: float) -> int:
    """Return into how many parts the outputs cut the time between two samples."""
    return max(math.ceil(period / _SPACING_S), 1)


def dense(time: FloatArray, parts: int) -> FloatArray:
    """Return times with others between them, shape (parts (n - 1) + 1,) [s]."""
    places = np.arange(parts * (time.size - 1) + 1) / parts
    found = np.interp(places, np.arange(time.size), time)
    found[::parts] = time
    return found


def read_at(time: FloatArray, out: FloatArray, wanted: FloatArray, late: FloatArray,
            ) -> FloatArray:
    """
    Return readings at other times, shape (m, c).

    Before the first output the machine stands still, after the last it goes on.

    time : of the outputs, increasing, shape (n,) [s]
    out : values and slopes of every channel, shape (n, c, 2)
    wanted : times, shape (m,) [s]
    late : by how much earlier each channel is read, shape (c,) [s]
    """
    found = np.empty((wanted.size, late.size))
    _read_at(time, out, wanted, late, found)
    return found


def lagging(time: FloatArray, out: FloatArray, lag: FloatArray) -> FloatArray:
    """
    Return outputs behind a first-order low-pass each, in the form of `out`.

    Before the first output nothing has moved; between outputs straight lines are filtered exactly.

    time, out : as in `read_at`
    lag : time constant of each channel, shape (c,) [s]; 0 for no filter
    """
    if not lag.any():
        return out
    found = out.copy()
    _lagging(time, out, lag, found)
    return found


@dataclass(frozen=True)
class RipplingTachometer:
    """
    A tachometer whose ripple may be faster than the outputs of a run.

    What is interpolated is the motion of its rotor, from which the reading follows.
    """

    angle: FloatArray  # of its rotor at each output, shape (n,) [rad]
    # its record, shape (1,), see `parameters.sets.Tachometer`
    numbers: np.ndarray[Any, np.dtype[Any]]

    def read_at(self, time: FloatArray, out: FloatArray, wanted: FloatArray,
                late: float) -> FloatArray:
        """Return readings at other times, shape (m,) [rad/s]; `out` has shape (n, 2)."""
        motion = np.empty((self.angle.size, 2, 2))
        _motion(self.angle, out, self.numbers, motion)
        later = read_at(time, motion, wanted, np.full(2, late))
        found = np.empty(wanted.size)
        _readings(later, self.numbers, found)
        return found


@dataclass(frozen=True)
class Outputs:
    """What a run gives at the output times."""

    values: FloatArray  # and slopes of n channels, shape (times, n, 2)
    rippling: Mapping[str, RipplingTachometer]  # those with a ripple, by names of readings


@compiled
def _motion(angle: FloatArray, out: FloatArray, p: Any, motion: FloatArray) -> None:
    """Write angle and rate of a rotor and their slopes, as its tachometer and its angle say."""
    for i in range(angle.size):
        # the reading at rate 1 and the slope at rate 1 without acceleration
        gain = tachometer(1.0, angle[i], p[0]) - p[0].offset
        rate = (out[i, 0] - p[0].offset) / gain
        slope = rate * rate * tachometer_slope(1.0, angle[i], 0.0, p[0])
        motion[i, 0, 0], motion[i, 0, 1] = angle[i], rate
        motion[i, 1, 0], motion[i, 1, 1] = rate, (out[i, 1] - slope) / gain


@compiled
def _readings(motion: FloatArray, p: Any, found: FloatArray) -> None:
    for i in range(found.size):
        found[i] = tachometer(motion[i, 1], motion[i, 0], p[0])


@compiled
def _lagging(time: FloatArray, out: FloatArray, lag: FloatArray, found: FloatArray) -> None:
    for c in range(lag.size):
        if lag[c] <= 0.0:
            continue
        found[0, c, 1] = 0.0
        for i in range(1, time.size):
            h = time[i] - time[i - 1]
            behind = lag[c] * (out[i, c, 0] - out[i - 1, c, 0]) / h
            found[i, c, 0] = out[i, c, 0] - behind + math.exp(-h / lag[c]) * (
                found[i - 1, c, 0] - out[i - 1, c, 0] + behind)
            found[i, c, 1] = (out[i, c, 0] - found[i, c, 0]) / lag[c]


@compiled
def _read_at(time: FloatArray, out: FloatArray, wanted: FloatArray, late: FloatArray,
             found: FloatArray) -> None:
    last = time.size - 1
    for c in range(late.size):
        i = 0
        for j in range(wanted.size):
            t = wanted[j] - late[c]
            if t <= time[0]:
                found[j, c] = out[0, c, 0]
                continue
            if t >= time[last]:
                found[j, c] = out[last, c, 0] + (t - time[last]) * out[last, c, 1]
                continue
            while time[i + 1] < t:
                i += 1
            while time[i] > t:
                i -= 1
            # the cubic with these values and slopes at both ends (Hermite)
            h = time[i + 1] - time[i]
            s = (t - time[i]) / h
            r = 1.0 - s
            found[j, c] = (
                r * r * ((1.0 + 2.0 * s) * out[i, c, 0] + s * h * out[i, c, 1])
                + s * s * ((1.0 + 2.0 * r) * out[i + 1, c, 0] - r * h * out[i + 1, c, 1]))
