# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A recording predicted from its rate command and test sheet alone."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
from typing import Any

from antenna_drive.diagnosis.excitation import Bias, Longest, schedule
from antenna_drive.diagnosis.field_recording import FieldRecording, Note
from antenna_drive.diagnosis.machine import LONGEST_STEP, SHORTEST_STEP, WAVE_STEP
from antenna_drive.diagnosis.modifiers import RecorderError, SensorReadings
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


def recorder_errors(entries: Iterable[Mapping[str, Any]]) -> SensorReadings:
    """Take the entries of a verdict's `recorder`; UserError if one is none."""
    found = SensorReadings()
    for entry in entries:
        try:
            name, value = str(entry['name']), float(entry['value'])
        except (KeyError, TypeError, ValueError) as error:
            raise UserError(f'recorder: {entry!r} given, allowed is name and value') from error
        kind, _, reading = name.partition(':')
        if not (kind in ('gain', 'zero', 'delay', 'lag') and reading in AT
                or kind in ('clock', 'clock_rate') and not reading):
            raise UserError(f'recorder: {name}: no such error; allowed are gain, zero, delay '
                            f'and lag of {", ".join(AT)} (such as gain:tach_1), clock '
                            'and clock_rate')
        if not math.isfinite(value):
            raise UserError(f'recorder: {name}: {value} given, allowed is a number')
        RecorderError(kind, reading).apply_to_readings(found, value)
    return found


@dataclass(frozen=True)
class Prediction:
    """A recording and its prediction, at all of its times."""

    time: FloatArray  # of the samples, as recorded, shape (n,) [s]
    measured: FloatArray  # readings, shape (n, c); NaN where there is none
    predicted: FloatArray  # readings, shape (n, c)

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


def predict(name: str, recording: Recording, drive: Drive, recorder: SensorReadings | None = None,
            note: Note = lambda text: None) -> Prediction:
    """
    Predict a recording, whose readings are compared and not used.

    `recorder` has its errors; `note` is called with what was inferred or is missing. Raises
    UserError: the recording lacks its rate command or any reading, or the run diverged.
    """
    test = FieldRecording.of(name, recording, note)
    predicted = _readings(test, *as_the_sheet_says(test.sheet, drive),
                          recorder or SensorReadings())
    if not np.isfinite(predicted).all():
        raise UserError(f'{name}: the run of this configuration diverged')
    # a recording that starts at another time is counted from its first sample
    longest = max((recording[channel].time_s for channel in recording), key=len)
    return Prediction(longest[-test.time.size:], test.measured(test.time)[0], predicted)


def _readings(test: FieldRecording, drive: Drive, bias: Bias,
              recorder: SensorReadings) -> FloatArray:
    """Return what the recorder says of a drive in a test, shape (n, c)."""
    record = record_of(drive)
    longest = Longest(LONGEST_STEP, SHORTEST_STEP, WAVE_STEP, fastest_wave(record))
    found = np.empty((test.time.size, len(READINGS)))
    clock = test.time + recorder.clock_rate * (test.time - test.time[0])
    for shift in np.unique(recorder.late):
        # a few samples at the start may be from before it
        times, place = np.unique(np.maximum(clock - shift, 0.0), return_inverse=True)
        plan = schedule(test.command, bias, times, longest,
                        float(record['test_signal']['delay'][0]))
        there = recorder.late == shift
        found[:, there] = batch.run(record, plan)[place, :, 0][:, there]
    return found * recorder.gain + recorder.zero
