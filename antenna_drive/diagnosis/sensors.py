# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the sensors: noise, resolution and jitter of the time stamps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from antenna_drive.diagnosis.excitation import CommandedRate
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.readings import Errors, Reading, READINGS, SENSORS
from antenna_drive.recording import sheet as sheets
import numpy as np
from simgap.machine.contract import FloatArray

# A digit is found from at least this many changes of a reading, and each change may differ from a
# multiple of it by this share.
_CHANGES = 12
_WHOLE = 0.05


@dataclass(frozen=True)
class SensorModel:
    """The sensors of a test: `known` holds the numbers of its sheet, or usual ones, by key."""

    known: Mapping[str, float]

    @classmethod
    def of(cls, given: sheets.Sensors | None) -> SensorModel:
        """Take the values of the sheet."""
        known = {}
        for number in (number for sensor in SENSORS for number in sensor.numbers):
            value = getattr(given, number.key, None)
            known[number.key] = number.usual if value is None else value
        return cls(known)

    def errors(self, reading: Reading, true: FloatArray | float = 0.0) -> Errors:
        """Return what the sensor of a reading does to true values."""
        return reading.sensor.errors(
            true, *(self.known[number.key] for number in reading.sensor.numbers))

    def noise(self, clean: FloatArray, slope: FloatArray, jitter: float) -> FloatArray:
        """Return the standard deviation of each reading; arrays of shape (n, c)."""
        noise = np.empty_like(clean)
        for c, reading in enumerate(READINGS):
            noise[:, c] = self.errors(reading, clean[:, c]).deviation
        return np.asarray(np.sqrt(noise ** 2 + (slope * jitter) ** 2))

    def read(self, clean: FloatArray, random: np.random.Generator) -> FloatArray:
        """Return what the sensors would read of true signals, shape (n, c)."""
        found, noise = clean.copy(), random.normal(size=clean.shape)
        for c, reading in enumerate(READINGS):
            errors = self.errors(reading, clean[:, c])
            found[:, c] += errors.scatter * noise[:, c]
            if errors.digit > 0.0:
                found[:, c] = errors.digit * np.round(found[:, c] / errors.digit)
        return found


def jitter_of(command: CommandedRate, time: FloatArray, values: FloatArray) -> float:
    """
    Return by how much time stamps are off [s]: by what an exactly known command differs.

    Where the command tells nothing, a hundredth of the spacing is assumed.
    """
    usual = 0.01 * float(np.median(np.diff(time)))
    if isinstance(command, RecordedCommand):
        return usual
    error = command(time) - values
    slope = (command(time + 1e-4) - command(time - 1e-4)) / 2e-4
    # jumps and corners of the command say nothing about time
    good = (np.abs(error) < 0.02 * np.ptp(values)) & (np.abs(slope) > 0.3 * np.abs(slope).max())
    if np.count_nonzero(good) < 50 or not np.any(slope[good]):
        return usual
    late = error[good] / slope[good]
    return max(float(1.4826 * np.median(np.abs(late - np.median(late)))), 0.1 * usual)


def digit_of(values: FloatArray) -> float:
    """
    Return the digit of which all readings are whole multiples, but for a constant; 0 if none is.

    values : readings in the order in which they were taken, NaN where there is none, shape (n,)
    """
    change = np.abs(np.diff(values[np.isfinite(values)]))
    change = change[change > 0.0]
    if change.size < _CHANGES:
        return 0.0
    digit = float(change.min())
    for _ in range(3):
        # all changes together say it better than the smallest, which is rounded, too
        count = np.round(change / digit)
        digit = float(change @ count / (count @ count))
    off = np.abs(change / digit - np.round(change / digit))
    return digit if float(off.max()) < _WHOLE else 0.0
