# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The twin beside a real drive: what it does, how far the two are apart, and what it says of that.

It has no clock of its own. Time is that of the samples' stamps. Only whether the real drive has
stopped depends on the time that its owner gives to `advance`.
"""

from collections.abc import Callable
from dataclasses import dataclass

from antenna_drive.emulator.run import MACRO_STEP
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import of, RATE_COMMAND, SIGNALS, TACHOMETER
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import TestSheet
from antenna_drive.twin.baseline import Baseline, BLOCK_S, interpolated, residual_of, WashOut
from antenna_drive.twin.intake import InputFaults, Intake
from antenna_drive.twin.judge import BEHIND_S, BlockJudge, Course, Gap, Pending
from antenna_drive.twin.quiet_record import learn, Track
from antenna_drive.twin.shadow import Shadow, under_test
from antenna_drive.twin.tuned import loaded, Tuned
import numpy as np
from simgap.errors import UserError
from simgap.logs.channel import NANOSECONDS

WAITING, SETTLING, LEARNING = 'waiting', 'settling', 'learning'
OK, GAP, STALE, BAD_INPUT = 'ok', 'gap', 'stale input', 'bad input'
OUTSIDE = 'outside the tolerances'
# The twin's course is kept at every macro-step that this number divides.
_EVERY = 5
# Motors stand still if the first readings of their tachometers are below this [rad/s]. The next
# ones may be of the motion already.
_STILL = 0.1
# Returns the configuration as a quiet record shows the drive.
Tune = Callable[[Recording, Drive], Tuned]


@dataclass(frozen=True)
class TwinSettings:
    """How a twin judges."""

    alarms_per_day: float = 1.0  # false alarms of a healthy drive, of all charts together
    quiet_s: float = 300.0  # length of the quiet record from which it learns what is healthy [s]
    # after which a start at rest is forgotten; the diagnosis takes as much [s]
    run_in_s: float = 15.0
    again_s: float = 30.0  # the same after a jump of the time, in the middle of a motion [s]
    stale_s: float = 2.0  # without new samples for so long, the real drive has stopped [s]
    reference: float = 1.0  # k of the charts, half the shift that they find fastest, in deviations
    clip: float = 3.2  # greatest increment of a chart, in deviations
    keep_s: float = 300.0  # how much of the real drive's samples is kept [s]


@dataclass(frozen=True)
class Compared:
    """Samples of one signal beside the twin; arrays of shape (n,), SI units."""

    name: str
    stamps: np.ndarray
    twin: FloatArray
    residual: FloatArray


class Twin:
    """
    The twin of one drive.

    drive : the configuration
    sheet : of the test that the real drive is in
    settings : how to judge
    baseline : of an earlier quiet record; None: learn one
    tune : returns the configuration with the tolerances of a quiet record in it, and what is
        beyond them; None: it stays as it is
    outside : what an earlier quiet record had beyond the tolerances; None: nobody has compared it

    tuned : what became of the tuning, for people
    configuration : text of the tuned configuration; '' if it is as it was
    outside : what the quiet record has beyond the tolerances of the configuration, () for nothing;
        None if the two were not compared
    drive : the configuration in force
    judge, faults : of the blocks, and what is wrong with what the real drive sends
    """

    def __init__(self, drive: Drive, sheet: TestSheet | None = None,
                 settings: TwinSettings | None = None, baseline: Baseline | None = None,
                 tune: Tune | None = None, outside: tuple[str, ...] | None = None) -> None:
        """Begin with nothing known of the real drive."""
        self.settings = settings or TwinSettings()
        self.sheet = sheet or TestSheet()
        self.drive = drive
        self.intake = Intake(self.settings.keep_s)
        self.faults = InputFaults(self.intake, self.settings.stale_s)
        self.judge = BlockJudge(self.settings.alarms_per_day, self.settings.reference,
                                self.settings.clip)
        self._tune = tune
        self.tuned, self.configuration, self.outside = '', '', outside
        self._stretch, self._run_in = 0, self.settings.run_in_s
        self._given: dict[str, int] = {}
        self._build(drive)
        if baseline is not None:
            self.judge.use(baseline)

    def _build(self, drive: Drive) -> None:
        """Take another configuration, and begin again."""
        self._shadow = Shadow(*under_test(self.sheet, drive, MACRO_STEP), MACRO_STEP)
        self._columns = [self._shadow.names.index(name) for name in SIGNALS]
        self._command = self._shadow.names.index(RATE_COMMAND)
        self._begin()

    def _begin(self) -> None:
        """Begin a stretch: the twin stands still until the first command."""
        self._shadow.restart()
        self._course = Course()
        self._pending: Pending = {name: (np.zeros(0), np.zeros(0)) for name in SIGNALS}
        self._next_block = self._grid_row = 0
        self._publish_wash = WashOut()
        self.judge.restart()

    def put(self, name: str, stamp_ns: int, value: float) -> bool:
        """Take a sample of the real drive; see `Intake.put`."""
        return self.intake.put(name, stamp_ns, value)

    def advance(self, now_s: float | None = None) -> list[Compared]:
        """
        Go on as far as the samples lead.

        now_s : time of any steady clock, which shows that a drive has stopped; None: not looked at
            [s]

        Returns what can be compared since the last call, signal by signal.
        """
        if now_s is not None:
            self.faults.look(now_s)
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
                             values[:, self._command], _EVERY * MACRO_STEP)
        compared = self._compare()
        self._judge()
        return compared

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
            twin = interpolated(times - self.judge.lag(name), course.time,
                                course.raw)[:, SIGNALS.index(name)]
            residual = residual_of(SIGNALS.index(name), values, twin, times, self._publish_wash)
            result.append(Compared(name, stamps, twin, residual))
            old = self._pending[name]
            self._pending[name] = (np.append(old[0], times), np.append(old[1], values))
        return result

    def _judge(self) -> None:
        """Judge, or learn from, every block that is complete."""
        course = self._course
        if not course.time.size:
            return
        while course.time[-1] > (self._next_block + 1) * BLOCK_S + BEHIND_S + self.judge.late_s:
            self._next_block += 1
            end = self._next_block * BLOCK_S
            self.faults.end_block()
            if self.judge.baseline is not None:
                self.judge.judge(self._next_block - 1, course, self._pending, self._run_in)
            elif end >= self._run_in + self.settings.quiet_s:
                self._learn(end)
                if self._course is not course:
                    return  # the twin was tuned, and begins again
        if self.judge.baseline is not None:
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
        baseline = learn(Track(course.time[quiet], course.raw[quiet], course.washed[quiet],
                               course.command[quiet], self._shadow.spacing_s, samples),
                         self._run_in)
        self.judge.use(baseline)
        for name in baseline.signals:
            self.judge.residual(name, self._pending, end, course.time, course.raw)

    def _tune_and_repeat(self) -> None:
        """Tune the twin to what is there, and let it go through that again."""
        assert self._tune is not None
        recording = self.intake.recording(self.sheet)
        if not _stands_at_first(recording):
            self.tuned = 'not tuned: the drive was moving when the twin joined it'
            self._next_block -= 1
            return
        try:
            found = self._tune(recording, self.drive)
            self.configuration, self.outside = found.text, found.outside
            self.drive = loaded(self.configuration)
            self.tuned = 'tuned to the quiet record'
        except UserError as error:
            self.tuned = f'not tuned: {error}'
        self.intake.again()
        self._build(self.drive)

    @property
    def state(self) -> str:
        """Return one of the words at the top of this module."""
        if self.faults.stale:
            return STALE
        if self._shadow.start_ns is None:
            return WAITING
        if self.bad_signals():
            return BAD_INPUT
        if self.judge.gap:
            return GAP
        if self._next_block * BLOCK_S < self._run_in:
            return SETTLING
        if self.judge.baseline is None:
            return LEARNING
        return OUTSIDE if self.outside else OK

    def bad_signals(self) -> dict[str, str]:
        """Return the signals whose samples are rubbish or missing, and what is wrong with each."""
        return {**dict.fromkeys(self.judge.missing, 'missing'), **self.faults.found()}

    def gaps(self) -> list[Gap]:
        """Return which signals are apart from the twin, the greatest first."""
        return self.judge.gaps(self._shadow.start_ns or 0)


def _stands_at_first(recording: Recording) -> bool:
    """Return whether the motors stood still when a recording began."""
    tachs = [recording[reading.signal] for reading in of(TACHOMETER)
             if reading.signal in recording]
    return bool(tachs) and all(abs(item.values[0]) < _STILL for item in tachs)
