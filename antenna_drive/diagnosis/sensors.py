# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Errors of the sensors: noise, resolution, and samples to be left out.

No drive makes spikes of one sample. A motor at rest creeps, sticks and slips within its gap; when
it slips is decided by differences that no model knows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from antenna_drive.readings import Errors, Reading, READINGS, SENSORS
from antenna_drive.recording import sheet as sheets
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import rank_filter
from simgap.machine.contract import FloatArray

# A digit is found from at least this many changes of a reading, and each change may differ from a
# multiple of it by this share.
_CHANGES = 12
_WHOLE = 0.05
# A spike stands out from the median of its four neighbours by this many of the scatter that all
# samples have about theirs ...
_SCATTERS = 8.0
# ... and by this many times more than any but one of the samples around it does. Nothing in the
# drive is over within one sample: after an edge or an impact its neighbours differ, too.
_AROUND = 3.0
# Samples around it, on both sides together.
_NEIGHBOURHOOD = 20
# A rate at rest is a slip if it is this many times as far from the median as the scatter. If more
# than this share of the samples is, the drive does not rest.
_SLIP, _MOST_SLIPS = 5.0, 0.4
# Below this many samples nothing can be said.
_FEWEST = 3 * _NEIGHBOURHOOD


@dataclass(frozen=True)
class SensorModel:
    """The sensors of a test: `known` holds the numbers of its sheet, or usual ones, by key."""

    known: Mapping[str, float]

    @classmethod
    def of(cls, given: sheets.Sensors | None) -> SensorModel:
        """Take the values of the sheet."""
        usual = {number.key: number.usual for sensor in SENSORS for number in sensor.numbers}
        said = {key: getattr(given, key, None) for key in usual}
        return cls({key: usual[key] if value is None else value for key, value in said.items()})

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


def spikes(values: FloatArray) -> NDArray[np.bool_]:
    """
    Return which samples are spikes: alone, and far from neighbours that agree.

    values : of one channel in the order of time, at the rate at which they were recorded, shape
        (n,)
    """
    if values.size < _FEWEST:
        return np.zeros(values.size, dtype=bool)
    padded = np.pad(values, 2, mode='reflect')
    neighbours = np.sort(np.stack([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]]), axis=0)
    off = np.abs(values - 0.5 * (neighbours[1] + neighbours[2]))
    # digits may hide all scatter of more than half of the samples
    usual = max(1.4826 * float(np.median(off)), float(np.sqrt(np.mean(np.minimum(
        off, np.quantile(off, 0.95)) ** 2))))
    # the ranks around a sample are wanted of few samples only
    found = (off > _SCATTERS * usual) & (off > _AROUND * (neighbours[3] - neighbours[0]))
    if found.any():
        footprint = np.ones(_NEIGHBOURHOOD + 1, dtype=bool)
        footprint[_NEIGHBOURHOOD // 2] = False
        found &= off > _AROUND * rank_filter(off, -2, footprint=footprint, mode='reflect')
    return np.asarray(found)


def slips(rates: FloatArray, noise: float) -> NDArray[np.bool_]:
    """
    Return which samples of a motor at rest are slips.

    rates : of the motor while nothing is commanded, shape (n,) [rad/s], NaN where there is none
    noise : standard deviation that the scatter has at least [rad/s]
    """
    if not np.isfinite(rates).any():
        return np.zeros(rates.size, dtype=bool)
    off = np.abs(rates - np.nanmedian(rates))
    found = off > _SLIP * max(noise, 1.4826 * float(np.nanmedian(off)))
    return found if np.mean(found) < _MOST_SLIPS else np.zeros(rates.size, dtype=bool)
