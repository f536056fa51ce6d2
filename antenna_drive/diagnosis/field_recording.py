# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A field recording, checked and cleaned: its command, its readings and its sheet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from antenna_drive.diagnosis.excitation import CommandedRate, SheetCommand
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.diagnosis.sensors import spikes
from antenna_drive.readings import AT, NAMED, RATE_COMMAND, RATE_COMMAND_COLUMN, Reading, READINGS
from antenna_drive.recording import sheet as sheets
from antenna_drive.recording.recording import Recording
import numpy as np
from numpy.typing import NDArray
from simgap.errors import UserError
from simgap.logs.channel import Channel, NANOSECONDS
from simgap.machine.contract import FloatArray

# A recording with this key in its notes is planned: its readings are not measured.
PLANNED = 'planned'
# Samples are thinned to about this rate [Hz]. Single samples are taken: a mean of several would
# blur edges and hide a ripple.
SAMPLE_RATE = 70.0
# The time of a recording that starts later than the first number [s] counts from its first
# sample, unless it joined the sheet's waveform within the second.
_PROMPT_S, _JOINED_S = 1.0, 60.0
# A waveform of the sheet is played by the command's clock, the readings are of the recorder's.
# Within this time, 100 millionths of it make a tenth of a sample [s].
_CLOCK_S = 15.0
# Windows are sought within this time from the start, or are at the onset; this much later no
# window ends [s].
SOUGHT_S, LATER_S = 1200.0, 60.0
# Least number of samples.
_FEWEST = 10
# The axis is at rest while the command is below this share of its greatest size.
_AT_REST = 1e-3
# Rows are missing where two of them are apart by more than this many usual spacings.
_GAP = 1.75

Note = Callable[[str], None]


@dataclass(frozen=True)
class FieldRecording:
    """A recording as all its windows share it; time counts from the start of the test."""

    name: str  # for people
    sheet: sheets.TestSheet  # what the tester knows
    command: CommandedRate  # axis rate command
    rates: Channel  # its samples
    readings: dict[str, Channel]  # those that were recorded, by short names, without spikes
    time: FloatArray  # of the reading with most samples, spikes included, shape (n,) [s]
    is_planned: bool  # the readings are not measured
    later_s: float = 0.0  # how much longer the recording is than what was looked at [s]

    @classmethod
    def of(cls, name: str, recording: Recording, note: Note) -> FieldRecording:
        """
        Check and clean a recording; `note` is called with what was inferred or is missing.

        Raises UserError: the rate command is missing, or there is no reading to compare, or nearly
        none.
        """
        if RATE_COMMAND not in recording or len(recording[RATE_COMMAND]) < _FEWEST:
            raise UserError(f'{name}: no rate command is recorded; {RATE_COMMAND} '
                            f'({RATE_COMMAND_COLUMN} in a CSV) is needed')
        if all(_channel(recording, reading) is None for reading in READINGS):
            raise UserError(f'{name}: there is no reading beside the rate command, '
                            'at least one current is needed')
        whole_ns, recording = recording.end_ns, looked_at(name, recording, note)
        later_s = (whole_ns - recording.end_ns) / NANOSECONDS
        recording = _from_its_start(name, recording, note)
        command = _command(name, recording.sheet.waveform, recording[RATE_COMMAND], note)
        readings = {}
        for reading in READINGS:
            channel = _channel(recording, reading)
            if channel is None:
                note(f'{name}: {reading.signal} was not recorded')
            else:
                readings[reading.name] = channel
        time = max((c.time_s for c in readings.values()), key=len)
        time = time[time >= 0.0]
        if time.size < _FEWEST:
            raise UserError(f'{name}: {time.size} samples to compare after the start, at least '
                            f'{_FEWEST} are needed')
        _note_missing_rows(name, time, note)
        return cls(name, recording.sheet, command, recording[RATE_COMMAND],
                   _without_spikes(name, readings, note), time, PLANNED in recording.notes,
                   later_s)

    @property
    def period(self) -> float:
        """Return the time between two recorded samples [s]."""
        return float(np.median(np.diff(self.rates.time_s)))

    @property
    def jitter(self) -> float:
        """Return by how much time stamps are off [s]: by what an exactly known command differs."""
        # where the command tells nothing
        usual = 0.01 * self.period
        if isinstance(self.command, RecordedCommand):
            return usual
        time, values = self.rates.time_s, self.rates.values
        error = self.command(time) - values
        slope = (self.command(time + 1e-4) - self.command(time - 1e-4)) / 2e-4
        # jumps and corners of the command say nothing about time
        good = ((np.abs(error) < 0.02 * np.ptp(values))
                & (np.abs(slope) > 0.3 * np.abs(slope).max()))
        if np.count_nonzero(good) < 50 or not np.any(slope[good]):
            return usual
        late = error[good] / slope[good]
        return max(float(1.4826 * np.median(np.abs(late - np.median(late)))), 0.1 * usual)

    @property
    def end(self) -> float:
        """Return the time of the last sample that can be compared [s]."""
        return float(self.time[-1])

    @property
    def onset(self) -> float:
        """Return when the motion begins [s]; the first time if nothing is commanded."""
        moving = _moving(self.rates.values) & (self.rates.time_s >= 0.0)
        return float(self.rates.time_s[np.argmax(moving)] if moving.any() else self.time[0])

    def command_between(self, begin: float, compared: float, end: float) -> CommandedRate:
        """Return the command of a window, see `Window`, in a time that counts from its begin."""
        if begin == 0.0 and compared < _CLOCK_S and isinstance(self.command, SheetCommand):
            return self.command
        # later, the recorder's clock is off by more than its samples tell the command
        recorded = (self.command if isinstance(self.command, RecordedCommand) else
                    RecordedCommand.of(self.rates.time_s, self.rates.values))
        return recorded.part(begin, end)

    def thinned(self, begin: float, end: float) -> FloatArray:
        """Return the times of samples to compare, begin <= time < end [s]."""
        time = self.time[slice(*np.searchsorted(self.time, [begin, end]))]
        every = max(1, round(1.0 / float(np.median(np.diff(time))) / SAMPLE_RATE))
        return np.asarray(time[::every])

    def measured(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the readings and their slopes at times, shape (n, c); NaN where there is none."""
        measured, slope = np.full((2, time.size, len(READINGS)), np.nan)
        for name, channel in self.readings.items():
            c = AT[name]
            times = channel.time_s
            # two samples beyond either end give the slopes there
            first, last = np.searchsorted(times, [time[0], time[-1]])
            inside = slice(max(first - 2, 0), last + 3)
            times, values = times[inside], channel.values[inside]
            at = np.clip(np.searchsorted(times, time - 1e-9), 0, times.size - 1)
            there = np.abs(times[at] - time) < 1e-6
            measured[there, c] = values[at[there]]
            # the slope is taken before thinning, which would hide fast motion
            if times.size > 1:
                slope[there, c] = np.gradient(values, times)[at[there]]
        return measured, slope


def _moving(rates: FloatArray) -> NDArray[np.bool_]:
    """Return where a command moves the axis, shape (n,)."""
    sizes = np.abs(rates)
    return np.asarray(sizes > _AT_REST * float(sizes.max()))


def looked_at(name: str, recording: Recording, note: Note) -> Recording:
    """Return the part of a recording in which windows may be: of a day its beginning."""
    rates = recording[RATE_COMMAND]
    end_s = float(rates.time_s[np.argmax(_moving(rates.values))]) + SOUGHT_S + LATER_S
    if end_s >= recording.end_ns / NANOSECONDS:
        return recording
    note(f'{name}: of {recording.duration_s:.0f} s, what comes after {end_s:.0f} s was not '
         'looked at')
    return recording.between(end_s=end_s)


def _from_its_start(name: str, recording: Recording, note: Note) -> Recording:
    """Return a recording whose time starts with the test."""
    begins_s = recording.start_ns / NANOSECONDS
    waveform = recording.sheet.waveform
    if abs(begins_s) <= _PROMPT_S or (0.0 < begins_s < _JOINED_S and waveform is not None
                                      and _is(SheetCommand(waveform), recording[RATE_COMMAND])):
        return recording
    note(f'{name}: begins at {begins_s:.3f} s, time is counted from there')
    return recording.shift_ns(-recording.start_ns)


def _command(name: str, waveform: sheets.Waveform | None, given: Channel,
             note: Note) -> CommandedRate:
    if waveform is None:
        note(f'{name}: no waveform in the sheet, the recorded command was interpolated')
    elif _is(exact := SheetCommand(waveform), given):
        return exact
    else:
        note(f"{name}: the recorded command is not the sheet's waveform, it was interpolated")
    return RecordedCommand.of(given.time_s, given.values)


def _is(command: SheetCommand, given: Channel) -> bool:
    """Return whether a command is the recorded one."""
    wrong = np.abs(command(given.time_s) - given.values) > 0.05 * np.ptp(given.values)
    return bool(np.mean(wrong) < 0.02)


def _channel(recording: Recording, reading: Reading) -> Channel | None:
    for signal in (reading.signal, reading.instead):
        if signal in recording and len(recording[signal]):
            return recording[signal]
    return None


def _note_missing_rows(name: str, time: FloatArray, note: Note) -> None:
    step = np.diff(time)
    usual = float(np.median(step))
    missing = int(np.round(step[step > _GAP * usual] / usual - 1.0).sum())
    if missing:
        note(f'{name}: {missing} of {time.size + missing} rows are missing')


def _without_spikes(name: str, readings: dict[str, Channel], note: Note) -> dict[str, Channel]:
    """Return the channels without spikes, which would pass for motion."""
    clean, counts = {}, []
    for reading, channel in readings.items():
        wrong = spikes(channel.values)
        if wrong.any():
            channel = replace(channel, time_ns=channel.time_ns[~wrong],
                              values=channel.values[~wrong])
            counts.append(f'{NAMED[reading].signal} {np.count_nonzero(wrong)}')
        clean[reading] = channel
    if counts:
        note(f'{name}: spikes of one sample were left out: {", ".join(counts)}')
    return clean
