# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A recording predicted from its rate command and test sheet alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
import math
from typing import Any

from antenna_drive.diagnosis.excitation import Bias, CommandedRate, Longest, schedule
from antenna_drive.diagnosis.field_recording import FieldRecording, Note
from antenna_drive.diagnosis.machine import LONGEST_STEP, SHORTEST_STEP, WAVE_STEP
from antenna_drive.diagnosis.sheet_settings import as_the_sheet_says
from antenna_drive.diagnosis.waves import fastest_wave
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import AT, RATE_COMMAND, READINGS, SIGNALS
from antenna_drive.recording.recording import Recording
import numpy as np
from simgap.errors import UserError
from simgap.machine.contract import FloatArray


def _none() -> FloatArray:
    return np.zeros(len(READINGS))


@dataclass
class RecorderErrors:
    """
    The errors of a recorder that no number of the drive stands for.

    Attributes
    ----------
    gain, zero : of each reading, shape (c,); what they add to 1, and to the reading in its unit
    delay : by how much earlier each is read than its time stamps say, shape (c,) [s]
    clock : by how much later all channels are read [s]
    clock_rate : share by which the recorder's clock is slow

    """

    gain: FloatArray = field(default_factory=_none)
    zero: FloatArray = field(default_factory=_none)
    delay: FloatArray = field(default_factory=_none)
    clock: float = 0.0
    clock_rate: float = 0.0

    @classmethod
    def of(cls, entries: Iterable[Mapping[str, Any]]) -> RecorderErrors:
        """
        Take the entries of a verdict's `recorder`.

        Raises
        ------
        UserError : an entry is none

        """
        found = cls()
        for entry in entries:
            try:
                name, value = str(entry['name']), float(entry['value'])
            except (KeyError, TypeError, ValueError) as error:
                raise UserError(f'recorder: {entry!r} given, allowed is name and value'
                                ) from error
            kind, _, channel = name.partition(':')
            if kind in ('gain', 'zero', 'delay') and channel in AT:
                getattr(found, kind)[AT[channel]] += value
            elif kind in ('clock', 'clock_rate') and not channel:
                setattr(found, kind, getattr(found, kind) + value)
            else:
                raise UserError(f'recorder: {name}: no such error; allowed are gain, zero and '
                                f'delay of {", ".join(AT)} (such as gain:tach_1), clock '
                                'and clock_rate')
            if not math.isfinite(value):
                raise UserError(f'recorder: {name}: {value} given, allowed is a number')
        return found


@dataclass(frozen=True)
class _WholeTest:
    """A test at all of its samples: what it does to the drive, and what was measured."""

    record: np.ndarray[Any, np.dtype[Any]]
    command: CommandedRate
    bias: Bias
    time: FloatArray
    measured: FloatArray

    @classmethod
    def of(cls, name: str, recording: Recording, drive: Drive, note: Note) -> _WholeTest:
        """Take a recording with its test sheet."""
        found = FieldRecording.of(name, recording, note)
        drive, bias = as_the_sheet_says(found.sheet, drive)
        return cls(record_of(drive), found.command, bias, found.time,
                   found.measured(found.time)[0])


@dataclass(frozen=True)
class Prediction:
    """
    A recording and its prediction, at all of its times.

    Attributes
    ----------
    time : of the samples, as recorded, shape (n,) [s]
    measured, predicted : shape (n, c); NaN where nothing was measured

    """

    time: FloatArray
    measured: FloatArray
    predicted: FloatArray

    def rms(self) -> dict[str, tuple[float, str]]:
        """Return the rms of measured minus predicted of each signal, with its unit."""
        found = {}
        for reading, error in zip(READINGS, (self.measured - self.predicted).T, strict=True):
            if np.isfinite(error).any():
                found[reading.name] = (float(np.sqrt(np.nanmean(error ** 2))), reading.unit)
        return found

    def as_recording(self, of: Recording) -> Recording:
        """Return the prediction as a recording with the signals of the one that it is of."""
        command = of[RATE_COMMAND]
        signals = {RATE_COMMAND: np.interp(self.time, command.time_s, command.values)}
        for c, name in enumerate(SIGNALS):
            if np.isfinite(self.measured[:, c]).any():
                signals[name] = self.predicted[:, c]
        return Recording.from_arrays(self.time, signals)


def predict(name: str, recording: Recording, drive: Drive, recorder: RecorderErrors | None = None,
            note: Note = lambda text: None) -> Prediction:
    """
    Predict a recording from its rate command and its test sheet.

    Parameters
    ----------
    name
        for people
    recording
        its readings are compared and not used
    drive
        the configuration
    recorder
        its errors; None for none
    note
        called with what was inferred or is missing

    Raises
    ------
    UserError : the recording lacks its rate command or any reading, or the run diverged

    """
    test = _WholeTest.of(name, recording, drive, note)
    predicted = _readings(test, recorder or RecorderErrors())
    if not np.isfinite(predicted).all():
        raise UserError(f'{name}: the run of this configuration diverged')
    # a recording that starts at another time is counted from its first sample
    longest = max((recording[channel].time_s for channel in recording), key=len)
    return Prediction(longest[-test.time.size:], test.measured, predicted)


def _readings(test: _WholeTest, recorder: RecorderErrors) -> FloatArray:
    """Return what the recorder says of the drive in a test, shape (n, c)."""
    late = recorder.delay - recorder.clock
    found = np.empty((test.time.size, len(READINGS)))
    clock = test.time + recorder.clock_rate * (test.time - test.time[0])
    for shift in np.unique(late):
        # a few samples at the start may be from before it
        times, place = np.unique(np.maximum(clock - shift, 0.0), return_inverse=True)
        values = _simulated(test, times)[place]
        found[:, late == shift] = values[:, late == shift]
    return found * (1.0 + recorder.gain) + recorder.zero


def _simulated(test: _WholeTest, times: FloatArray) -> FloatArray:
    longest = Longest(LONGEST_STEP, SHORTEST_STEP, WAVE_STEP, fastest_wave(test.record))
    delay = float(test.record['test_signal']['delay'][0])
    plan = schedule(test.command, test.bias, times, longest, delay)
    return np.asarray(batch.run(test.record, plan)[:, :, 0])
