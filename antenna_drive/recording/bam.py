# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Recordings of a real servo drive in the JSON format of the BAM project (Rhoban).

A position-controlled servo swings a pendulum. A log has mass, length, gain, supply voltage and the
name of the trajectory at the top, then one entry per sample with its own time stamp.
"""

from pathlib import Path
from typing import Any

from antenna_drive.recording.recording import Recording
import numpy as np
from simgap.errors import one_line
from simgap.inputs.plain import from_json, PlainDataError
from simgap.logs.channel import make_channel, nanoseconds, RecordingError
from simgap.logs.text import read_text

# The log's key of each signal, its name and its unit. The load is a register of the servo, 16 bits
# in two's complement; torque_enable is 1 while the servo drives and 0 while it is off.
SIGNALS = {
    'goal_position': ('servo/goal_position', 'rad'),
    'position': ('servo/position', 'rad'),
    'speed': ('servo/speed', 'rad/s'),
    'load': ('servo/load', 'raw'),
    'input_volts': ('servo/input_volts', 'V'),
    'temp': ('servo/temperature', 'degC'),
    'torque_enable': ('servo/torque_enable', '1'),
}
NOTES = {'mass': (int, float), 'length': (int, float), 'kp': (int, float), 'vin': (int, float),
         'motor': (str,), 'trajectory': (str,)}


def read_bam(path: str | Path) -> Recording:
    """
    Read one log of the BAM project.

    Returns the recording; its notes hold mass [kg], length [m], kp, vin [V], motor, trajectory.

    Raises RecordingError: the file cannot be read, is not such a log, or an entry lacks a number;
    one line names the file and the entry.
    """
    path = Path(path)
    try:
        log = from_json(read_text(path))
    except OSError as error:
        raise RecordingError(f'{path}: {error.strerror}') from error
    except PlainDataError as error:
        raise RecordingError(f'{path}: {error}') from None
    if not isinstance(log, dict) or not isinstance(log.get('entries'), list):
        raise RecordingError(f'{path}: no log of a servo, there is no list of entries')
    notes: dict[str, Any] = {'source': path.name}
    for key, kinds in NOTES.items():
        if isinstance(log.get(key), kinds) and not isinstance(log[key], bool):
            notes[key] = log[key]
        else:
            raise RecordingError(f'{path}: {key}: {one_line(repr(log.get(key)), 40)} given, '
                                 f'allowed is a {"text" if kinds == (str,) else "number"}')
    columns: dict[str, list[float]] = {key: [] for key in ('timestamp', *SIGNALS)}
    for number, entry in enumerate(log['entries']):
        for key, column in columns.items():
            column.append(_number(path, number, key, entry))
    try:
        stamps = nanoseconds(np.array(columns.pop('timestamp'), dtype=np.float64))
        return Recording({name: make_channel(name, unit, stamps, columns[key])
                          for key, (name, unit) in SIGNALS.items()}, notes=notes)
    except RecordingError as error:
        raise RecordingError(f'{path}: {error}') from None


def _number(path: Path, number: int, key: str, entry: object) -> float:
    value = entry.get(key) if isinstance(entry, dict) else None
    wanted = bool if key == 'torque_enable' else (int, float)
    if not isinstance(value, wanted) or (isinstance(value, bool) and wanted is not bool):
        raise RecordingError(f'{path}: entry {number}: {key}: {one_line(repr(value), 40)} given, '
                             f'allowed is {"true or false" if wanted is bool else "a number"}')
    try:
        return float(value)
    except OverflowError:
        raise RecordingError(f'{path}: entry {number}: {key}: too large a number') from None
