# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The twin of a recording: the emulator, driven by the command that was recorded.

Between samples the command is a straight line, as the drive's own signals are; where it jumps it
goes on as before up to the sample after the jump. A command recorded at every macro-step is thus
played as it was: value and slope at each step, never a slope across a jump.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

from antenna_drive.emulator import units as drive_units, wiring
from antenna_drive.emulator.run import Emulator, MACRO_STEP
from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.recording.plain import thaw
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.runs import record, STEP
from antenna_drive.recording.sheet import CircuitBias, FixedBias, FixedStepBias, TestSheet
import numpy as np
from scipy.ndimage import median_filter
from simgap.inputs.schema import Value
from simgap.logs.channel import Channel, NANOSECONDS, nanoseconds, RecordingError

_OUTPUTS = wiring.OUTPUTS[wiring.TEST_SIGNAL]
COMMAND, TORQUE = (f'{wiring.TEST_SIGNAL}/{signal.name}' for signal in _OUTPUTS)
# A slope is a jump if it exceeds the median of the slopes around it, including itself, by this
# factor.
_JUMP = 20.0
_AROUND = 9

Changes = dict[int, dict[str, Mapping[str, Value]]]


class LaidCommand(Unit):
    """In the place of the test signal, a command that is laid onto the macro-steps."""

    outputs: ClassVar[tuple[Signal, ...]] = _OUTPUTS

    def __init__(self) -> None:
        """Command zero until something is laid."""
        super().__init__(wiring.TEST_SIGNAL)
        self.lay(np.zeros((1, len(_OUTPUTS), 2)), 0)

    def lay(self, table: FloatArray, first: int) -> None:
        """Take value and slope of each output at the steps from `first` on; the last one holds."""
        self._table, self._first = table, first

    def start(self, step_s: float) -> FloatArray:
        """Give the first row; see `Unit.start`."""
        return np.array(self._table[0])

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Give the row of t_k+1; see `Unit.step`."""
        return np.array(self._table[min(k + 1 - self._first, len(self._table) - 1)])


class CommandUnit(LaidCommand):
    """
    The test signal of a replay: it plays what was recorded, and holds the last value at the end.

    It takes the place of the drive's own test signal, in one process or as a node.
    """

    def __init__(self, recording: Recording) -> None:
        """Take a recording's rate command and, if there, torque; RecordingError if none."""
        super().__init__()
        if COMMAND not in recording or not len(recording[COMMAND]):
            raise RecordingError(f'{COMMAND}: not in this recording, there is nothing to replay')
        self._channels = [recording.channels.get(name) for name in (COMMAND, TORQUE)]
        self.start_ns = int(recording[COMMAND].time_ns[0])
        self._end_ns = int(recording[COMMAND].time_ns[-1])

    def last_step(self, step_s: float) -> int:
        """Return the last macro-step of `step_s` [s] that the command covers."""
        return int((self._end_ns - self.start_ns) / NANOSECONDS / step_s + 1e-6)

    def start(self, step_s: float) -> FloatArray:
        """Lay the command onto the macro-steps and give the first; see `Unit.start`."""
        times = self.start_ns + nanoseconds(np.arange(self.last_step(step_s) + 1) * step_s)
        table = np.zeros((len(times), len(self.outputs), 2))
        for row, channel in enumerate(self._channels):
            if channel is not None and len(channel):
                table[:, row] = command_table(channel, times)
        table[-1, :, 1] = 0.0
        self.lay(table, 0)
        return super().start(step_s)


def command_table(channel: Channel, times_ns: Any) -> FloatArray:
    """
    Return value and slope of a recorded command at the macro-steps.

    channel : the command, at least one sample
    times_ns : the macro-steps [ns], shape (n,); before the first sample and after the last the
        command stands still

    Returns an array of shape (n, 2): value and slope to the right of each step, per second.
    """
    values, stamps = channel.values, channel.time_ns
    if len(values) < 2:
        return np.column_stack([np.full(len(times_ns), values[0]), np.zeros(len(times_ns))])
    slopes = np.diff(values) / (np.diff(stamps) / NANOSECONDS)
    size = np.abs(slopes)
    jumps = size > _JUMP * median_filter(size, _AROUND, mode='mirror')
    # across a jump the command goes on as it did before it
    smooth = np.maximum.accumulate(np.where(jumps, -1, np.arange(len(slopes))))
    slopes = np.append(np.where(smooth < 0, 0.0, slopes[smooth]), 0.0)
    place = np.searchsorted(stamps, times_ns, side='right') - 1
    inside = place >= 0
    place = np.maximum(place, 0)
    since = np.where(inside, (times_ns - stamps[place]) / NANOSECONDS, 0.0)
    slope = np.where(inside, slopes[place], 0.0)
    return np.column_stack([values[place] + slope * since, slope])


def twin(recording: Recording, config: Sequence[str] = (), step_s: float | None = None,
         every: int = 1) -> Recording:
    """
    Return what the emulator does when it is given the recorded command.

    The drive's parameters are those of `config` if given, else those that the recording holds,
    with its live changes, else the reference set as the test sheet changes it.

    recording : has to hold the rate command
    config : configuration files or names of sets in config/
    step_s : macro-step [s]; that of the recording if it tells, else 1 ms
    every : keep the samples of the macro-steps that this number divides

    Returns a recording of every signal, with the time stamps of the real one's clock.

    Raises RecordingError: the recording holds no command.
    Raises ParameterError: a configuration or the recording's own is not allowed.
    """
    command = CommandUnit(recording)
    noted = recording.notes.get(STEP)
    if not isinstance(noted, float) or not 0.0 < noted <= 1.0:
        noted = MACRO_STEP
    step = step_s or noted
    units, changes, whence = _drive(recording, config, noted, step)
    emulator = Emulator(load(), step, {**units, wiring.TEST_SIGNAL: command})
    made = record(emulator, command.last_step(step) * step, changes=changes, every=every,
                  sheet=recording.sheet,
                  twin_of=str(recording.notes.get('source', '')), parameters=whence,
                  command='straight line between samples, jumps kept')
    return made.shift_ns(command.start_ns)


def _drive(recording: Recording, config: Sequence[str], noted: float,
           step_s: float) -> tuple[dict[str, Unit], Changes, str]:
    """Return the units but the test signal, their live changes, and where they come from."""
    others = [name for name in wiring.UNITS if name != wiring.TEST_SIGNAL]
    if config or not recording.configuration:
        drive = load(*config)
        changes: Changes = {}
        if not config and recording.sheet:
            drive, changes = of_sheet(recording.sheet, step_s)
        whence = ', '.join(config) or ('the test sheet' if recording.sheet else 'the reference')
        return {name: drive_units.build(name, drive) for name in others}, changes, whence
    settings = thaw(recording.configuration)
    units = {name: drive_units.build(name, load(), settings.get(name)) for name in others}
    changes = {}
    for change in recording.changes:
        if change.unit != wiring.TEST_SIGNAL:  # its changes are in the command already
            step = round(change.step * noted / step_s)
            own = changes.setdefault(step, {})
            own[change.unit] = {**own.get(change.unit, {}), **thaw(change.values)}
    return units, changes, 'the recording'


def of_sheet(sheet: TestSheet, step_s: float) -> tuple[Drive, Changes]:
    """
    Return the reference drive as a test sheet changes it, and what changes while it runs.

    Raises ParameterError: the sheet says something that the drive does not allow.
    """
    drive = load(f'{sheet.circuit}_circuit') if sheet.circuit else load()
    if sheet.filter_1:
        drive = replace(drive, torque_share=replace(
            drive.torque_share,
            filter_1=load(f'{sheet.filter_1}_circuit').torque_share.filter_1))
    settings: dict[str, Any] = {}
    changes: Changes = {}
    if isinstance(sheet.bias, CircuitBias):
        settings['torque_share.circuit.bias_source'] = 'circuit'
        if sheet.bias.bias_pot is not None:
            settings['torque_share.circuit.bias_pot'] = sheet.bias.bias_pot
        if sheet.bias.start is not None:
            settings['torque_share.circuit.start'] = sheet.bias.start
    elif isinstance(sheet.bias, (FixedBias, FixedStepBias)):
        settings['torque_share.circuit.bias_source'] = 'fixed'
        voltage = sheet.bias.voltage_V or 0.0
        if isinstance(sheet.bias, FixedStepBias):
            changes[round((sheet.bias.at_s or 0.0) / step_s)] = {
                wiring.TORQUE_SHARE: {'fixed_voltage': voltage}}
            voltage = 0.0
        settings['torque_share.circuit.fixed_voltage'] = voltage
    if sheet.elevation_deg is not None:
        settings['plant.axis.start_elevation'] = float(np.deg2rad(sheet.elevation_deg))
    return changed(drive, settings), changes


def distances(real: Recording, other: Recording) -> dict[str, dict[str, float]]:
    """
    Return how far a twin is from the real recording, signal by signal.

    Returns for each signal of both, at the real one's time stamps: the root mean square of the
    difference `rms`, that of the real signal about its mean `spread`, and their ratio `share` (NaN
    where the real signal does not change); all in the signal's unit.
    """
    result = {}
    for name, channel in real.channels.items():
        if name not in other or not len(channel) or not len(other[name]):
            continue
        mine = other[name]
        inside = (channel.time_ns >= mine.time_ns[0]) & (channel.time_ns <= mine.time_ns[-1])
        if not inside.any():
            continue
        values = channel.values[inside]
        difference = mine.at(channel.time_ns[inside]) - values
        rms, spread = float(np.sqrt(np.mean(difference**2))), float(values.std())
        result[name] = {'rms': rms, 'spread': spread,
                        'share': rms / spread if spread > 0.0 else float('nan')}
    return result
