# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A rate command that is known from its samples.

Each of its jumps may come anywhere between two samples, see `command_samples`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from antenna_drive.diagnosis.command_samples import CommandSamples
import numpy as np
from simgap.machine.contract import FloatArray

# Two sides of a jump, or a jump and a sample, are at least this far apart [s].
_APART_S = 1e-9


@dataclass(frozen=True)
class RecordedCommand:
    """A command that is known from its samples: cubic between jumps, straight beside corners."""

    time: FloatArray  # of the samples, and of both sides of each jump, shape (n,) [s]
    value: FloatArray  # at these times, shape (n,) [rad/s]
    slope: FloatArray  # at both ends of each interval between them, shape (n - 1, 2) [rad/s^2]
    jumps: FloatArray  # times at which the command jumps, shape (k,) [s]
    # by how much each jump may come earlier (negative) and later, shape (k, 2) [s]: up to the
    # samples on its two sides
    slack: FloatArray
    # begin and end of each interval whose rows are missing and not told by those around it, shape
    # (h, 2) [s], and by how much the command may be off in the middle of each, shape (h,) [rad/s]
    holes: FloatArray
    uncertainty: FloatArray

    @classmethod
    def of(cls, time: FloatArray, value: FloatArray) -> RecordedCommand:
        """Take the samples of a command, shape (n,) [s], [rad/s]."""
        samples = CommandSamples(time, value)
        found, holes = samples.jumps, samples.holes
        k, jumps = found.interval, found.time
        slack = np.column_stack([np.minimum(time[k] - jumps + _APART_S, 0.0),
                                 np.maximum(time[k + 1] - jumps - _APART_S, 0.0)])
        # two more samples at each jump: the curves on both sides go on to it
        rise_left, slope_left = _taken_on(found.left, jumps - time[k])
        rise_right, slope_right = _taken_on(found.right, jumps - time[k + 1])
        times = np.r_[time, jumps - _APART_S, jumps + _APART_S]
        values = np.r_[value, value[k] + rise_left, value[k + 1] + rise_right]
        order = np.argsort(times, kind='stable')
        # three pieces in the place of an interval with a jump: the middle one is the jump
        slope = np.insert(samples.slopes, np.repeat(k, 2), 0.0, axis=0)
        first = k + 2 * np.arange(k.size)
        slope[first] = np.column_stack([found.left[:, 0], slope_left])
        slope[first + 2] = np.column_stack([slope_right, found.right[:, 0]])
        return cls(times[order], values[order], slope, jumps, slack,
                   np.column_stack([time[holes], time[holes + 1]]),
                   samples.uncertainty[holes])._with_corners(samples)

    def _with_corners(self, samples: CommandSamples) -> RecordedCommand:
        """Return the command with a corner wherever straight lines meet between two samples."""
        sample, time, before, after = samples.corners
        begin, value = samples.time[sample], samples.value[sample]
        piece = np.searchsorted(self.time, begin, side='right') - 1
        slope = self.slope.copy()
        slope[piece] = before[:, np.newaxis]
        return replace(
            self, time=np.insert(self.time, piece + 1, time),
            value=np.insert(self.value, piece + 1, value + before * (time - begin)),
            slope=np.insert(slope, piece + 1, np.tile(after[:, np.newaxis], 2), axis=0))

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the rate command [rad/s] at these times [s]."""
        i = np.clip(np.searchsorted(self.time, time, side='right') - 1, 0, self.time.size - 2)
        width = self.time[i + 1] - self.time[i]
        s = np.clip((time - self.time[i]) / width, 0.0, 1.0)
        rise = self.value[i + 1] - self.value[i]
        first, last = (width * self.slope[i, end] - rise for end in (0, 1))
        shape = self.value[i] + s * rise + s * (1.0 - s) * ((1.0 - s) * first - s * last)
        return np.asarray(np.where(time < self.time[0], 0.0, shape))

    def knots(self, end: float) -> FloatArray:
        """Return the times up to `end` at which the command jumps [s]."""
        return self.jumps[self.jumps < end]

    def part(self, begin: float, end: float) -> RecordedCommand:
        """Return the command between two times [s], in a time that counts from the first."""
        # one sample beyond either end keeps the lines to it
        first = max(int(np.searchsorted(self.time, begin, side='right')) - 1, 0)
        last = int(np.searchsorted(self.time, end)) + 1
        inside = (self.jumps > begin) & (self.jumps < end)
        felt = (self.holes[:, 0] > begin) & (self.holes[:, 1] < end)
        return RecordedCommand(self.time[first:last] - begin, self.value[first:last],
                               self.slope[first:last - 1], self.jumps[inside] - begin,
                               self.slack[inside], self.holes[felt] - begin,
                               self.uncertainty[felt])

    def with_jump(self, number: int, later: float) -> RecordedCommand:
        """Return the command with one of its jumps later [s], within its slack."""
        time, value, slope = self.time.copy(), self.value.copy(), self.slope.copy()
        jumps = self.jumps.copy()
        right = int(np.searchsorted(time, jumps[number]))
        # the two sides of the jump: each parabola goes on to it
        for side, piece, end in ((right - 1, right - 2, 1), (right, right, 0)):
            curve = (slope[piece, 1] - slope[piece, 0]) / (time[piece + 1] - time[piece])
            value[side] += (slope[piece, end] + 0.5 * curve * later) * later
            slope[piece, end] += curve * later
        time[right - 1:right + 1] += later
        jumps[number] += later
        return replace(self, time=time, value=value, slope=slope, jumps=jumps)

    def with_mean(self, number: int, more: float) -> RecordedCommand:
        """Return the command with another mean in one of its holes, by so much [rad/s]."""
        begin, end = self.holes[number]
        piece = int(np.searchsorted(self.time, 0.5 * (begin + end))) - 1
        slope = self.slope.copy()
        # a cubic that begins and ends as before: its mean is a twelfth of the slopes' difference
        slope[piece] += 6.0 * more / (end - begin) * np.array([1.0, -1.0])
        return replace(self, slope=slope)


def _taken_on(derivatives: FloatArray, later: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return by how much parabolas rise within some time, and their slopes after it, shape (k,) each.

    derivatives : first and second, where the time begins, shape (k, 2)
    later : the time [s], shape (k,)
    """
    slope, curve = derivatives.T
    return (slope + 0.5 * curve * later) * later, slope + curve * later
