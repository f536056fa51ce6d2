# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
What a test did to the drive, from the test sheet or, failing that, from the recorded command.

A sheet's waveform is exact: its jumps are known to the microsecond. A recorded command is a set
of samples. Between two that differ by more than their neighbours do, a jump is assumed, and where
a motion is cut off: where the regular times of many jumps put it, or else halfway. It may come
anywhere between the two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
import math
from typing import Any, Protocol

from antenna_drive.diagnosis import FloatArray
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import record_of
from antenna_drive.physics import signal_generator
from antenna_drive.recording import sheet as sheets
from antenna_drive.recording.sheet_signal import test_signal_of
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.optimize import linprog

# Places within a step at which the command is read; jumps may be at its ends.
_PLACES = np.array([0.1, 0.5, 0.9])
_NO_BITS = np.ones(1)   # no test sheet has a pseudo-random sequence
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
# Two sides of a jump, or a jump and a sample, are at least this far apart [s].
_APART_S = 1e-9
# An interval between samples longer than this many usual ones lacks rows.
_LACKS_ROWS = 1.5
# ... and its command is not told by those around it if they part by this share of its range.
_UNCERTAIN = 0.01
# A command that keeps its value for so many samples stands still. A motion that ends there jumps
# if it, taken on, comes no nearer than this share of the range.
_STILL, _NEAR = 4, 0.05
_PARABOLA = np.linalg.inv(np.vander(_PLACES, 3, increasing=True))


class CommandedRate(Protocol):
    """An axis rate command over time."""

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the rate command [rad/s] at these times [s]."""

    def knots(self, end: float) -> FloatArray:
        """Return the times up to `end` at which the command or its slope jumps [s]."""


@dataclass(frozen=True)
class SheetCommand:
    """The waveform of a test sheet, as the drive's own test signal plays it."""

    waveform: sheets.Waveform

    @cached_property
    def _record(self) -> Any:
        return record_of(test_signal_of(self.waveform))[0]

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the rate command [rad/s] at these times [s]."""
        command = np.empty(time.size)
        signal_generator.values(time, self._record, _NO_BITS, command)
        return command

    def knots(self, end: float) -> FloatArray:
        """Return the times up to `end` at which the command or its slope jumps [s]."""
        w = self.waveform
        if isinstance(w, (sheets.Square, sheets.Triangle)):
            period, phase = w.period_s or 1.0, w.phase or 0.0
            first = 0.0 if isinstance(w, sheets.Square) else 0.25
            cycles = np.arange(np.floor(phase) - 1.0, end / period + phase + 1.0, 0.5) + first
            times = (cycles - phase) * period
            return times[(times > 0.0) & (times < end)]
        if isinstance(w, sheets.Knots):
            times = np.unique(w.times_s or ())
            return times[(times > 0.0) & (times < end)]
        edges = [w.start_s or 0.0]
        if isinstance(w, sheets.Chirp):
            edges.append(edges[0] + (w.duration_s or 0.0))
        return np.array([edge for edge in edges if 0.0 < edge < end])


@dataclass(frozen=True)
class RecordedCommand:
    """
    A command that is known from its samples: cubic between jumps, straight beside corners.

    Attributes
    ----------
    time, value : of the samples, and of both sides of each jump, shape (n,) [s], [rad/s]
    slope : at the two ends of each interval between them, shape (n - 1, 2) [rad/s^2]
    jumps : times at which the command jumps, shape (k,) [s]
    slack : by how much each jump may come earlier (negative) and later, shape (k, 2) [s]: up to
        the samples on its two sides
    holes : begin and end of each interval whose rows are missing and not told by those around
        it, shape (h, 2) [s]
    uncertainty : by how much the command may be off in the middle of each hole, shape (h,) [rad/s]

    """

    time: FloatArray
    value: FloatArray
    slope: FloatArray
    jumps: FloatArray
    slack: FloatArray
    holes: FloatArray
    uncertainty: FloatArray

    @classmethod
    def of(cls, time: FloatArray, value: FloatArray) -> RecordedCommand:
        """Take the samples of a command, shape (n,), and find its jumps."""
        change, uncertainty = np.abs(np.diff(value)), _uncertainty(time, value)
        usual = np.median(change) + 1e-12
        around = np.maximum(np.r_[change[1:], 0.0], np.r_[0.0, change[:-1]])
        large = (change > 0.05 * np.ptp(value)) & (change > 20.0 * usual) & (change > 4.0 * around)
        # straight lines go on where rows are missing, and curves turn in it
        uncertain = uncertainty > _UNCERTAIN * np.ptp(value)
        large &= np.isnan(uncertainty) | (uncertain & _level(time, value))
        # parabolas up to the jump that ends a motion, and from the one that begins it
        ends, begins = _cut_off(time, value), _cut_off(-time[::-1], value[::-1])[::-1]
        ends[~np.isnan(uncertainty)] = begins[~np.isnan(uncertainty)] = 0.0
        # a slope that was found backwards has the other sign, its change has not
        (before, curve), (behind, curve_behind) = ends.T, begins.T * [[-1.0], [1.0]]
        cut = ends.any(axis=1) | begins.any(axis=1)
        large |= cut
        k = np.flatnonzero(large)
        jumps, _ = regular_times(time[k], time[k + 1])
        slack = np.column_stack([np.minimum(time[k] - jumps + _APART_S, 0.0),
                                 np.maximum(time[k + 1] - jumps - _APART_S, 0.0)])
        # two extra samples at each jump keep the lines on their own sides
        times = np.r_[time, jumps - _APART_S, jumps + _APART_S]
        since, until = jumps - time[k], jumps - time[k + 1]
        values = np.r_[value, value[k] + (before[k] + 0.5 * curve[k] * since) * since,
                       value[k + 1] + (behind[k] + 0.5 * curve_behind[k] * until) * until]
        order = np.argsort(times, kind='stable')
        slopes = np.tile((np.diff(value) / np.diff(time))[:, np.newaxis], 2)
        smooth = _smooth(time, value)
        # the curve beside such a jump is no corner
        smooth[:-1] |= before[1:] != 0.0
        smooth[1:] |= behind[:-1] != 0.0
        gradient = np.gradient(value, time)
        gradient[:-1][cut], gradient[1:][cut] = before[cut], behind[cut]
        slopes[smooth] = np.stack([gradient[:-1], gradient[1:]], axis=1)[smooth]
        # the three pieces of an interval with a jump: the middle one is the jump
        pieces = np.insert(
            np.where(large[:, np.newaxis], 0.0, slopes), np.repeat(k, 2), 0.0, axis=0)
        first = k + 2 * np.arange(k.size)
        pieces[first] = np.column_stack([before[k], before[k] + curve[k] * since])
        pieces[first + 2] = np.column_stack([behind[k] + curve_behind[k] * until, behind[k]])
        open_ = uncertain.copy()
        open_[k] = False
        open_[_corners(time, value)[0]] = False
        h = np.flatnonzero(open_)
        return cls(times[order], values[order], pieces, jumps, slack,
                   np.column_stack([time[h], time[h + 1]]),
                   uncertainty[h])._with_corners(time, value)

    def _with_corners(self, time: FloatArray, value: FloatArray) -> RecordedCommand:
        """Return the command with a corner wherever straight lines meet between two samples."""
        k, at, before, after = _corners(time, value)
        piece = np.searchsorted(self.time, time[k], side='right') - 1
        slope = self.slope.copy()
        slope[piece] = before[:, np.newaxis]
        return replace(
            self, time=np.insert(self.time, piece + 1, at),
            value=np.insert(self.value, piece + 1, value[k] + before * (at - time[k])),
            slope=np.insert(slope, piece + 1, np.stack([after, after], axis=1), axis=0))

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


def _cut_off(time: FloatArray, value: FloatArray) -> FloatArray:
    """
    Return how a motion goes on that jumps to where the command stands still, shape (n - 1, 2).

    First and second derivative at the beginning of the interval in which it jumps [rad/s^2],
    [rad/s^3]; 0 for all other intervals. A motion that comes to rest by itself reaches that value
    between the last sample that moves and the first that does not.
    """
    found = np.zeros((time.size - 1, 2))
    still = np.diff(value) == 0.0
    ends = ~still
    for n in range(1, _STILL):
        ends[-n:] = False
        ends[:-n] &= still[n:]
    for k in np.flatnonzero(ends[2:] & ~still[1:-1] & ~still[:-2]) + 2:
        line, parabola = (_through(time[k - n:k + 1], value[k - n:k + 1]) for n in (1, 2))
        places = np.linspace(time[k], time[k + 1], 9)
        above = np.r_[line(places), parabola(places)] - value[k + 1]
        if max(above.min(), -above.max()) > _NEAR * np.ptp(value):
            found[k] = [parabola.deriv(n)(time[k]) for n in (1, 2)]
    return found


def _uncertainty(time: FloatArray, value: FloatArray) -> FloatArray:
    """
    Return by how much the two sides of each interval part in its middle, shape (n - 1,).

    Each side is taken on as a line and as a parabola. It is NaN where no rows are missing.
    """
    width = np.diff(time)
    uncertainty = np.full(width.size, np.nan)
    for i in np.flatnonzero(width > _LACKS_ROWS * np.median(width)):
        middle = 0.5 * (time[i] + time[i + 1])
        apart = (abs(_through(time[i - n:i + 1], value[i - n:i + 1])(middle)
                     - _through(time[i + 1:i + 2 + n], value[i + 1:i + 2 + n])(middle))
                 for n in (1, 2) if n <= i < width.size - n)
        uncertainty[i] = min(apart, default=0.0)
    return uncertainty


def _through(time: FloatArray, value: FloatArray) -> Polynomial:
    """Return the polynomial through a few samples."""
    return Polynomial.fit(time, value, time.size - 1)


def _level(time: FloatArray, value: FloatArray) -> NDArray[np.bool_]:
    """Return which intervals have straight lines on both sides, shape (n - 1,)."""
    slope = np.diff(value) / np.diff(time)
    bend = np.abs(np.diff(slope, prepend=slope[:1]))
    # between the two intervals before, and between the two behind
    before, behind = np.r_[0.0, bend[:-1]], np.r_[bend[2:], 0.0, 0.0]
    return np.asarray(np.maximum(before, behind) * np.diff(time)
                      < _STRAIGHT * np.abs(np.diff(value)))


def _smooth(time: FloatArray, value: FloatArray) -> NDArray[np.bool_]:
    """Return which intervals between samples are beside no jump and no corner, shape (n - 1,)."""
    slope = np.diff(value) / np.diff(time)
    bend = np.abs(np.r_[0.0, np.diff(slope), 0.0])
    # a bend that stands alone is a corner: the samples two further on know nothing of it
    padded = np.pad(bend, 2)
    corner = bend > _CORNER * np.maximum(padded[:-4], padded[4:])
    return ~(corner[1:] | corner[:-1])


def _corners(time: FloatArray, value: FloatArray,
             ) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
    """
    Return where two straight lines meet between two samples.

    Returns
    -------
    the number of the sample before each corner, the time of the corner [s], and the slopes before
    and after it, shape (m,) each

    """
    slope = np.diff(value) / np.diff(time)
    k = np.arange(2, slope.size - 2)
    before, after = slope[k - 1], slope[k + 1]
    bend = np.abs(after - before)
    straight = np.maximum(np.abs(before - slope[k - 2]), np.abs(slope[k + 2] - after))
    width = time[k + 1] - time[k]
    with np.errstate(divide='ignore', invalid='ignore'):
        share = (slope[k] - after) / (before - after)
    # a corner on a sample is known as it is
    found = ((straight < _STRAIGHT * bend)
             & (share > _ON_A_SAMPLE) & (share < 1.0 - _ON_A_SAMPLE))
    return k[found], (time[k] + share * width)[found], before[found], after[found]


def regular_times(after: FloatArray, before: FloatArray,
                  ) -> tuple[FloatArray, NDArray[np.bool_]]:
    """
    Return times that lie in intervals: those of a regular sequence, if there is one in all.

    A computer jumps at regular times, which many intervals tell more precisely than each its own.

    Parameters
    ----------
    after, before
        ends of the intervals, shape (n,) [s]

    Returns
    -------
    the times, and which of them belong to a regular sequence, shape (n,) each

    """
    found, regular = 0.5 * (after + before), np.zeros(after.size, dtype=bool)
    # the first jump begins the motion, and may belong to no sequence
    sequences = [(first, cycle, np.arange(after.size - first) // cycle)
                 for first, cycle in product((0, 1), _CYCLES)
                 if after.size - first >= _FEWEST_CYCLES * cycle]
    sequences += [(first, 1, number) for first in (0, 1)
                  if (number := _on_a_grid(after[first:], before[first:])) is not None]
    for first, cycle, number in sequences:
        fit = _periodic(after[first:], before[first:], cycle, number)
        if fit is not None:
            found[first:], regular[first:] = fit, True
            break
    return found, regular


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
    place = np.arange(after.size)
    # unknown: time of each jump of the first cycle, period, margin to the ends
    lines = np.zeros((after.size, cycle + 2))
    lines[place, place % cycle] = 1.0
    lines[:, cycle] = number
    lines[:, cycle + 1] = 1.0
    other_end = lines.copy()
    other_end[:, :-1] *= -1.0
    start = after[0]
    fit = linprog(np.r_[np.zeros(cycle + 1), -1.0], np.vstack([lines, other_end]),
                  np.r_[before - start, start - after], bounds=(None, None))
    if fit.status != 0 or fit.x[-1] <= 0.0:
        return None
    return np.asarray(start + lines[:, :-1] @ fit.x[:-1])


@dataclass(frozen=True)
class Bias:
    """A source of bias voltage: `before` until `at` [s], `after` from then on [V]."""

    before: float = 0.0
    after: float = 0.0
    at: float = 0.0

    def later(self, begin: float) -> Bias:
        """Return the source in a time that counts from `begin` [s]."""
        return replace(self, at=self.at - begin)


@dataclass(frozen=True)
class Longest:
    """
    How long a step of the integration may be.

    Attributes
    ----------
    usual : at most so long [s]
    shortest : even where a wave asks for less [s]
    wave : angle by which a wave may turn in a step [rad]
    cycles : of the fastest wave per turn of the axis, 0 for none

    """

    usual: float
    shortest: float = 0.0
    wave: float = math.inf
    cycles: float = 0.0

    def at(self, rate: FloatArray) -> FloatArray:
        """Return the longest step where the axis turns at these rates [rad/s], as an array."""
        asked = self.wave / np.maximum(self.cycles * np.abs(rate), 1e-9)
        return np.asarray(np.minimum(self.usual, np.maximum(self.shortest, asked)))


def schedule(command: CommandedRate, bias: Bias, samples: FloatArray, longest: Longest,
             delay: float = 0.0) -> batch.Schedule:
    """
    Plan the integration of a test: no step reaches across a sample, a jump, or `longest`.

    Parameters
    ----------
    command, bias
        what the test does
    samples
        when the sensors are read, increasing, none before zero, shape (n,) [s]
    longest
        step, where the axis turns as commanded
    delay
        by which the command comes late [s]

    """
    end = float(samples[-1])
    jumps = command.knots(end) + delay
    if delay > 0.0:
        jumps = np.r_[delay, jumps]
    if 0.0 < bias.at < end:
        jumps = np.r_[jumps, bias.at]
    jumps = jumps[(jumps > 0.0) & (jumps < end)]
    knots = np.unique(np.r_[0.0, samples, jumps])
    # a jump on a sample needs no step of its own
    keep = np.r_[True, np.diff(knots) > 1e-9]
    knots = knots[keep]
    rate = command(0.5 * (knots[:-1] + knots[1:]) - delay)
    pieces = np.maximum(np.ceil(np.diff(knots) / longest.at(rate) - 1e-6).astype(int), 1)
    first = np.repeat(knots[:-1], pieces)
    length = np.repeat(np.diff(knots) / pieces, pieces)
    number = np.arange(first.size) - np.repeat(np.r_[0, np.cumsum(pieces)[:-1]], pieces)
    start = first + number * length
    steps = np.zeros((start.size, batch.COLUMNS))
    steps[:, batch.LENGTH] = length
    places = start[:, np.newaxis] + _PLACES * length[:, np.newaxis]
    shape = command(places.ravel() - delay).reshape(places.shape) @ _PARABOLA.T
    steps[:, batch.COMMAND] = shape[:, 0]
    steps[:, batch.SLOPE] = shape[:, 1] / length
    steps[:, batch.CURVE] = shape[:, 2] / length ** 2
    rows = np.full(start.size + 1, -1)
    ends = np.r_[0.0, np.cumsum(length)]
    at = np.searchsorted(ends, samples - 1e-8)
    rows[np.minimum(at, start.size)] = np.arange(samples.size)
    return with_bias(batch.Schedule(steps, rows), bias)


def with_bias(plan: batch.Schedule, bias: Bias) -> batch.Schedule:
    """Return a plan with other voltages of the bias source, which steps at the same time."""
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    middle = np.cumsum(length) - 0.5 * length
    steps[:, batch.FIXED_BIAS] = np.where(middle < bias.at, bias.before, bias.after)
    return batch.Schedule(steps, plan.keep)


def with_torque(plan: batch.Schedule, time: FloatArray, torque: FloatArray) -> batch.Schedule:
    """Return a plan with a torque on the axis: times [s], values [N m], straight lines between."""
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    ends = np.cumsum(length)
    left = np.interp(ends - length, time, torque)
    steps[:, batch.TORQUE] = left
    steps[:, batch.TORQUE_SLOPE] = (np.interp(ends, time, torque) - left) / length
    return batch.Schedule(steps, plan.keep)
