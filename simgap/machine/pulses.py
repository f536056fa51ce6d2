# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How a machine answers an input of any course over time: the sum of its answers to pulses.

Slow pulses are simulated one by one, to the end: what they leave, such as an angle, may stay. What
is quicker soon ends, so that many pulses share a run.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg
from simgap.machine.arrays import FloatArray, Point
from simgap.machine.experiment import Experiment
from simgap.machine.machine import DisturbanceInput, Machine
from simgap.machine.motion import TimeScales
from simgap.machine.responses import Answers, Responses


def answers(machine: Machine, point: Point, place: DisturbanceInput, size: float = 1.0,
            finer: int = 1) -> list[Answers]:
    """Return each test's answers to an input at a place, whose heights are of a size."""
    usual = machine.time_scales
    scales = replace(usual, pulse_s=usual.pulse_s / finer, response_s=2.0 * usual.response_s)
    still = [machine.predict(point, k) for k in range(len(machine.experiments))]
    begin = max(0.0, min(float(e.time[0]) for e in machine.experiments) - scales.response_s)
    end = max(float(e.time[-1]) for e in machine.experiments) + usual.response_s
    slow = np.arange(begin, end, usual.response_s)
    alone = [[np.nan_to_num(one - none) for one, none in zip(machine.simulate_disturbed(
        point, place, [partial(_pulse, peak=peak, rise=usual.response_s, size=size)] * len(still)),
        still, strict=True)] for peak in slow.tolist()]
    found = []
    for k, (experiment, (quick, peaks)) in enumerate(zip(
            machine.experiments, _quick(machine, point, place, begin, size, scales, still),
            strict=True)):
        times = np.arange(begin, float(experiment.time[-1]) + scales.pulse_s, scales.pulse_s)
        spread = _pulse(times[:, np.newaxis], slow, usual.response_s)
        reached = np.flatnonzero(spread.any(axis=0))
        share = np.linalg.pinv(spread[:, reached])
        rest = np.eye(times.size) - spread[:, reached] @ share
        whole = np.stack([alone[j][k] for j in reached], axis=-1)
        found.append(Answers(
            [quick, Responses(np.zeros(whole.shape[-1], int), whole)],
            np.concatenate([rest[np.rint((peaks - begin) / scales.pulse_s).astype(int)], share]),
            times))
    return found


def root(count: int, times: ArrayLike) -> FloatArray:
    """Return a root of the covariance of `count` heights that change within times, in pulses."""
    apart = np.arange(count)[:, np.newaxis]
    covariance = linalg.toeplitz(np.exp(-apart / np.atleast_1d(times)).mean(axis=1))
    return np.asarray(np.linalg.cholesky(covariance + 1e-9 * np.eye(count)))


def _quick(machine: Machine, point: Point, place: DisturbanceInput, begin: float, size: float,
           scales: TimeScales, still: list[FloatArray]) -> list[tuple[Responses, FloatArray]]:
    """Return each test's responses to pulses that share runs, and when they peak [s]."""
    parts: list[list[tuple[float, int, FloatArray]]] = [[] for _ in still]
    for shift in np.arange(0.0, scales.response_s - 0.5 * scales.pulse_s, scales.pulse_s):
        first = begin + float(shift)
        disturbed = machine.simulate_disturbed(
            point, place, [partial(_comb, first=first, scales=scales, size=size)] * len(still))
        for k, experiment in enumerate(machine.experiments):
            change = np.nan_to_num(disturbed[k] - still[k])
            parts[k] += _parted(experiment, change, first, scales)
    found = []
    for pulses in parts:
        starts, begins, values = zip(*sorted(pulses, key=lambda item: item[0]), strict=True)
        found.append((Responses.of(begins, values), np.array(starts) + scales.pulse_s))
    return found


def _pulse(time: FloatArray, peak: FloatArray | float, rise: float,
           size: float = 1.0) -> FloatArray:
    """Return a pulse of a size, or several of them."""
    return np.asarray(size * np.maximum(0.0, 1.0 - np.abs(time - peak) / rise))


def _starts(first: float, end: float, scales: TimeScales) -> Iterator[tuple[float, float]]:
    """Yield when each pulse of a comb begins [s], and its sign."""
    for i, start in enumerate(np.arange(first, end, scales.response_s)):
        yield float(start), 1.0 if i % 2 == 0 else -1.0


def _comb(time: FloatArray, first: float, scales: TimeScales, size: float) -> FloatArray:
    """Return pulses of a size and alternating sign, the first beginning at `first` [s]."""
    value = np.zeros_like(time)
    for start, sign in _starts(first, float(time[-1]) + 1.0, scales):
        value += _pulse(time, start + scales.pulse_s, scales.pulse_s, sign * size)
    return value


def _parted(experiment: Experiment, change: FloatArray, first: float,
            scales: TimeScales) -> Iterator[tuple[float, int, FloatArray]]:
    """Yield start, first sample and response of each pulse, without the rest of earlier ones."""
    end = float(experiment.time[-1]) - 2.0 * scales.pulse_s
    for start, sign in _starts(first, end, scales):
        begin, last = np.searchsorted(experiment.time, [start, start + scales.response_s])
        if begin < last:  # not before the first sample
            yield start, int(begin), sign * (change[begin:last] - change[begin])
