# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A rate command that is known from its samples: where it jumps, has a corner, or is not known.

A jump is assumed between two samples that differ by more than their neighbours do, and where a
motion is cut off. It is at the time of a regular sequence of jumps if there is one, or else
halfway between the samples; it may come anywhere between the two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.optimize import linprog
from simgap.machine.contract import FloatArray

# A command jumps between two samples if it changes by more than this share of its range, and so
# many times more than in most intervals and than in the two beside it.
_OF_RANGE, _OF_USUAL, _OF_NEIGHBOURS = 0.05, 20.0, 4.0
# A sample is a corner of a command if it bends there by this many times more than beside it.
_CORNER = 4.0
# Lines are straight if they bend by at most this share of the corner between them. A corner is on
# a sample if it is this near to it, as a share of the interval.
_STRAIGHT, _ON_A_SAMPLE = 0.05, 0.01
# Regular jumps repeat after one, two or four of them, at least this many times.
_CYCLES, _FEWEST_CYCLES = (1, 2, 4), 4
# Jumps that leave out some times of a grid: at least this many, in intervals so many times shorter
# than the grid's that no chance puts them there.
_FEWEST_ON_A_GRID, _GRID_OVER_INTERVAL = 6, 8.0
# An interval between samples longer than this many usual ones lacks rows.
_LACKS_ROWS = 1.5
# ... and its command is not told by those around it if they part by this share of its range.
_UNCERTAIN = 0.01
# A command that keeps its value for so many samples stands still. A motion that ends there jumps
# if it, taken on, comes no nearer than this share of the range.
_STILL, _NEAR = 4, 0.05
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
        (k, jumps, left, right), holes = samples.jumps, samples.holes
        slack = np.column_stack([np.minimum(time[k] - jumps + _APART_S, 0.0),
                                 np.maximum(time[k + 1] - jumps - _APART_S, 0.0)])
        # two more samples at each jump: the curves on both sides go on to it
        rise_left, slope_left = _taken_on(left, jumps - time[k])
        rise_right, slope_right = _taken_on(right, jumps - time[k + 1])
        times = np.r_[time, jumps - _APART_S, jumps + _APART_S]
        values = np.r_[value, value[k] + rise_left, value[k + 1] + rise_right]
        order = np.argsort(times, kind='stable')
        # three pieces in the place of an interval with a jump: the middle one is the jump
        slope = np.insert(samples.slopes, np.repeat(k, 2), 0.0, axis=0)
        first = k + 2 * np.arange(k.size)
        slope[first] = np.column_stack([left[:, 0], slope_left])
        slope[first + 2] = np.column_stack([slope_right, right[:, 0]])
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


@dataclass(frozen=True)
class CommandSamples:
    """The samples of a command, and what lies in the n - 1 intervals between them."""

    time: FloatArray  # shape (n,) [s]
    value: FloatArray  # shape (n,) [rad/s]

    @cached_property
    def _slope(self) -> FloatArray:
        return np.diff(self.value) / np.diff(self.time)

    @cached_property
    def uncertainty(self) -> FloatArray:
        """
        Return by how much the two sides of each interval part in its middle [rad/s].

        Each side is taken on as a line and as a parabola. It is NaN where no rows are missing.
        """
        time, width = self.time, np.diff(self.time)
        found = np.full(width.size, np.nan)
        for i in np.flatnonzero(width > _LACKS_ROWS * np.median(width)).tolist():
            middle = 0.5 * (time[i] + time[i + 1])
            apart = (abs(self._through(i - n, i)(middle) - self._through(i + 1, i + 1 + n)(middle))
                     for n in (1, 2) if n <= i < width.size - n)
            found[i] = min(apart, default=0.0)
        return found

    def _through(self, first: int, last: int) -> Polynomial:
        """Return the polynomial through a few samples."""
        few = slice(first, last + 1)
        return Polynomial.fit(self.time[few], self.value[few], last - first)

    @property
    def _uncertain(self) -> NDArray[np.bool_]:
        """Return which intervals are not told by those around them."""
        return np.asarray(self.uncertainty > _UNCERTAIN * np.ptp(self.value))

    @cached_property
    def jumps(self) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
        """
        Return where the command jumps.

        Number of the sample before each jump and its time [s], shape (k,), first and second
        derivative at the samples before and behind it, 0 where it is level there, shape (k, 2)
        [rad/s^2], [rad/s^3].
        """
        change = np.abs(np.diff(self.value))
        usual = np.median(change) + 1e-12
        around = np.maximum(np.r_[change[1:], 0.0], np.r_[0.0, change[:-1]])
        large = ((change > _OF_RANGE * np.ptp(self.value)) & (change > _OF_USUAL * usual)
                 & (change > _OF_NEIGHBOURS * around))
        # straight lines go on where rows are missing, and curves turn in it
        lacks_rows = ~np.isnan(self.uncertainty)
        large &= ~lacks_rows | (self._uncertain & self._level)
        # parabolas up to the jump that ends a motion, and from the one that begins it; a slope
        # found backwards has the other sign, its change has not
        left = self._cut_off()
        right = CommandSamples(-self.time[::-1], self.value[::-1])._cut_off()[::-1] * [-1.0, 1.0]
        left[lacks_rows] = right[lacks_rows] = 0.0
        k = np.flatnonzero(large | left.any(axis=1) | right.any(axis=1))
        return k, regular_times(self.time[k], self.time[k + 1]), left[k], right[k]

    @property
    def _level(self) -> NDArray[np.bool_]:
        """Return which intervals have straight lines on both sides."""
        bend = np.abs(np.diff(self._slope, prepend=self._slope[:1]))
        # between the two intervals before, and between the two behind
        before, behind = np.r_[0.0, bend[:-1]], np.r_[bend[2:], 0.0, 0.0]
        return np.asarray(np.maximum(before, behind) * np.diff(self.time)
                          < _STRAIGHT * np.abs(np.diff(self.value)))

    def _cut_off(self) -> FloatArray:
        """
        Return how a motion goes on that jumps to where the command stands still, shape (n - 1, 2).

        First and second derivative at the beginning of the interval in which it jumps [rad/s^2],
        [rad/s^3]; 0 for all other intervals. A motion that comes to rest by itself reaches that
        value between the last sample that moves and the first that does not.
        """
        time, value = self.time, self.value
        found = np.zeros((time.size - 1, 2))
        still = np.diff(value) == 0.0
        ends = ~still
        for n in range(1, _STILL):
            ends[-n:] = False
            ends[:-n] &= still[n:]
        for k in (np.flatnonzero(ends[2:] & ~still[1:-1] & ~still[:-2]) + 2).tolist():
            line, parabola = (self._through(k - n, k) for n in (1, 2))
            places = np.linspace(time[k], time[k + 1], 9)
            above = np.r_[line(places), parabola(places)] - value[k + 1]
            if max(above.min(), -above.max()) > _NEAR * np.ptp(value):
                found[k] = [parabola.deriv(n)(time[k]) for n in (1, 2)]
        return found

    @property
    def holes(self) -> NDArray[np.int64]:
        """
        Return the intervals whose rows are missing and not told by those around them, shape (h,).

        An interval with a jump or a corner is none of them.
        """
        found = self._uncertain
        found[self.jumps[0]] = False
        found[self.corners[0]] = False
        return np.flatnonzero(found)

    @cached_property
    def corners(self) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
        """
        Return where two straight lines meet between two samples.

        Number of the sample before each corner, its time [s], and the slopes before and behind it
        [rad/s^2], shape (m,) each.
        """
        time, slope = self.time, self._slope
        k = np.arange(2, slope.size - 2)
        before, after = slope[k - 1], slope[k + 1]
        bend = np.abs(after - before)
        straight = np.maximum(np.abs(before - slope[k - 2]), np.abs(slope[k + 2] - after))
        with np.errstate(divide='ignore', invalid='ignore'):
            share = (slope[k] - after) / (before - after)
        # a corner on a sample is known as it is
        found = ((straight < _STRAIGHT * bend)
                 & (share > _ON_A_SAMPLE) & (share < 1.0 - _ON_A_SAMPLE))
        at = time[k] + share * (time[k + 1] - time[k])
        return k[found], at[found], before[found], after[found]

    @property
    def slopes(self) -> FloatArray:
        """
        Return the slopes at both ends of each interval, shape (n - 1, 2) [rad/s^2].

        An interval beside a jump or a corner is straight. Those of a jump itself mean nothing.
        """
        k, _, left, right = self.jumps
        slopes = np.tile(self._slope[:, np.newaxis], 2)
        bend = np.abs(np.r_[0.0, np.diff(self._slope), 0.0])
        # a bend that stands alone is a corner: the samples two further on know nothing of it
        padded = np.pad(bend, 2)
        corner = bend > _CORNER * np.maximum(padded[:-4], padded[4:])
        smooth = ~(corner[1:] | corner[:-1])
        # the curve beside a motion that is cut off is no corner
        smooth[k[left[:, 0] != 0.0] - 1] = True
        smooth[k[right[:, 0] != 0.0] + 1] = True
        gradient = np.gradient(self.value, self.time)
        cut = left.any(axis=1) | right.any(axis=1)
        gradient[k[cut]], gradient[k[cut] + 1] = left[cut, 0], right[cut, 0]
        slopes[smooth] = np.stack([gradient[:-1], gradient[1:]], axis=1)[smooth]
        return slopes


def regular_times(after: FloatArray, before: FloatArray) -> FloatArray:
    """
    Return times that lie in intervals: those of a regular sequence, if there is one in all.

    A computer jumps at regular times, which many intervals tell more precisely than each its own.

    after, before : ends of the intervals, shape (n,) [s]
    """
    found = 0.5 * (after + before)
    # the first jump begins the motion, and may belong to no sequence
    sequences = [(first, cycle, np.arange(after.size - first) // cycle)
                 for first, cycle in product((0, 1), _CYCLES)
                 if after.size - first >= _FEWEST_CYCLES * cycle]
    sequences += [(first, 1, number) for first in (0, 1)
                  if (number := _on_a_grid(after[first:], before[first:])) is not None]
    for first, cycle, number in sequences:
        fit = _periodic(after[first:], before[first:], cycle, number)
        if fit is not None:
            found[first:] = fit
            break
    return found


def _on_a_grid(after: FloatArray, before: FloatArray) -> NDArray[np.int64] | None:
    """Return the numbers of jumps that leave out some times of a regular sequence, or None."""
    if after.size < _FEWEST_ON_A_GRID:
        return None
    middle = 0.5 * (after + before)
    period = float(np.diff(middle).min())
    if period < _GRID_OVER_INTERVAL * float(np.median(before - after)):
        return None
    number = np.zeros(after.size, dtype=np.int64)
    for i in range(1, after.size):
        number[i] = round((middle[i] - middle[0]) / period)
        # the farther a jump is, the better it tells the period
        period = (middle[i] - middle[0]) / number[i]
    return number


def _periodic(after: FloatArray, before: FloatArray, cycle: int, number: NDArray[np.int64],
              ) -> FloatArray | None:
    """Return the periodic sequence that keeps farthest from the ends of all intervals."""
    # unknown: time of each jump of the first cycle, period, margin to the ends
    lines = np.column_stack([np.eye(cycle)[np.arange(after.size) % cycle], number])
    margin = np.ones((after.size, 1))
    start = after[0]
    fit = linprog(np.r_[np.zeros(cycle + 1), -1.0], np.block([[lines, margin], [-lines, margin]]),
                  np.r_[before - start, start - after], bounds=(None, None))
    if fit.status != 0 or fit.x[-1] <= 0.0:
        return None
    return np.asarray(start + lines @ fit.x[:-1])
