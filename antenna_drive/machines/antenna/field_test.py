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
"""A recorded test, prepared for comparison: the command, the bias and the readings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import math
from typing import Any

from antenna_drive.diagnosis import FloatArray
from antenna_drive.errors import UserError
from antenna_drive.machines.antenna.circuits import CIRCUITS, constants, nearest_circuit
from antenna_drive.machines.antenna.excitation import (
    Bias, CommandedRate, RecordedCommand, SheetCommand,
)
from antenna_drive.machines.antenna.sensors import jitter_of, SensorModel
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.recording import sheet as sheets
from antenna_drive.recording.recording import Channel, NANOSECONDS, Recording
import numpy as np

CHANNELS = {
    'motor_1/ammeter': 'current_1', 'motor_2/ammeter': 'current_2',
    'motor_1/tach_rate': 'tach_1', 'motor_2/tach_rate': 'tach_2',
    'plant/encoder': 'encoder', 'torque_share/bias_voltage': 'bias_voltage',
}
UNITS = ('A', 'A', 'rad/s', 'rad/s', 'rad', 'V')
CURRENT_1, CURRENT_2, TACH_1, TACH_2, ENCODER, BIAS = range(6)
# Other names under which a recording may hold a reading.
_ALIASES = {'motor_1/ammeter': ('motor_1/current',), 'motor_2/ammeter': ('motor_2/current',)}
_RATE_COMMAND = 'test_signal/rate_command'
# Samples are thinned to about this rate [Hz]. They are not averaged, which would hide a ripple.
SAMPLE_RATE = 70.0
# The time of a recording that starts later than the first number [s] counts from its first
# sample, unless it joined the sheet's waveform within the second.
_PROMPT_S, _JOINED_S = 1.0, 60.0
# Least number of samples.
_FEWEST = 10

Note = Callable[[str], None]


@dataclass(frozen=True)
class FieldTest:
    """
    One recording, prepared.

    Attributes
    ----------
    name : for people
    record : of the drive as configured and as the sheet says, shape (1,)
    command : axis rate command
    bias : source of bias voltage, where the share circuit is not connected
    time : of the samples that are compared, shape (n,) [s]
    measured : readings, shape (n, 6), NaN where there is none
    slope : their slopes over time as recorded, shape (n, 6), NaN where there is none
    sensors : what they add
    jitter : of the time stamps [s]
    period : between two recorded samples [s]
    tolerances : of zeros, recorders and clocks

    """

    name: str
    record: np.ndarray[Any, np.dtype[Any]]
    command: CommandedRate
    bias: Bias
    time: FloatArray
    measured: FloatArray
    slope: FloatArray
    sensors: SensorModel
    jitter: float
    period: float
    tolerances: sheets.Tolerances

    def until(self, end: float) -> FieldTest:
        """Return the first part of the test, of this length [s]."""
        n = int(np.searchsorted(self.time, self.time[0] + end))
        return replace(self, time=self.time[:n], measured=self.measured[:n],
                       slope=self.slope[:n])

    @property
    def repeats(self) -> bool:
        """Return whether a part of the test shows what the whole does; not so with a chirp."""
        return not (isinstance(self.command, SheetCommand)
                    and isinstance(self.command.waveform, sheets.Chirp))


def prepared(name: str, recording: Recording, drive: Drive, note: Note,
             rate: float = SAMPLE_RATE) -> FieldTest:
    """
    Make a recording ready.

    Parameters
    ----------
    name
        for people
    recording
        with its test sheet
    drive
        the configuration
    note
        called with what was inferred or is missing
    rate
        to which samples are thinned [Hz]; infinite for all of them

    Raises
    ------
    UserError : the rate command is missing, or there is no reading to compare, or nearly none

    """
    if _RATE_COMMAND not in recording or len(recording[_RATE_COMMAND]) < _FEWEST:
        raise UserError(f'{name}: no rate command is recorded; {_RATE_COMMAND} '
                        '(rate_command_rad_s in a CSV) is needed')
    if all(_channel(recording, channel) is None for channel in CHANNELS):
        raise UserError(f'{name}: there is no reading beside the rate command, '
                        'at least one current is needed')
    recording = _from_its_start(name, recording, note)
    drive, bias = _as_the_sheet_says(name, recording.sheet, drive, note)
    given = recording[_RATE_COMMAND]
    command = _command(name, recording.sheet.waveform, given, note)
    time = _times(name, recording, rate)
    return FieldTest(name, record_of(drive), command, bias, time,
                     *_measured(name, recording, time, note),
                     SensorModel.of(recording.sheet.sensors),
                     jitter_of(command, given.time_s, given.values),
                     float(np.median(np.diff(given.time_s))),
                     recording.sheet.tolerances or sheets.Tolerances())


def _from_its_start(name: str, recording: Recording, note: Note) -> Recording:
    """Return a recording whose time starts with the test."""
    begins_s = recording.start_ns / NANOSECONDS
    waveform = recording.sheet.waveform
    if abs(begins_s) <= _PROMPT_S or (0.0 < begins_s < _JOINED_S and waveform is not None
                                      and _is(SheetCommand(waveform), recording[_RATE_COMMAND])):
        return recording
    note(f'{name}: begins at {begins_s:.3f} s, time is counted from there')
    return recording.shift_ns(-recording.start_ns)


def _as_the_sheet_says(name: str, sheet: sheets.TestSheet, drive: Drive,
                       note: Note) -> tuple[Drive, Bias]:
    for word in CIRCUITS:
        circuit = getattr(sheet, word)
        if circuit is None:
            note(f'{name}: the sheet does not give {word}: as configured')
        elif nearest_circuit(drive, word) != circuit:
            # numbers near those of the circuit are its own, as they were measured
            drive = changed(drive, constants(word, circuit))
    if sheet.elevation_deg is not None:
        drive = changed(drive, {'plant.axis.start_elevation': math.radians(sheet.elevation_deg)})
    share = 'torque_share.circuit.'
    given = sheet.bias
    if isinstance(given, sheets.CircuitBias):
        changes: dict[str, Any] = {f'{share}bias_source': 'circuit'}
        if given.bias_pot is not None:
            changes[f'{share}bias_pot'] = given.bias_pot
        if given.start is not None:
            changes[f'{share}start'] = given.start
        return changed(drive, changes), Bias()
    if given is None:
        note(f'{name}: the sheet does not give the bias: as configured')
        voltage = drive.torque_share.circuit.fixed_voltage
        return drive, Bias(voltage, voltage)
    voltage = given.voltage_V or 0.0
    drive = changed(drive, {f'{share}bias_source': 'fixed'})
    if isinstance(given, sheets.FixedStepBias):
        return drive, Bias(0.0, voltage, given.at_s or 0.0)
    return drive, Bias(voltage, voltage)


def _command(name: str, waveform: sheets.Waveform | None, given: Channel,
             note: Note) -> CommandedRate:
    if waveform is None:
        note(f'{name}: no waveform in the sheet, the recorded command was interpolated')
        return RecordedCommand.of(given.time_s, given.values)
    exact = SheetCommand(waveform)
    if _is(exact, given):
        return exact
    note(f"{name}: the recorded command is not the sheet's waveform, it was interpolated")
    return RecordedCommand.of(given.time_s, given.values)


def _is(command: CommandedRate, given: Channel) -> bool:
    """Return whether a command is the recorded one."""
    wrong = np.abs(command(given.time_s) - given.values) > 0.05 * np.ptp(given.values)
    return bool(np.mean(wrong) < 0.02)


def _channel(recording: Recording, name: str) -> Channel | None:
    for alias in (name, *_ALIASES.get(name, ())):
        if alias in recording and len(recording[alias]):
            return recording[alias]
    return None


def _times(name: str, recording: Recording, rate: float) -> FloatArray:
    """Return the times that are compared: those of the reading with the most samples."""
    channels = [_channel(recording, name) for name in CHANNELS]
    time = max((c.time_s for c in channels if c is not None), key=len)
    time = time[time >= 0.0]
    if time.size < _FEWEST:
        raise UserError(f'{name}: {time.size} samples to compare after the start, at least '
                        f'{_FEWEST} are needed')
    every = max(1, round(1.0 / float(np.median(np.diff(time))) / rate))
    return np.asarray(time[::every])


def _measured(name: str, recording: Recording, time: FloatArray,
              note: Note) -> tuple[FloatArray, FloatArray]:
    """Return the readings and their slopes at these times; NaN where there is none."""
    measured, slope = np.full((2, time.size, len(CHANNELS)), np.nan)
    for c, channel_name in enumerate(CHANNELS):
        channel = _channel(recording, channel_name)
        if channel is None:
            note(f'{name}: {channel_name} was not recorded')
            continue
        times = channel.time_s
        at = np.clip(np.searchsorted(times, time - 1e-9), 0, times.size - 1)
        there = np.abs(times[at] - time) < 1e-6
        measured[there, c] = channel.values[at[there]]
        # the slope is taken before thinning, which would hide fast motion
        if times.size > 1:
            slope[there, c] = np.gradient(channel.values, times)[at[there]]
    return measured, slope
