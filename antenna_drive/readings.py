# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The readings of the drive: what a field test records, one row each.

A new reading is one row of `READINGS`, and a `Sensor` if none here does what its sensor does.
Columns of a CSV, entries of a test sheet, what a diagnosis and a twin compare, noise and zeros,
and the columns of every array of readings follow from the table.
"""

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import Any, NamedTuple

import numpy as np
from simgap.inputs.schema import Entry

# The rate command: no reading, but a column of every field test.
RATE_COMMAND, RATE_COMMAND_COLUMN = 'test_signal/rate_command', 'rate_command_rad_s'


class SheetNumber(NamedTuple):
    """A number that a test sheet may give: its key, what is allowed, and what it usually is."""

    key: str
    entry: Entry
    usual: float


def not_negative(key: str, usual: float, unit: str, description: str,
                 high: float = math.inf) -> SheetNumber:
    """Return a number of a test sheet from 0 to `high`."""
    return SheetNumber(key, Entry(unit, 0.0, high, description), usual)


class Errors(NamedTuple):
    """
    What a sensor does to a true value; numbers, or arrays of the shape of the true values.

    scatter : standard deviation of its noise
    digit : to which it rounds; 0 for none
    deviation : standard deviation of noise and rounding together
    """

    scatter: Any
    digit: float
    deviation: Any


@dataclass(frozen=True)
class Sensor:
    """
    A kind of sensor.

    errors : returns the errors at true values, given `numbers`
    numbers : what a test sheet may say of it
    least, most : no residual counts as quieter, and no value beyond is a reading, in its unit
    zero : what a test sheet may say of the recorder's zero; None: two standard deviations of noise
    is_counter : it counts digits from an unknown angle; a residual at rest is a share of a digit
    """

    errors: Callable[..., Errors]
    numbers: tuple[SheetNumber, ...]
    least: float
    most: float
    zero: SheetNumber | None = None
    is_counter: bool = False


@dataclass(frozen=True)
class Reading:
    """
    One reading.

    name : short, as in a verdict
    signal : of the drive, 'unit/signal'
    column : of a CSV
    unit : SI, article amperes
    label : for people
    sensor : that reads it
    gain : number of the configuration that is the gain of its recorder; empty for none
    instead : signal that stands for it where it was not recorded
    """

    name: str
    signal: str
    column: str
    unit: str
    label: str
    sensor: Sensor
    gain: str = ''
    instead: str = ''


def _noisy(true: Any, noise: float, step: float) -> Errors:
    return Errors(noise, step, math.hypot(noise, step / math.sqrt(12.0)))


def _noisier_with_rate(true: Any, noise: float, relative: float, step: float) -> Errors:
    return Errors(np.hypot(noise, relative * true), step,
                  np.sqrt(noise ** 2 + step ** 2 / 12.0 + (relative * true) ** 2))


def _counted(true: Any, bits: float) -> Errors:
    digit = 2.0 * math.pi / 2 ** bits
    return Errors(0.0, digit, 0.5 * digit)  # within a digit the residual is not white


AMMETER = Sensor(_noisy, (
    not_negative('current_noise_A', 0.01, 'article A', 'noise of each current'),
    not_negative('current_step_A', 0.01, 'article A', 'resolution of each current')), 0.003, 1e3,
    zero=not_negative('current_zero_A', 0.02, 'article A', 'zero of each recorded current'))
TACHOMETER = Sensor(_noisier_with_rate, (
    not_negative('tach_noise_rad_s', 0.0035, 'rad/s', 'noise of each tachometer'),
    not_negative('tach_noise_relative', 0.0015, '1', 'noise per rate', 1.0),
    not_negative('tach_step_rad_s', 0.002, 'rad/s', 'resolution of each tachometer')), 0.001, 1e4)
# the quietest residual is two digits
ENCODER = Sensor(_counted, (SheetNumber('encoder_bits', Entry(
    '1', 1, 64, 'bits per turn of the encoder', whole=True), 21),), 6e-6, 1e2, is_counter=True)
VOLTMETER = Sensor(_noisy, (
    not_negative('bias_noise_V', 0.01, 'V', 'noise of the bias voltage'),
    not_negative('bias_step_V', 0.01, 'V', 'resolution of the bias voltage')), 0.003, 1e3,
    zero=not_negative('bias_zero_V', 0.03, 'V', 'zero of the recorded bias voltage'))

READINGS = (
    Reading('current_1', 'motor_1/ammeter', 'current_1_A', 'article A', 'ammeter 1', AMMETER,
            gain='motor_1.ammeter.gain', instead='motor_1/current'),
    Reading('current_2', 'motor_2/ammeter', 'current_2_A', 'article A', 'ammeter 2', AMMETER,
            gain='motor_2.ammeter.gain', instead='motor_2/current'),
    Reading('tach_1', 'motor_1/tach_rate', 'tach_rate_1_rad_s', 'rad/s', 'tach 1', TACHOMETER),
    Reading('tach_2', 'motor_2/tach_rate', 'tach_rate_2_rad_s', 'rad/s', 'tach 2', TACHOMETER),
    Reading('encoder', 'plant/encoder', 'encoder_rad', 'rad', 'encoder', ENCODER),
    Reading('bias_voltage', 'torque_share/bias_voltage', 'bias_voltage_V', 'V', 'voltmeter',
            VOLTMETER, gain='torque_share.circuit.voltmeter_gain'),
)

NAMED = {reading.name: reading for reading in READINGS}
# Column of each reading in arrays of all of them, shape (n, c).
AT = {reading.name: c for c, reading in enumerate(READINGS)}
SIGNALS = tuple(reading.signal for reading in READINGS)
SENSORS = tuple(dict.fromkeys(reading.sensor for reading in READINGS))
# The columns of a field test beside its time, and the signals that they are.
FIELD_COLUMNS = {RATE_COMMAND_COLUMN: RATE_COMMAND,
                 **{reading.column: reading.signal for reading in READINGS}}


def of(sensor: Sensor) -> tuple[Reading, ...]:
    """Return the readings of a kind of sensor."""
    return tuple(reading for reading in READINGS if reading.sensor == sensor)
