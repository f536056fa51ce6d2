# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The twin beside a real drive: what it does, how far the two are apart, and what it says of that.

It has no clock of its own. Time is that of the samples' stamps. Only whether the real drive has
stopped is told from the time that its owner gives to `advance`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
import math

from antenna_drive.diagnosis.sheet_settings import as_the_sheet_says
from antenna_drive.diagnosis.tuned import loaded
from antenna_drive.emulator.run import Changes, MACRO_STEP
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.readings import of, RATE_COMMAND, SIGNALS, TACHOMETER
from antenna_drive.recording.recording import Recording, unit_of
from antenna_drive.recording.sheet import TestSheet
from antenna_drive.twin.baseline import (
    Baseline, BLOCK_S, block_scores, DRIFT_S, ENCODER, interpolated, motion_of, names_of_charts,
    regressors, residual_of, SCORES, shift_of, SignalBaseline, SignalBlock, standard_scores,
    TWO_SIDED, WashOut,
)
from antenna_drive.twin.cusum import Charts, limit_of_rate
from antenna_drive.twin.intake import Intake
from antenna_drive.twin.quiet_record import learn, Track
from antenna_drive.twin.shadow import Shadow
import numpy as np
from simgap.errors import UserError
from simgap.logs.channel import NANOSECONDS

WAITING, SETTLING, LEARNING = 'waiting', 'settling', 'learning'
OK, GAP, STALE, BAD_INPUT = 'ok', 'gap', 'stale input', 'bad input'
# The twin's course is kept at every macro-step that this number divides.
_EVERY = 5
# A block is judged once the twin is this far beyond its end: the greatest lag, and the slopes
# at its edge [s].
_BEHIND_S = 0.35
# Blocks at the edges of which slopes are taken, in rows of the course.
_MARGIN = 3
# Input is bad if more than this share of a signal's samples of the last blocks was rubbish.
_RUBBISH_SHARE = 0.02
_RUBBISH_BLOCKS = 10
# Motors stand still if the first readings of their tachometers are below this [rad/s]. The next
# ones may be of the motion already.
_STILL = 0.1
# Returns the text of a configuration file, as a quiet record shows the drive.
Tune = Callable[[Recording, Drive], str]


@dataclass(frozen=True)
class TwinSettings:
    """
    How a twin judges.

    Attributes
    ----------
    alarms_per_day : false alarms of a healthy drive, of all charts together
    quiet_s : length of the quiet record from which it learns what is healthy [s]
    run_in_s : after which a start at rest is forgotten; the diagnosis takes as much [s]
    again_s : the same after a jump of the time, in the middle of a motion [s]
    stale_s : without new samples for so long, the real drive has stopped [s]
    reference : k of the charts, half the shift that they find fastest, in deviations
    clip : greatest increment of a chart, in deviations
    keep_s : how much of the real drive's samples is kept [s]

    """

    alarms_per_day: float = 1.0
    quiet_s: float = 300.0
    run_in_s: float = 15.0
    again_s: float = 30.0
    stale_s: float = 2.0
    reference: float = 1.0
    clip: float = 3.2
    keep_s: float = 300.0


@dataclass(frozen=True)
class Compared:
    """Samples of one signal beside the twin; arrays of shape (n,), SI units."""

    name: str
    stamps: np.ndarray
    twin: FloatArray
    residual: FloatArray


@dataclass(frozen=True)
class Gap:
    """
    What parts a signal from its twin.

    Attributes
    ----------
    name, unit : of the signal
    since_ns : stamp at which the change began, as the chart tells it [ns]
    score : what shows it most, one of SCORES
    sigma : mean of that score since then, in deviations of the quiet record
    rms, usual : of what the residual has beyond the healthy, since then and in the quiet record

    """

    name: str
    unit: str
    since_ns: int
    score: str
    sigma: float
    rms: float
    usual: float

    def __str__(self) -> str:
        """Return a line for people."""
        return (f'{self.name}: {self.rms:.3g} {self.unit} instead of {self.usual:.3g} '
                f'{self.unit}, {self.score} {self.sigma:+.1f} sigma')


@dataclass
class _Course:
    """The twin's course on an even grid, with the encoder behind its high-pass."""

    time: FloatArray = field(default_factory=lambda: np.zeros(0))
    raw: FloatArray = field(default_factory=lambda: np.zeros((0, len(SIGNALS))))
    washed: FloatArray = field(default_factory=lambda: np.zeros((0, len(SIGNALS))))
    command: FloatArray = field(default_factory=lambda: np.zeros(0))
    wash_out: WashOut = field(default_factory=WashOut)

    def add(self, time: FloatArray, raw: FloatArray, command: FloatArray, step_s: float) -> None:
        washed = raw.copy()
        washed[:, ENCODER] = self.wash_out(raw[:, ENCODER], step_s)
        self.time = np.append(self.time, time)
        self.raw = np.concatenate([self.raw, raw])
        self.washed = np.concatenate([self.washed, washed])
        self.command = np.append(self.command, command)

    def drop_before(self, time: float) -> None:
        first = int(np.searchsorted(self.time, time))
        self.time, self.command = self.time[first:], self.command[first:]
        self.raw, self.washed = self.raw[first:], self.washed[first:]


def under_test(sheet: TestSheet, drive: Drive, step_s: float) -> tuple[Drive, Changes]:
    """
    Return a drive as a test sheet sets it, and what changes while it runs.

    Parameters
    ----------
    sheet
        of the test
    drive
        the configuration
    step_s
        macro-step [s]

    """
    drive, bias = as_the_sheet_says(sheet, drive)
    voltage = 'torque_share.circuit.fixed_voltage'
    if drive.torque_share.circuit.bias_source != 'fixed':
        return drive, {}
    changes: Changes = {} if bias.before == bias.after else {
        round(bias.at / step_s): {'torque_share': {'fixed_voltage': bias.after}}}
    return changed(drive, {voltage: bias.before}), changes


class Twin:
    """
    The twin of one drive.

    Parameters
    ----------
    drive
        the configuration
    sheet
        of the test that the real drive is in
    settings
        how to judge
    baseline
        of an earlier quiet record; None: learn one
    tune
        returns the configuration with the tolerances of a quiet record in it; None: it stays as
        it is
    step_s
        macro-step [s]

    Attributes
    ----------
    tuned : what became of the tuning, for people
    configuration : text of the tuned configuration; '' if it is as it was
    drive : the configuration in force

    """

    def __init__(self, drive: Drive, sheet: TestSheet | None = None,
                 settings: TwinSettings | None = None, baseline: Baseline | None = None,
                 tune: Tune | None = None, step_s: float = MACRO_STEP) -> None:
        """Begin with nothing known of the real drive."""
        self.settings = settings or TwinSettings()
        self.sheet = sheet or TestSheet()
        self.drive = drive
        self.intake = Intake(self.settings.keep_s)
        self._step_s, self._tune = step_s, tune
        self.tuned, self.configuration = '', ''
        self._stretch, self._run_in = 0, self.settings.run_in_s
        self._given: dict[str, int] = {}
        self._last_put: tuple[int, float] = (0, -math.inf)
        self._stale = False
        self._rubbish: deque[tuple[dict[str, int], dict[str, int]]] = deque(
            maxlen=_RUBBISH_BLOCKS)
        self.baseline: Baseline | None = None
        self.blocks = self.unjudged = 0
        # by how much the clock of the readings has come ahead of the command's since the quiet
        # record [s], and how well that is known [1/s^2]
        self._ahead = self._known = 0.0
        self._build(drive)
        if baseline is not None:
            self._use(baseline)

    def _build(self, drive: Drive) -> None:
        """Take another configuration, and begin anew."""
        self._shadow = Shadow(*under_test(self.sheet, drive, self._step_s), self._step_s)
        self._columns = [self._shadow.names.index(name) for name in SIGNALS]
        self._command = self._shadow.names.index(RATE_COMMAND)
        self._begin()

    def _begin(self) -> None:
        """Begin a stretch: the twin stands still until the first command."""
        self._shadow.restart()
        self._course = _Course()
        self._pending: dict[str, tuple[FloatArray, FloatArray]] = {
            name: (np.zeros(0), np.zeros(0)) for name in SIGNALS}
        self._next_block = 0
        self._residual_wash = {name: WashOut() for name in SIGNALS}
        self._publish_wash = WashOut()
        self._gap = False
        self._sizes: deque[tuple[int, dict[str, float]]] = deque(maxlen=600)
        self._missing: dict[str, float] = {}
        self._grid_row = 0
        if self.baseline is not None:
            self._charts.restart()

    def _use(self, baseline: Baseline) -> None:
        settings = self.settings
        self.baseline = baseline
        self._chart_names = names_of_charts(tuple(baseline.signals))
        two_sided = np.tile(TWO_SIDED, len(baseline.signals))
        reference = settings.reference + np.concatenate(
            [item.allowance for item in baseline.signals.values()] or [np.zeros(0)])
        self.limit = limit_of_rate(settings.reference, settings.alarms_per_day,
                                   int(two_sided.size + two_sided.sum()), BLOCK_S)
        self._charts = Charts(two_sided, reference, self.limit, settings.clip)

    def put(self, name: str, stamp_ns: int, value: float) -> bool:
        """Take a sample of the real drive; see `Intake.put`."""
        return self.intake.put(name, stamp_ns, value)

    def advance(self, now_s: float | None = None) -> list[Compared]:
        """
        Go on as far as the samples lead.

        Parameters
        ----------
        now_s
            time of any steady clock, by which a drive that has stopped is told; None: never [s]

        Returns
        -------
        what can be compared since the last call, signal by signal

        """
        self._watch_for_standstill(now_s)
        if self.intake.stretch != self._stretch:
            self._stretch = self.intake.stretch
            self._run_in = self.settings.again_s
            self._given = {}
            self._begin()
        found = self._go_on()
        if self._shadow.start_ns is None:
            found += self._go_on()  # the twin was tuned, and goes through the record once more
        return [item for item in map(self._fresh, found) if item is not None]

    def _fresh(self, item: Compared) -> Compared | None:
        """Return what has not been given before, of one signal."""
        new = item.stamps > self._given.get(item.name, -1)
        if not new.any():
            return None
        self._given[item.name] = int(item.stamps[-1])
        return Compared(item.name, item.stamps[new], item.twin[new], item.residual[new])

    def _go_on(self) -> list[Compared]:
        """Go on as far as the samples lead, or until the twin was tuned."""
        grid, samples = self._shadow.advance(*self.intake.new(RATE_COMMAND))
        if grid.size:
            start = self._shadow.start_ns or 0
            first = self._grid_row
            self._grid_row += grid.size
            kept = slice((-first) % _EVERY, None, _EVERY)
            values = samples[kept, :, 0]
            self._course.add((grid[kept] - start) / NANOSECONDS, values[:, self._columns],
                             values[:, self._command], _EVERY * self._step_s)
        compared = self._compare()
        self._judge()
        return compared

    def _watch_for_standstill(self, now_s: float | None) -> None:
        if now_s is None:
            return
        count = sum(self.intake.accepted.values())
        if count != self._last_put[0]:
            self._last_put = (count, now_s)
        self._stale = bool(count) and now_s - self._last_put[1] > self.settings.stale_s

    def _compare(self) -> list[Compared]:
        """Put new samples beside the twin, as far as it has come."""
        course, start = self._course, self._shadow.start_ns
        if start is None or course.time.size < 2:
            return []
        result = []
        for name in SIGNALS:
            until = start + int(course.time[-1] * NANOSECONDS)
            stamps, values = self.intake.new(name, until)
            inside = stamps >= start + int(course.time[0] * NANOSECONDS)
            stamps, values = stamps[inside], values[inside]
            if not stamps.size:
                continue
            times = (stamps - start) / NANOSECONDS
            lag = self._lag(self.baseline.signals[name]) if (
                self.baseline and name in self.baseline.signals) else 0.0
            twin = interpolated(times - lag, course.time, course.raw)[:, SIGNALS.index(name)]
            residual = values - twin
            if SIGNALS.index(name) == ENCODER:
                residual = self._publish_wash(residual, _spacing(times))
            result.append(Compared(name, stamps, twin, residual))
            old = self._pending[name]
            self._pending[name] = (np.append(old[0], times), np.append(old[1], values))
        return result

    def _judge(self) -> None:
        """Judge, or learn from, every block that is complete."""
        course = self._course
        if not course.time.size:
            return
        while course.time[-1] > (self._next_block + 1) * BLOCK_S + _BEHIND_S + max(
                -self._ahead, 0.0):
            begin = self._next_block * BLOCK_S
            self._next_block += 1
            self._rubbish.append((self._rubbish_counts(), dict(self.intake.accepted)))
            if self.baseline is not None:
                self._block(begin)
            elif begin + BLOCK_S >= self._run_in + self.settings.quiet_s:
                self._learn(begin + BLOCK_S)
                if self._course is not course:
                    return  # the twin was tuned, and begins anew
        if self.baseline is not None:
            course.drop_before(self._next_block * BLOCK_S - 2.0)
            self.intake.forget()

    def _learn(self, end: float) -> None:
        """Learn from the quiet record; before that, once, tune the twin to it."""
        if self._tune is not None and not self.tuned:
            self._tune_and_repeat()
            return
        course = self._course
        quiet = course.time <= end
        samples = {name: (times[times <= end], values[times <= end])
                   for name, (times, values) in self._pending.items() if times.size}
        self._use(learn(Track(course.time[quiet], course.raw[quiet], course.washed[quiet],
                              course.command[quiet], self._shadow.spacing_s, samples),
                        self._run_in))
        assert self.baseline is not None
        for name, item in self.baseline.signals.items():
            self._residual(name, item, end, course.time, course.raw)

    def _tune_and_repeat(self) -> None:
        """Tune the twin to what is there, and let it go through that again."""
        assert self._tune is not None
        recording = self.intake.recording(self.sheet)
        if not _stands_at_first(recording):
            self.tuned = 'not tuned: the drive was moving when the twin joined it'
            self._next_block -= 1
            return
        try:
            self.configuration = self._tune(recording, self.drive)
            self.drive = loaded(self.configuration)
            self.tuned = 'tuned to the quiet record'
        except UserError as error:
            self.tuned = f'not tuned: {error}'
        self.intake.again()
        self._build(self.drive)

    def _residual(self, name: str, item: SignalBaseline, end: float, time: FloatArray,
                  raw: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Take the samples before a time; return the twin's times of them, and residuals."""
        times, values = self._pending[name]
        of_twin = times - self._lag(item)
        mine = of_twin < end
        self._pending[name] = times[~mine], values[~mine]
        times, values = of_twin[mine], values[mine]
        if not times.size:
            return times, values
        column = SIGNALS.index(name)
        return times, residual_of(column, values, interpolated(times, time, raw)[:, column],
                                  times, self._residual_wash[name])

    def _lag(self, item: SignalBaseline) -> float:
        """Return by how much a reading is late now [s]."""
        return item.lag - self._ahead

    def _drift(self, shift: float, weight: float) -> float:
        """Take the shift of a block; return what of it lies within a sample of the command."""
        assert self.baseline is not None
        own = min(max(shift, -self.baseline.spacing), self.baseline.spacing)
        self._known = math.exp(-BLOCK_S / DRIFT_S) * self._known + weight
        if self._known > 0.0:
            self._ahead += own * weight / self._known
        return own

    def _block(self, begin: float) -> None:
        assert self.baseline is not None
        course, end = self._course, begin + BLOCK_S
        first, last = np.searchsorted(course.time, [begin - _BEHIND_S, end + _BEHIND_S])
        part = slice(max(first - _MARGIN, 0), last + _MARGIN)
        time = course.time[part]
        table = regressors(time, course.washed[part])
        own = (time >= begin) & (time < end)
        judged = self.baseline.judged(motion_of(time[own], course.command[part][own]))
        signals = self.baseline.signals
        there = {}
        for name, item in signals.items():
            times, residual = self._residual(name, item, end, time, course.raw[part])
            if times.size:
                self._missing.pop(name, None)
                there[name] = SignalBlock(SIGNALS.index(name), residual,
                                          interpolated(times, time, table))
            else:
                self._missing.setdefault(name, begin)
        shift = self._drift(*shift_of([(signals[name], measured)
                                       for name, measured in there.items()])) if there else 0.0
        z, sizes = [], {}
        for name, item in signals.items():
            if name not in there:
                z.append(np.full(len(SCORES), np.nan))
                continue
            found, left = block_scores(item, there[name].shifted(shift))
            sizes[name] = float(np.sqrt(np.mean(left**2)))
            z.append(standard_scores(item, found))
        if begin < self._run_in:
            return
        number = self._next_block - 1
        self.blocks += 1
        self._sizes.append((number, sizes))
        if not judged:
            self.unjudged += 1
            return
        self._charts.add(np.concatenate(z), number)
        if self._charts.alarmed.any():
            self._gap = True
        elif self._charts.calm:
            self._gap = False

    def _rubbish_counts(self) -> dict[str, int]:
        counts: dict[str, int] = {}
        for (name, _), count in self.intake.rubbish.items():
            counts[name] = counts.get(name, 0) + count
        return counts

    @property
    def state(self) -> str:
        """Return one of the words at the top of this module."""
        if self._stale:
            return STALE
        if self._shadow.start_ns is None:
            return WAITING
        if self.bad_signals():
            return BAD_INPUT
        if self._gap:
            return GAP
        if self._next_block * BLOCK_S < self._run_in:
            return SETTLING
        return LEARNING if self.baseline is None else OK

    def bad_signals(self) -> dict[str, str]:
        """Return the signals whose samples are rubbish or missing, and what is wrong with each."""
        found = dict.fromkeys(self._missing, 'missing')
        if self._rubbish:
            before, accepted = self._rubbish[0]
            for name, count in self._rubbish_counts().items():
                new = count - before.get(name, 0)
                good = self.intake.accepted[name] - accepted.get(name, 0)
                if new > max(_RUBBISH_SHARE * good, 3):
                    kinds = [kind for key, kind in self.intake.rubbish if key == name]
                    found[name] = f'{new} samples {" or ".join(kinds)}'
        return found

    def gaps(self) -> list[Gap]:
        """Return which signals are apart from the twin, the greatest first."""
        if self.baseline is None or not self._gap:
            return []
        found: dict[str, Gap] = {}
        start = self._shadow.start_ns or 0
        for chart in np.flatnonzero(self._charts.alarmed):
            name, score = self._chart_names[chart]
            sigma, began = self._charts.size(int(chart)), self._charts.began(int(chart))
            if name in found and abs(found[name].sigma) >= abs(sigma):
                continue
            since = start + int(began * BLOCK_S * NANOSECONDS)
            sizes = [own[name] for number, own in self._sizes if number >= began and name in own]
            found[name] = Gap(name, unit_of(name) or '1', since, score, sigma,
                              math.sqrt(sum(s * s for s in sizes) / max(len(sizes), 1)),
                              self.baseline.signals[name].sigma)
        return sorted(found.values(), key=lambda gap: -abs(gap.sigma))


def _spacing(times: FloatArray) -> float:
    return float(np.median(np.diff(times))) if times.size > 1 else 0.01


def _stands_at_first(recording: Recording) -> bool:
    """Return whether the motors stood still when a recording began."""
    tachs = [recording[reading.signal] for reading in of(TACHOMETER)
             if reading.signal in recording]
    return bool(tachs) and all(abs(item.values[0]) < _STILL for item in tachs)
