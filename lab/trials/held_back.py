# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Judge a corrected configuration on the recording that was kept back.

A verdict may bring predictions of that recording, as CSV files in the folder of the case: `before`
with the configuration as it was, `after` with the corrected one. The fraction of the gap that the
correction closes is computed here, from the recording and the noise that the truth states.
"""

from collections.abc import Mapping
import math
from pathlib import Path
from typing import Any

from lab.antenna.imperfections import SPIKE_SIZE
from lab.antenna.real_antenna import FloatArray
from lab.antenna.sheet import SensorGrade
from lab.joints.machines import kind_of
import numpy as np

# A signal has a gap to close if its mean square exceeds that of the noise by this factor.
GAP = 2.0


class PredictionError(ValueError):
    """A prediction cannot be read or does not cover the recording."""


def _columns(path: Path) -> dict[str, FloatArray]:
    """Return the columns of a CSV with a heading and no empty cell."""
    try:
        with open(path, encoding='utf-8') as stream:
            names = stream.readline().strip().split(',')
            values = np.loadtxt(stream, delimiter=',', ndmin=2)
    except (OSError, ValueError) as error:
        raise PredictionError(f'{path}: {error}') from error
    if values.shape[1:] != (len(names),) or 'time_s' not in names:
        raise PredictionError(f'{path}: a table of time_s and signals is needed')
    return {name: values[:, k] for k, name in enumerate(names)}


def noise_power(column: str, truth: Mapping[str, Any], reading: FloatArray) -> float:
    """Return the mean square of what a recorder adds to a reading (n,), as the truth states."""
    flaws = truth['imperfections']
    low, high = SPIKE_SIZE
    spike = flaws['spike_share'] * (high**3 - low**3) / (3.0 * (high - low))
    if 'machine' in truth:
        kind = kind_of(truth['machine'])
        name = next(name for name in kind.readings if kind.columns[name] == column)
        return (flaws['noise'][name]['level']**2 + spike) * kind.table['noise'][name]**2 + (
            kind.table['digits'][name]**2 / 12.0)
    grade = SensorGrade(**truth['sheets'][-1]['sensors'])
    if column == 'encoder_rad':
        return (2.0 * math.pi / 2**grade.encoder_bits)**2 / 12.0
    noise, digit = {
        'current': (grade.current_noise_A, grade.current_step_A),
        'tach': (grade.tach_noise_rad_s, grade.tach_step_rad_s),
        'bias': (grade.bias_noise_V, grade.bias_step_V)}[column.split('_')[0]]
    power = noise**2
    if column.startswith('tach'):
        power += float(np.mean((grade.tach_noise_relative * reading)**2))
    return (flaws['noise'][column]['level']**2 + spike) * power + digit**2 / 12.0


def closed_fraction(recording: Path, before: Path, after: Path, truth: Mapping[str, Any]) -> float:
    """
    Return the fraction of the gap that a correction closes, from -1 to 1; NaN if there is no gap.

    The mean over the signals with a gap of (E_before - E_after) / (E_before - E_noise), where E is
    a mean square; each is bounded to -1 to 1. Between their rows predictions are straight lines.
    Raise PredictionError where one cannot be read, lacks a signal or ends before the recording.
    """
    recorded, predicted = _columns(recording), [_columns(path) for path in (before, after)]
    time, fractions = recorded['time_s'], []
    slack = 2.0 / truth['sample_rate_hz']
    for path, columns in zip((before, after), predicted):
        if columns['time_s'][0] > time[0] + slack or columns['time_s'][-1] < time[-1] - slack:
            raise PredictionError(f'{path}: does not cover the recording')
    command = ('rate_command_rad_s' if 'machine' not in truth
               else kind_of(truth['machine']).columns['reference'])
    for name in sorted(recorded.keys() - {'time_s', command}):
        if any(name not in columns for columns in predicted):
            raise PredictionError(f'{name}: is not predicted')
        first, last = (
            float(np.mean((recorded[name] - np.interp(time, columns['time_s'], columns[name]))**2))
            for columns in predicted)
        floor = noise_power(name, truth, recorded[name])
        if first > GAP * floor:
            fractions.append(max(-1.0, min(1.0, (first - last) / (first - floor))))
    return float(np.mean(fractions)) if fractions else math.nan
