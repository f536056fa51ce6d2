# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How a machine answers an input of any course over time: the sum of its answers to pulses."""

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
from simgap.machine.responses import ProcessResponses, Responses

# Pulses of an input of every day in one of an unknown input: it moves what resonates, too.
_FINER = 2
# Times of change in its covariance.
_TIMES = 8


def pulse_responses(machine: Machine, point: Point, place: DisturbanceInput, size: float = 1.0,
                    finer: int = 1) -> list[tuple[Responses, FloatArray]]:
    """Return each test's responses to pulses of a size at a place, and when they peak [s]."""
    scales = replace(machine.time_scales, pulse_s=machine.time_scales.pulse_s / finer)
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


def process(machine: Machine, point: Point) -> list[ProcessResponses | None]:
    """Return of each experiment the response to what acts every day, see `Experiment.process`."""
    found: list[list[ProcessResponses]] = [[] for _ in machine.experiments]
    faster = machine.low_fidelity()
    for place in faster.disturbance_inputs:
        if place.everyday:
            for into, (responses, peaks) in zip(found, pulse_responses(
                    faster, point, place, place.everyday, _FINER), strict=True):
                # it may change at any rate: as much in each octave, between a pulse and the test
                into.append(ProcessResponses(responses, root(
                    peaks.size, np.geomspace(1.0, peaks.size, _TIMES))))
    return [ProcessResponses.of(parts) if parts else None for parts in found]


def with_process(machine: Machine) -> Machine:
    """Return a machine in planned tests, in which what acts every day acts as well."""
    return machine.with_experiments([replace(e, process=part) for e, part in zip(
        machine.experiments, process(machine, {}), strict=True)])


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
