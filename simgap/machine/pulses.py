# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How a machine answers an input of any course over time: the sum of its answers to pulses."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg
from simgap.machine.arrays import FloatArray, Point
from simgap.machine.experiment import Experiment
from simgap.machine.machine import DisturbanceInput, Machine
from simgap.machine.motion import TimeScales
from simgap.machine.responses import Responses


def pulse_responses(machine: Machine, point: Point, place: DisturbanceInput, scales: TimeScales,
                    size: float = 1.0) -> list[tuple[Responses, FloatArray]]:
    """Return each test's responses to pulses of a size at a place, and when they peak [s]."""
    calm = [machine.predict(point, k) for k in range(len(machine.experiments))]
    parts: list[list[tuple[float, int, FloatArray]]] = [[] for _ in calm]
    for shift in np.arange(0.0, scales.response_s - 0.5 * scales.pulse_s, scales.pulse_s):
        disturbed = machine.simulate_disturbed(
            point, place, partial(_comb, shift=float(shift), scales=scales, size=size))
        for k, experiment in enumerate(machine.experiments):
            change = np.nan_to_num(disturbed[k] - calm[k])
            parts[k] += _parted(experiment, change, float(shift), scales)
    found = []
    for pulses in parts:
        starts, first, values = zip(*sorted(pulses, key=lambda item: item[0]), strict=True)
        found.append((Responses.of(first, values), np.array(starts) + scales.pulse_s))
    return found


def root(count: int, times: ArrayLike) -> FloatArray:
    """Return a root of the covariance of `count` heights that change within times, in pulses."""
    apart = np.arange(count)[:, np.newaxis]
    covariance = linalg.toeplitz(np.exp(-apart / np.atleast_1d(times)).mean(axis=1))
    return np.asarray(np.linalg.cholesky(covariance + 1e-9 * np.eye(count)))


def _starts(shift: float, end: float, scales: TimeScales) -> Iterator[tuple[float, float]]:
    """Yield when each pulse of a comb begins [s], and its sign."""
    for i, start in enumerate(np.arange(shift, end, scales.response_s)):
        yield float(start), 1.0 if i % 2 == 0 else -1.0


def _comb(time: FloatArray, shift: float, scales: TimeScales, size: float) -> FloatArray:
    """Return pulses of a size and alternating sign, the first beginning at `shift` [s]."""
    rise = scales.pulse_s
    value = np.zeros_like(time)
    for start, sign in _starts(shift, float(time[-1]) + 1.0, scales):
        value += sign * size * np.maximum(0.0, 1.0 - np.abs(time - start - rise) / rise)
    return value


def _parted(experiment: Experiment, change: FloatArray, shift: float,
            scales: TimeScales) -> Iterator[tuple[float, int, FloatArray]]:
    """Yield start, first sample and response of each pulse, without the rest of earlier ones."""
    end = float(experiment.time[-1]) - 2.0 * scales.pulse_s
    for start, sign in _starts(shift, end, scales):
        first, last = np.searchsorted(experiment.time, [start, start + scales.response_s])
        if first < last:  # not before the first sample
            yield start, int(first), sign * (change[first:last] - change[first])
