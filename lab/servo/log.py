# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One log of a position-controlled servo with a pendulum, and the servo's readings in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from antenna_drive.recording.files import import_file, parse_map
from antenna_drive.recording.recording import Recording
from lab.servo.firmware import Firmware, firmware_of
from lab.servo.physics import swing
import numpy as np
from simgap.errors import one_line, UserError
from simgap.inputs.plain import from_json, PlainDataError
from simgap.logs.channel import RecordingError
from simgap.logs.text import read_text
from simgap.machine.contract import FloatArray

CHANNELS = ('position', 'speed', 'duty')
UNITS = ('rad', 'rad/s', '1')
POSITION, SPEED, DUTY = range(3)
STEP_S = 2.8e-3
# What a log of the BAM project (Rhoban) has of each sample. The load is a register of 16 bits.
_COLUMNS = {'goal_position': 'rad', 'position': 'rad', 'speed': 'rad/s', 'load': '1',
            'input_volts': 'V', 'temp': '1', 'torque_enable': '1'}
_MAP = parse_map({'time': {'column': 'timestamp'}, 'signals': {
    'servo/temperature' if name == 'temp' else f'servo/{name}': {'column': name, 'unit': unit}
    for name, unit in _COLUMNS.items()}})
_NOTES = {'mass': (int, float), 'length': (int, float), 'kp': (int, float), 'vin': (int, float),
          'motor': (str,), 'trajectory': (str,)}


def read_bam(path: Path) -> Recording:
    """
    Return a log of the BAM project, with mass [kg], length [m], kp, vin [V], motor and trajectory.

    Raises RecordingError: it cannot be read, is no such log, or an entry lacks a number.
    """
    try:
        above = from_json(read_text(path))
    except PlainDataError as error:
        raise RecordingError(f'{path}: {error}') from None
    entries = above.get('entries') if isinstance(above, dict) else None
    if not isinstance(entries, list):
        raise RecordingError(f'{path}: no log of a servo, there is no list of entries')
    _check(path, '', above, _NOTES)
    for number, entry in enumerate(entries):
        # a map takes texts and booleans for numbers, too
        _check(path, f'entry {number}: ', entry, {**dict.fromkeys(
            ('timestamp', *_COLUMNS), (int, float)), 'torque_enable': (bool,)})
    recording = import_file(path, _MAP)
    return Recording(recording.channels, notes={
        **recording.notes, **{name: above[name] for name in _NOTES}})


def _check(path: Path, where: str, given: Any, wanted: Mapping[str, tuple[type, ...]]) -> None:
    for name, kinds in wanted.items():
        value = given.get(name) if isinstance(given, dict) else None
        if not isinstance(value, kinds) or isinstance(value, bool) and bool not in kinds:
            kind = {str: 'a text', bool: 'true or false'}.get(kinds[0], 'a number')
            raise RecordingError(f'{path}: {where}{name}: {one_line(repr(value), 40)} given, '
                                 f'allowed is {kind}')


@dataclass(frozen=True)
class ServoLog:
    """One log of a servo with a pendulum; arrays have shape (n,) unless noted."""

    name: str
    kp: float                   # position gain, in the firmware's unit
    trajectory: str             # the name of the goal's course
    mass: float                 # of the pendulum [kg]
    length: float               # of the pendulum [m]
    gain: float                 # duty per position error [1/rad]
    supply: float               # [V]
    firmware: Firmware
    time: FloatArray            # of the samples [s]
    goal: FloatArray            # [rad]
    enabled: FloatArray         # 1 where the servo drives
    temperature: FloatArray     # [degC]
    measured: FloatArray        # position [rad], speed [rad/s], duty; shape (n, 3)

    @classmethod
    def of(cls, name: str, recording: Recording, beside: Path | None = None) -> ServoLog:
        """
        Prepare a log that `read_bam` has read; see `firmware_of` for `beside`.

        Raise UserError where it is too short, or the drive law of this servo is not known.
        """
        notes = recording.notes
        for key in ('mass', 'length', 'kp', 'vin'):
            if not 0.0 < float(notes[key]) < math.inf:
                raise UserError(f'{name}: {key}: {notes[key]} given, allowed is more than 0')
        try:
            firmware = firmware_of(notes['motor'], beside)
        except UserError as error:
            raise UserError(f'{name}: {error}') from None
        time = np.asarray(recording['servo/position'].time_s, dtype=np.float64)
        if time.size < 50:
            raise UserError(f'{name}: {time.size} samples, at least 50 are needed')
        values = {key: np.array(recording[f'servo/{key}'].values, dtype=np.float64)
                  for key in ('position', 'speed', 'goal_position', 'torque_enable',
                              'temperature', 'load')}
        load = values['load']
        # the register has 16 bits in two's complement
        duty = np.where(load >= 2 ** 15, load - 2 ** 16, load) / firmware.duty_count
        return cls(name, float(notes['kp']), str(notes['trajectory']), float(notes['mass']),
                   float(notes['length']), float(notes['kp']) * firmware.error_gain,
                   float(notes['vin']), firmware, time, values['goal_position'],
                   values['torque_enable'], values['temperature'],
                   np.column_stack([values['position'], values['speed'], duty]))

    @property
    def steps(self) -> FloatArray:
        """Return the resolution of position, speed and duty, shape (3,)."""
        position = self.firmware.position_step
        return np.array([position, self.firmware.rate_step,
                         max(1.0 / self.firmware.duty_count, self.gain * position)])

    def simulate(self, values: FloatArray, step: float = STEP_S) -> FloatArray:
        """
        Return what a servo with these values (`catalogue.vector`) would have had, shape (n, 4).

        It has position [rad], rate [rad/s], duty and current [A]. The servo starts at rest where
        the measured course starts and then runs free of it, in steps of at most `step` [s].
        """
        out = np.empty((self.time.size, 4))
        swing(values, self.mass, self.length, self.gain, self.supply, self.time, self.goal,
              self.enabled, self.temperature, self.measured[0, POSITION], 0.0, step, out)
        return out

    def error(self, values: FloatArray, step: float = STEP_S) -> float:
        """Return the mean absolute error of the position over the whole run [rad]."""
        miss = np.abs(self.simulate(values, step)[:, 0] - self.measured[:, POSITION])
        return float(np.nan_to_num(miss, nan=10.0).mean())

    def readings(self, values: FloatArray, step: float = STEP_S) -> FloatArray:
        """Return what the servo would have reported, shape (n, 3) like `measured`."""
        run = self.simulate(values, step)
        window = self.firmware.rate_window_s
        past = np.interp(self.time - window, self.time, run[:, 0])
        return np.column_stack([run[:, 0], (run[:, 0] - past) / window, run[:, 2]])
