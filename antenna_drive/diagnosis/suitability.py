# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the columns of a recording can be of this drive: units, and what is in them."""

import math

from antenna_drive.diagnosis.field_recording import FieldRecording, Note
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import NAMED, of, RATE_COMMAND_COLUMN, TACHOMETER
import numpy as np
from simgap.errors import UserError
from simgap.machine.contract import FloatArray

# Rates are compared in means over this time [s], in which oscillations of the drive cancel.
_MEAN_S = 1.0
# Fewer means tell nothing.
_FEWEST = 5
# Two rates are of the same motion from this correlation on, and in other units from this factor
# on. No effect of the catalogue changes a rate by as much.
_ALIKE, _FACTOR = 0.7, 2.0
# The slope of a position follows the rate as closely as this; the position itself does not.
_POSITION = 0.9
# Readings beyond these multiples of their limits are in other units.
_BEYOND_CURRENT, _BEYOND_BIAS = 2.0, 3.0
# What a wrong factor between two rates usually is.
_USUAL = ((180.0 / math.pi, 'degrees for radians'), (math.pi / 180.0, 'radians for degrees'),
          (1e3, 'thousandths for units'), (1e-3, 'units for thousandths'))
_NEAR = 0.2
_COLUMN = {'command': RATE_COMMAND_COLUMN,
           'tachometers': ', '.join(reading.column for reading in of(TACHOMETER)),
           'encoder': NAMED['encoder'].column}
_AMPERES = 'give article amperes, one of which is about six real ones'


def check(recording: FieldRecording, drive: Drive, note: Note) -> None:
    """
    Check that a recording can be of this drive; `note` is called with what is doubtful.

    Raises UserError: a column is in other units or holds something else; the message gives the
    remedy.
    """
    _check_sizes(recording, drive)
    rates = recording.rates.values
    if not np.ptp(rates):
        note(f'{recording.name}: the rate command is {rates[0]:g} rad/s all along: without '
             'reversals little is told; record a test that reverses')
        return
    seen = _rates(recording, drive)
    if seen['command'].size < _FEWEST:
        return
    for name, rate in seen.items():
        if not rate.any():
            note(f'{recording.name}: {_COLUMN[name]} is zero all along, though the axis is '
                 'commanded to move: is it connected?')
    seen = {name: rate for name, rate in seen.items() if rate.any()}
    if 'command' in seen:
        _check_position(recording, seen)
        _check_units(recording, drive, seen)


def _check_sizes(recording: FieldRecording, drive: Drive) -> None:
    share = drive.torque_share.circuit
    for name, limit, beyond, remedy in (
            ('current_1', drive.motor_1.motor.current_limit, _BEYOND_CURRENT, _AMPERES),
            ('current_2', drive.motor_2.motor.current_limit, _BEYOND_CURRENT, _AMPERES),
            ('bias_voltage', share.saturation_high, _BEYOND_BIAS, 'give volts')):
        if name in recording.readings:
            reached = float(np.quantile(np.abs(recording.readings[name].values), 0.99))
            if reached > beyond * limit:
                raise UserError(f'{recording.name}: {NAMED[name].column} reaches {reached:.4g}, '
                                f'the limit of this drive is {limit:.4g}: {remedy}')


def _rates(recording: FieldRecording, drive: Drive) -> dict[str, FloatArray]:
    """Return means of the axis rate as commanded and as each sensor tells it [rad/s]."""
    edges = np.arange(float(recording.time[0]), recording.end, _MEAN_S)
    found = {'command': _means(recording.rates.time_s, recording.rates.values, edges)}
    tachometers = [
        _means(channel.time_s, channel.values, edges) / ratio for name, ratio in (
            ('tach_1', drive.motor_1.gear_ratio), ('tach_2', drive.motor_2.gear_ratio))
        if (channel := recording.readings.get(name)) is not None]
    if tachometers:
        found['tachometers'] = np.mean(tachometers, axis=0)
    encoder = recording.readings.get('encoder')
    if encoder is not None:
        found['encoder'] = np.diff(np.interp(edges, encoder.time_s, encoder.values)) / _MEAN_S
    return found


def _means(time: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Return the means of samples between edges, from their integral."""
    integral = np.r_[0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))]
    return np.diff(np.interp(edges, time, integral)) / np.diff(edges)


def _correlation(a: FloatArray, b: FloatArray) -> float:
    return float(a @ b / math.sqrt((a @ a) * (b @ b) + 1e-300))


def _check_position(recording: FieldRecording, seen: dict[str, FloatArray]) -> None:
    command = seen['command']
    slope = np.gradient(command, _MEAN_S)
    others = [rate for name, rate in seen.items() if name != 'command']
    if others and all(_correlation(slope, rate) > _POSITION
                      and abs(_correlation(command, rate)) < _ALIKE for rate in others):
        raise UserError(f'{recording.name}: {_COLUMN["command"]} holds a position: the axis '
                        'follows its slope; give its derivative in rad/s')


def _check_units(recording: FieldRecording, drive: Drive, seen: dict[str, FloatArray]) -> None:
    """Find the rate that differs from the others by a factor."""
    def factor(name: str, other: str) -> float:
        a, b = seen[name], seen[other]
        size = math.sqrt((a @ a) / (b @ b))
        return size if abs(_correlation(a, b)) > _ALIKE and not (
            1.0 / _FACTOR < size < _FACTOR) else 1.0

    for name in seen:
        others = [other for other in seen if other != name]
        factors = [factor(name, other) for other in others]
        agree = len(others) < 2 or factor(*others) == 1.0
        if others and agree and all(f != 1.0 for f in factors):
            usual = (*_USUAL, (drive.motor_1.gear_ratio, 'rates of the motor for rates of the '
                                                         'axis'),
                     (1.0 / drive.motor_1.gear_ratio, 'rates of the axis for rates of the motor'))
            words = next((f' ({words})' for value, words in usual
                          if abs(math.log(factors[0] / value)) < _NEAR), '')
            raise UserError(
                f'{recording.name}: {_COLUMN[name]} is {factors[0]:.3g} times what '
                f'{" and ".join(_COLUMN[other] for other in others)} and the gear ratio of '
                f'{drive.motor_1.gear_ratio:g} make of it{words}: correct the column')
