# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a drive is as far from the course of its twin as in its quiet record, by blocks."""

from collections import deque
from dataclasses import dataclass, field
import math

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.readings import SIGNALS
from antenna_drive.recording.recording import unit_of
from antenna_drive.twin.baseline import (
    Baseline, BLOCK_S, block_scores, DRIFT_S, ENCODER, interpolated, motion_of, regressors,
    residual_of, SCORES, shift_of, SignalBlock, TWO_SIDED, WashOut,
)
from antenna_drive.twin.cusum import Charts, limit_of_rate
import numpy as np
from simgap.logs.channel import NANOSECONDS

# A block is judged once the twin is this far beyond its end: the greatest lag, and the slopes
# at its edge [s].
BEHIND_S = 0.35
# Blocks at the edges of which slopes are taken, in rows of the course.
_MARGIN = 3

# Times [s] and values of samples, by signal.
Pending = dict[str, tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class Gap:
    """What parts a signal from its twin."""

    # of the signal
    name: str
    unit: str
    since_ns: int  # stamp at which the change began, as the chart tells it [ns]
    score: str  # what shows it most, one of SCORES
    sigma: float  # mean of that score since then, in deviations of the quiet record
    # of what the residual has beyond the healthy, since then and in the quiet record
    rms: float
    usual: float

    def __str__(self) -> str:
        """Return a line for people."""
        return (f'{self.name}: {self.rms:.3g} {self.unit} instead of {self.usual:.3g} '
                f'{self.unit}, {self.score} {self.sigma:+.1f} sigma')


@dataclass
class Course:
    """The twin's course on an even grid, with the encoder behind its high-pass."""

    time: FloatArray = field(default_factory=lambda: np.zeros(0))
    raw: FloatArray = field(default_factory=lambda: np.zeros((0, len(SIGNALS))))
    washed: FloatArray = field(default_factory=lambda: np.zeros((0, len(SIGNALS))))
    command: FloatArray = field(default_factory=lambda: np.zeros(0))
    wash_out: WashOut = field(default_factory=WashOut)

    def add(self, time: FloatArray, raw: FloatArray, command: FloatArray, step_s: float) -> None:
        """Take rows of the grid: time [s], the channels, and the command."""
        washed = raw.copy()
        washed[:, ENCODER] = self.wash_out(raw[:, ENCODER], step_s)
        self.time = np.append(self.time, time)
        self.raw = np.concatenate([self.raw, raw])
        self.washed = np.concatenate([self.washed, washed])
        self.command = np.append(self.command, command)

    def drop_before(self, time: float) -> None:
        """Forget the rows before a time [s]."""
        first = int(np.searchsorted(self.time, time))
        self.time, self.command = self.time[first:], self.command[first:]
        self.raw, self.washed = self.raw[first:], self.washed[first:]


class BlockJudge:
    """
    Judges the blocks of a twin by its quiet record.

    baseline : what the quiet record shows; None before it was learned
    gap : whether the charts have found a gap that is not closed
    missing : signals without samples in the last block, and since when [s]
    blocks, unjudged : how many blocks there were, and how many of them with motion beyond that of
        the quiet record
    """

    def __init__(self, alarms_per_day: float, reference: float, clip: float) -> None:
        """Begin without a quiet record; see `TwinSettings`."""
        self._alarms_per_day, self._reference, self._clip = alarms_per_day, reference, clip
        self.baseline: Baseline | None = None
        self.blocks = self.unjudged = 0
        # by how much the clock of the readings has come ahead of the command's since the quiet
        # record [s], and how well that is known [1/s^2]
        self._ahead = self._known = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin a stretch: the twin stands still until its first command."""
        self._wash = {name: WashOut() for name in SIGNALS}
        self.gap = False
        self._sizes: deque[tuple[int, dict[str, float]]] = deque(maxlen=600)
        self.missing: dict[str, float] = {}
        if self.baseline is not None:
            self._charts.restart()

    def use(self, baseline: Baseline) -> None:
        """Compare with a quiet record from now on."""
        self.baseline = baseline
        self._chart_names = [(name, score) for name in baseline.signals for score in SCORES]
        two_sided = np.tile(TWO_SIDED, len(baseline.signals))
        reference = self._reference + np.concatenate(
            [item.allowance for item in baseline.signals.values()] or [np.zeros(0)])
        limit = limit_of_rate(self._reference, self._alarms_per_day,
                              int(two_sided.size + two_sided.sum()), BLOCK_S)
        self._charts = Charts(two_sided, reference, limit, self._clip)

    @property
    def late_s(self) -> float:
        """Return by how much readings are later than in the quiet record, 0 if not at all [s]."""
        return max(-self._ahead, 0.0)

    def lag(self, name: str) -> float:
        """Return by how much a reading is late now [s]; 0 for one that is not watched."""
        watched = self.baseline is not None and self.baseline.signals.get(name)
        return watched.lag - self._ahead if watched else 0.0

    def residual(self, name: str, pending: Pending, end: float, time: FloatArray,
                 raw: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Take the samples before a time; return the twin's times of them, and residuals."""
        times, values = pending[name]
        of_twin = times - self.lag(name)
        mine = of_twin < end
        pending[name] = times[~mine], values[~mine]
        times, values = of_twin[mine], values[mine]
        if not times.size:
            return times, values
        column = SIGNALS.index(name)
        return times, residual_of(column, values, interpolated(times, time, raw)[:, column],
                                  times, self._wash[name])

    def _drift(self, shift: float, weight: float) -> float:
        """Take the shift of a block; return what of it lies within a sample of the command."""
        assert self.baseline is not None
        own = min(max(shift, -self.baseline.spacing), self.baseline.spacing)
        self._known = math.exp(-BLOCK_S / DRIFT_S) * self._known + weight
        if self._known > 0.0:
            self._ahead += own * weight / self._known
        return own

    def judge(self, number: int, course: Course, pending: Pending, run_in: float) -> None:
        """
        Judge a block.

        number : of the block, from the start on
        course : of the twin, beyond the block's end by `BEHIND_S`
        pending : the samples that were not judged yet, by signal; those of the block are taken out
        run_in : blocks that begin before this are not judged [s]
        """
        assert self.baseline is not None
        begin, end = number * BLOCK_S, (number + 1) * BLOCK_S
        first, last = np.searchsorted(course.time, [begin - BEHIND_S, end + BEHIND_S])
        part = slice(max(first - _MARGIN, 0), last + _MARGIN)
        time = course.time[part]
        table = regressors(time, course.washed[part])
        own = (time >= begin) & (time < end)
        judged = self.baseline.judged(motion_of(time[own], course.command[part][own]))
        signals = self.baseline.signals
        there = {}
        for name, item in signals.items():
            times, residual = self.residual(name, pending, end, time, course.raw[part])
            if times.size:
                self.missing.pop(name, None)
                there[name] = SignalBlock(SIGNALS.index(name), residual,
                                          interpolated(times, time, table))
            else:
                self.missing.setdefault(name, begin)
        shift = self._drift(*shift_of([(signals[name], measured)
                                       for name, measured in there.items()])) if there else 0.0
        z, sizes = [], {}
        for name, item in signals.items():
            if name not in there:
                z.append(np.full(len(SCORES), np.nan))
                continue
            found, left = block_scores(item, there[name].shifted(shift))
            sizes[name] = float(np.sqrt(np.mean(left**2)))
            # in deviations of the quiet record, NaN where a score says nothing
            z.append((found - item.mean) / np.where(item.deviation > 0.0, item.deviation, np.nan))
        if begin < run_in:
            return
        self.blocks += 1
        self._sizes.append((number, sizes))
        if not judged:
            self.unjudged += 1
            return
        self._charts.add(np.concatenate(z), number)
        if self._charts.alarmed.any():
            self.gap = True
        elif self._charts.calm:
            self.gap = False

    def gaps(self, start_ns: int) -> list[Gap]:
        """Return which signals are apart from the twin, the greatest first; block 0 began then."""
        if self.baseline is None or not self.gap:
            return []
        found: dict[str, Gap] = {}
        for chart in np.flatnonzero(self._charts.alarmed):
            name, score = self._chart_names[chart]
            sigma, began = self._charts.size(int(chart)), self._charts.began(int(chart))
            if name in found and abs(found[name].sigma) >= abs(sigma):
                continue
            since = start_ns + int(began * BLOCK_S * NANOSECONDS)
            sizes = [own[name] for number, own in self._sizes if number >= began and name in own]
            found[name] = Gap(name, unit_of(name) or '1', since, score, sigma,
                              math.sqrt(sum(s * s for s in sizes) / max(len(sizes), 1)),
                              self.baseline.signals[name].sigma)
        return sorted(found.values(), key=lambda gap: -abs(gap.sigma))
