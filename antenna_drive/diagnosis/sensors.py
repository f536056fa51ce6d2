# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the sensors: noise, resolution and jitter of the time stamps."""

from __future__ import annotations

from dataclasses import dataclass
import math

from antenna_drive.diagnosis.excitation import CommandedRate
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.recording import sheet as sheets
import numpy as np
from simgap.machine.contract import FloatArray

# A digit is found from at least this many changes of a reading, and each change may differ from a
# multiple of it by this share.
_CHANGES = 12
_WHOLE = 0.05


@dataclass(frozen=True)
class SensorModel:
    """Standard deviations and resolutions; typical ones where the sheet gives none."""

    current_noise: float = 0.01
    current_step: float = 0.01
    tach_noise: float = 0.0035
    tach_relative: float = 0.0015
    tach_step: float = 0.002
    encoder_step: float = 2.0 * math.pi / 2 ** 21
    bias_noise: float = 0.01
    bias_step: float = 0.01

    @classmethod
    def of(cls, given: sheets.Sensors | None) -> SensorModel:
        """Take the values of the sheet."""
        if given is None:
            return cls()
        known = {'current_noise': given.current_noise_A, 'current_step': given.current_step_A,
                 'tach_noise': given.tach_noise_rad_s, 'tach_relative': given.tach_noise_relative,
                 'tach_step': given.tach_step_rad_s, 'bias_noise': given.bias_noise_V,
                 'bias_step': given.bias_step_V}
        if given.encoder_bits is not None:
            known['encoder_step'] = 2.0 * math.pi / 2 ** given.encoder_bits
        return cls(**{name: value for name, value in known.items() if value is not None})

    def noise(self, clean: FloatArray, slope: FloatArray, jitter: float) -> FloatArray:
        """Return the standard deviation of each reading; arrays of shape (n, 6)."""
        noise = np.empty_like(clean)
        noise[:, :2] = math.hypot(self.current_noise, self.current_step / math.sqrt(12.0))
        noise[:, 2:4] = np.sqrt(self.tach_noise ** 2 + self.tach_step ** 2 / 12.0
                                + (self.tach_relative * clean[:, 2:4]) ** 2)
        noise[:, 4] = 0.5 * self.encoder_step  # within a digit the residual is not white
        noise[:, 5] = math.hypot(self.bias_noise, self.bias_step / math.sqrt(12.0))
        return np.asarray(np.sqrt(noise ** 2 + (slope * jitter) ** 2))

    def read(self, clean: FloatArray, random: np.random.Generator) -> FloatArray:
        """Return what the sensors would read of true signals, shape (n, 6)."""
        levels = np.empty_like(clean)
        levels[:, :2] = self.current_noise
        levels[:, 2:4] = np.hypot(self.tach_noise, self.tach_relative * clean[:, 2:4])
        levels[:, 4] = 0.0
        levels[:, 5] = self.bias_noise
        digits = np.array([self.current_step, self.current_step, self.tach_step, self.tach_step,
                           self.encoder_step, self.bias_step])
        noisy = clean + levels * random.normal(size=clean.shape)
        rounded = digits * np.round(noisy / np.where(digits > 0.0, digits, 1.0))
        return np.asarray(np.where(digits > 0.0, rounded, noisy))


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

    Parameters
    ----------
    values
        readings in the order in which they were taken, NaN where there is none, shape (n,)

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
