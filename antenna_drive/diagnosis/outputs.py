# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a run gives, and what sensors read of it whose errors nothing feeds back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from antenna_drive.diagnosis.field_test import FieldTest
from antenna_drive.diagnosis.late_readings import read_at, RipplingTachometer
from antenna_drive.diagnosis.modifiers import SensorReadings
from antenna_drive.diagnosis.sensors import digit_of
from antenna_drive.readings import AT, NAMED
import numpy as np
from simgap.machine.contract import FloatArray

# An encoder's digit differs from the sheet's if it is larger by this factor.
COARSER = 1.3


@dataclass(frozen=True)
class Outputs:
    """
    What a run gives at the output times.

    values : and slopes of n channels, shape (times, n, 2)
    rippling : tachometers with a ripple, by the names of their readings
    """

    values: FloatArray
    rippling: Mapping[str, RipplingTachometer]


def readings_of(test: FieldTest, out: Outputs, errors: SensorReadings,
                digits: FloatArray | None) -> FloatArray:
    """
    Return the readings of a run, shape (n, c).

    test : that was run
    out : of its run, all readings
    errors : of the sensors
    digits : readings of the encoder in digits, shape (n,); None if they tell none
    """
    time, times = test.time, test.output_times
    wanted = time + errors.clock_rate * (time - time[0])
    values = read_at(times, out.values, wanted, errors.late)
    for name, tachometer in out.rippling.items():
        c = AT[name]
        values[:, c] = tachometer.read_at(times, out.values[:, c], wanted, float(errors.late[c]))
    values *= errors.gain
    angle = values[:, AT['encoder']]
    for shape, parts in errors.waves.items():
        angle += shape.along(angle + test.start_angle, parts)
    values += errors.zero
    digit = errors.digit
    if digit > 0.0 and digits is not None:
        # whatever lies within the digit that was read would have been read
        shift = errors.turn * digit
        off = np.nan_to_num(angle - (digits + shift))
        angle -= np.clip(off, -0.5 * digit, 0.5 * digit) + shift
    elif digit > 0.0:
        angle[:] = digit * np.floor(angle / digit + 0.5)
    return values


def coarser_digit(tests: Sequence[FieldTest]) -> float:
    """Return the encoder's digit if it is coarser than its sheet says, else 0 [rad]."""
    digits = [digit_of(test.measured[:, AT['encoder']]) for test in tests]
    known = max(test.sensors.errors(NAMED['encoder']).digit for test in tests)
    seen = [digit for digit in digits if digit > 0.0]
    digit = min(seen, default=0.0)
    return digit if len(seen) == len(tests) and digit > COARSER * known else 0.0
