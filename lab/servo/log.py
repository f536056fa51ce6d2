# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One log of a position-controlled servo with a pendulum, and the servo's readings in it."""

from __future__ import annotations

from dataclasses import dataclass
import math
from pathlib import Path

from antenna_drive.recording.files import import_file, parse_map
from antenna_drive.recording.recording import Recording
from lab.servo.firmware import Firmware, firmware_of
from lab.servo.physics import swing
import numpy as np
from simgap.errors import UserError
from simgap.inputs.plain import from_json
from simgap.logs.text import read_text
from simgap.machine.contract import FloatArray

CHANNELS = ('position', 'speed', 'duty')
UNITS = ('rad', 'rad/s', '1')
POSITION, SPEED, DUTY = range(3)
STEP_S = 2.8e-3
# What a log of the BAM project (Rhoban) has of each sample. The load is a register of 16 bits.
_MAP = parse_map({'time': {'column': 'timestamp'}, 'signals': {
    f'servo/{name}': {'column': name, 'unit': unit} for name, unit in {
        'goal_position': 'rad', 'position': 'rad', 'speed': 'rad/s', 'load': '1',
        'input_volts': 'V', 'temp': '1', 'torque_enable': '1'}.items()}})
_NOTES = {'mass': (int, float), 'length': (int, float), 'kp': (int, float), 'vin': (int, float),
          'motor': (str,), 'trajectory': (str,)}


def read_bam(path: Path) -> Recording:
    """
    Return a log of the BAM project, with mass [kg], length [m], kp, vin [V], motor and trajectory.

    Raises RecordingError: it cannot be read. Raises UserError: one of these is missing.
    """
    recording, above = import_file(path, _MAP), from_json(read_text(path))
    for name, kinds in _NOTES.items():
        if not isinstance(above.get(name), kinds) or isinstance(above[name], bool):
            raise UserError(f'{path}: {name}: {above.get(name)!r} given, allowed is a '
                            f'{"text" if str in kinds else "number"}')
    return Recording(recording.channels, notes={
        **recording.notes, **{name: above[name] for name in _NOTES}})


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
                              'temp', 'load')}
        load = values['load']
        # the register has 16 bits in two's complement
        duty = np.where(load >= 2 ** 15, load - 2 ** 16, load) / firmware.duty_count
        return cls(name, float(notes['kp']), str(notes['trajectory']), float(notes['mass']),
                   float(notes['length']), float(notes['kp']) * firmware.error_gain,
                   float(notes['vin']), firmware, time, values['goal_position'],
                   values['torque_enable'], values['temp'],
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
