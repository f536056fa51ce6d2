# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded test, prepared for comparison: the command, the bias, the readings, the steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
import math
from typing import Any, TypeAlias

from antenna_drive.diagnosis.excitation import (
    Bias, CommandedRate, Longest, schedule, SheetCommand, with_bias,
)
from antenna_drive.diagnosis.field_recording import FieldRecording, Note
from antenna_drive.diagnosis.inference import completed
from antenna_drive.diagnosis.late_readings import dense, lagging, Outputs, parts_of, read_at
from antenna_drive.diagnosis.modifiers import RunSetup, SensorReadings
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.diagnosis.sensors import SensorModel, slips
from antenna_drive.diagnosis.sheet_settings import as_the_sheet_says
from antenna_drive.diagnosis.suitability import check
from antenna_drive.diagnosis.windows import Window, windows
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.readings import AT, of, TACHOMETER
from antenna_drive.recording import sheet as sheets
from antenna_drive.recording.recording import Recording
import numpy as np
from simgap.machine.contract import Excerpt, FloatArray

# This many recordings tell different things: one window of each is enough. Of fewer, two are
# taken.
_MANY = 3
# Step of the run that places the encoder's readings of a window of unknown start [s].
_STEP_S = 5.3e-3
# A command is a sweep if it reverses in one half of a test more often than in the other by this
# factor, seen at this many places.
_SWEEP, _LOOKS = 2.0, 2000
# The angle at the beginning of a window is read in this time [s].
_ANGLE_S = 0.1
# What the command did in a hole of the recording is forgotten after this time, as far as the mean
# in it does not tell [s].
_FORGOTTEN_S = 2.0
# Tables that are kept: a test has one for each bias voltage and each wave.
_KEPT_PLANS = 24
# What no sample of a command shows, see `RunSetup.unrecorded`.
_Unrecorded: TypeAlias = tuple[tuple[tuple[str, int], float], ...]


@dataclass(frozen=True)
class FieldTest:
    """A window of a recording, prepared; its time counts from the beginning of the window."""

    name: str  # for people
    # of the drive as configured and as the sheet says, shape (1,)
    record: np.ndarray[Any, np.dtype[Any]]
    command: CommandedRate  # of the axis
    bias: Bias  # source of bias voltage, where the share circuit is not connected
    time: FloatArray  # of the samples that are compared, shape (n,) [s]
    measured: FloatArray  # readings, shape (n, c), NaN where there is none
    slope: FloatArray  # their slopes over time as recorded, shape (n, c), NaN where there is none
    sensors: SensorModel  # what they add
    jitter: float  # of the time stamps [s]
    period: float  # between two recorded samples [s]
    sheet: sheets.TestSheet  # what the tester knows, and what was inferred
    # False if the simulation begins in the middle of a motion, whose state is not known; the zero
    # of the encoder then follows from the readings alone
    known_start: bool = True
    # of the axis at the beginning of the window, since that of the recording [rad]; waves go on
    # where they were
    start_angle: float = 0.0
    labels: Mapping[str, str] = field(default_factory=dict)  # what was different, by the sheet
    excerpt: Excerpt | None = None  # of the recording

    @cached_property
    def output_times(self) -> FloatArray:
        """Return the times at which a run keeps its outputs: the samples and some between [s]."""
        return dense(self.time, self.parts)

    @cached_property
    def parts(self) -> int:
        """Return into how many parts the outputs cut the time between two samples."""
        return parts_of(float(np.median(np.diff(self.time))) if self.time.size > 1 else 0.0)

    def until(self, end: float) -> FieldTest:
        """Return the first part of the test, of this length [s]."""
        n = int(np.searchsorted(self.time, self.time[0] + end))
        return replace(self, time=self.time[:n], measured=self.measured[:n], slope=self.slope[:n])

    def simulated(self, longest_step: float) -> FloatArray:
        """Return the readings of the drive as configured, with steps of at most this [s]."""
        plan = schedule(self.command, self.bias, self.time, Longest(longest_step))
        return np.asarray(batch.run(self.record, plan)[:, :, 0])

    def readings_of(self, out: Outputs, errors: SensorReadings,
                    digits: FloatArray | None) -> FloatArray:
        """
        Return the readings of a run, shape (n, c).

        errors : of the sensors, which nothing feeds back
        digits : readings of the encoder in digits, shape (n,); None if they tell none
        """
        wanted = self.time + errors.clock_rate * (self.time - self.time[0])
        filtered = lagging(self.output_times, out.values, errors.lag)
        values = read_at(self.output_times, filtered, wanted, errors.late)
        for name, tachometer in out.rippling.items():
            c = AT[name]
            # a ripple may be faster than the outputs: the filter is a delay to it
            values[:, c] = tachometer.read_at(self.output_times, out.values[:, c], wanted,
                                              float(errors.late[c] + errors.lag[c]))
        values *= errors.gain
        angle = values[:, AT['encoder']]
        for shape, parts in errors.waves.items():
            angle += shape.along(angle + self.start_angle, parts)
        values += errors.zero
        digit = errors.digit
        if digit > 0.0 and digits is not None:
            # whatever lies within the digit that was read would have been read
            shift = errors.turn * digit
            off = np.nan_to_num(angle - (digits + shift))
            angle -= np.clip(off, -0.5 * digit, 0.5 * digit) + shift
        elif digit > 0.0:
            angle[:] = digit * np.floor(angle / digit + 0.5)
        return values

    @property
    def repeats(self) -> bool:
        """Return whether a part of the test shows what the whole does; not so with a sweep."""
        if isinstance(self.command, SheetCommand):
            return not isinstance(self.command.waveform, sheets.Chirp)
        rate = self.command(np.linspace(self.time[0], self.time[-1], _LOOKS))
        early, late = (np.count_nonzero(np.diff(np.sign(part))) for part in np.split(rate, 2))
        return bool(max(early, late) <= _SWEEP * (min(early, late) + 1))


class Plans:
    """The tables of steps of some tests, which are kept while runs differ in numbers alone."""

    def __init__(self, tests: Sequence[FieldTest]) -> None:
        self._tests = tests
        self._kept = lru_cache(_KEPT_PLANS)(self._made)

    def steps(self, k: int, run: RunSetup, longest: Longest) -> batch.Schedule:
        """Return the steps of a run of test k, none of which is longer than allowed."""
        return self._kept(k, longest, run.delay, tuple(run.unrecorded.items()), run.bias)

    def _made(self, k: int, longest: Longest, delay: float, unrecorded: _Unrecorded,
              bias: Bias) -> batch.Schedule:
        test = self._tests[k]
        if bias != test.bias:
            return with_bias(self._kept(k, longest, delay, unrecorded, test.bias), bias)
        command = test.command
        if isinstance(command, RecordedCommand):
            # jumps move before means change
            for (what, number), value in sorted(unrecorded, key=lambda item: item[0][0]):
                change = command.with_jump if what == 'jump' else command.with_mean
                command = change(number, value)
        return schedule(command, bias, test.output_times, longest, delay)


def prepared(recordings: Mapping[str, Recording], drive: Drive, note: Note) -> list[FieldTest]:
    """
    Make recordings of one machine ready: the windows that tell most, each a test of its own.

    `note` is called with what was inferred or is missing. Raises UserError: a recording lacks the
    rate command or readings, or cannot be of this drive.
    """
    found = [FieldRecording.of(name, recording, note) for name, recording in recordings.items()]
    for recording in found:
        if not recording.is_planned:
            check(recording, drive, note)
    found = completed(found, drive, note)
    most = 1 if len(found) >= _MANY else 2
    tests = []
    for recording in found:
        configured, bias = as_the_sheet_says(recording.sheet, drive)
        chosen = windows(recording, configured, bias, most)
        tests += [window_of(recording, window, configured, bias) for window in chosen]
        if not (len(chosen) == 1 and math.isinf(chosen[0].end)):
            note(f'{recording.name}: of {recording.end:.0f} s, ' + ' and '.join(
                f'{window.compared:.0f} to {min(window.end, recording.end):.0f} s'
                for window in chosen) + ' are compared')
    return tests


def window_of(recording: FieldRecording, window: Window, drive: Drive, bias: Bias) -> FieldTest:
    """Return one window of a recording, made ready."""
    name = recording.name
    time = recording.thinned(window.compared, window.end)
    measured, slope = recording.measured(time)
    sensors = SensorModel.of(recording.sheet.sensors)
    command = recording.command_between(window.begin, window.compared, time[-1])
    if isinstance(command, RecordedCommand):
        for begin, end in command.holes + window.begin:
            measured[(time > begin) & (time < end + _FORGOTTEN_S)] = np.nan
    resting = measured[:np.searchsorted(time, recording.onset)]  # a view
    for tachometer in of(TACHOMETER):
        rates = resting[:, AT[tachometer.name]]
        rates[slips(rates, sensors.errors(tachometer).scatter)] = np.nan
    angle = 0.0
    if window.begin > 0.0:
        drive = changed(drive, {'torque_share.circuit.start': 'steady'})
    if not window.known_start:
        angle = _angle(recording, window.begin)
        measured[:, AT['encoder']] -= angle
        drive = changed(drive, {
            'plant.axis.start_elevation': drive.plant.axis.start_elevation + angle})
    if not math.isinf(window.end):
        name = f'{name} {window.compared:.0f}-{time[-1]:.0f} s'
    test = FieldTest(
        name, record_of(drive), command, replace(bias, at=bias.at - window.begin),
        time - window.begin, measured, slope, sensors, recording.jitter, recording.period,
        recording.sheet, window.known_start, angle, dict(recording.sheet.labels or ()),
        Excerpt(recording.name, recording.end + recording.later_s, window.begin))
    if not window.known_start:
        off = (measured - test.simulated(_STEP_S))[:, AT['encoder']]
        if np.isfinite(off).any():
            more = float(np.nanmedian(off))
            measured[:, AT['encoder']] -= more
            return replace(test, start_angle=angle + more)
    return test


def _angle(recording: FieldRecording, at: float) -> float:
    """Return the angle of the axis since the start of a recording [rad]."""
    encoder = recording.readings.get('encoder')
    if encoder is not None:
        near = slice(*np.searchsorted(encoder.time_s, [at - _ANGLE_S, at + _ANGLE_S]))
        if encoder.values[near].size:
            return float(np.median(encoder.values[near]))
    rates = recording.rates
    before = np.searchsorted(rates.time_s, at)
    return float(rates.values[:before] @ np.diff(rates.time_s[:before + 1]))
