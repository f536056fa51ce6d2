# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How a machine answers an input of any course over time: the sum of its answers to pulses."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from simgap.machine.arrays import FloatArray, Point
from simgap.machine.experiment import Experiment
from simgap.machine.machine import DisturbanceInput, Machine
from simgap.machine.motion import TimeScales


def pulse_responses(machine: Machine, point: Point, place: DisturbanceInput, size: float = 1.0,
                    ) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the responses to pulses of a size at a place, and when each has its peak [s]."""
    # Both are for each experiment; responses have the shape (n, c, pulses), peaks (pulses,).
    scales = machine.time_scales
    calm = [machine.predict(point, k) for k in range(len(machine.experiments))]
    responses: list[list[FloatArray]] = [[] for _ in calm]
    peaks: list[list[float]] = [[] for _ in calm]
    for shift in np.arange(0.0, scales.response_s - 0.5 * scales.pulse_s, scales.pulse_s):
        disturbed = machine.simulate_disturbed(
            point, place, partial(_comb, shift=float(shift), scales=scales, size=size))
        for k, experiment in enumerate(machine.experiments):
            change = np.nan_to_num(disturbed[k] - calm[k])
            for start, response in _parted(experiment, change, float(shift), scales):
                responses[k].append(response)
                peaks[k].append(start + scales.pulse_s)
    order = [np.argsort(moments) for moments in peaks]
    return ([np.stack([columns[i] for i in rank], axis=-1)
             for columns, rank in zip(responses, order, strict=True)],
            [np.array(moments)[rank] for moments, rank in zip(peaks, order, strict=True)])


def process(machine: Machine, point: Point) -> list[FloatArray | None]:
    """Return of each experiment the response to what acts every day, see `Experiment.process`."""
    found: list[list[FloatArray]] = [[] for _ in machine.experiments]
    faster = machine.low_fidelity()
    for place in faster.disturbance_inputs:
        if place.everyday:
            responses, _ = pulse_responses(faster, point, place, place.everyday)
            changes = place.everyday_s / machine.time_scales.pulse_s
            for columns, into in zip(responses, found, strict=True):
                into.append(columns @ root(columns.shape[-1], changes))
    return [np.concatenate(parts, axis=-1).astype(np.float32) if parts else None
            for parts in found]


def with_process(machine: Machine) -> Machine:
    """Return a machine in planned tests, in which what acts every day acts as well."""
    return machine.with_experiments([replace(e, process=part) for e, part in zip(
        machine.experiments, process(machine, {}), strict=True)])


def root(count: int, pulses: float) -> FloatArray:
    """Return a root of the covariance of `count` heights that change within so many pulses."""
    if not pulses:
        return np.eye(count)
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    return np.asarray(np.linalg.cholesky(np.exp(-apart / pulses) + 1e-9 * np.eye(count)))


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
            scales: TimeScales) -> Iterator[tuple[float, FloatArray]]:
    """Yield start and response of each pulse of a comb, without the rest of earlier pulses."""
    end = float(experiment.time[-1]) - 2.0 * scales.pulse_s
    for start, sign in _starts(shift, end, scales):
        first, last = np.searchsorted(experiment.time, [start, start + scales.response_s])
        if first == last:
            continue  # before the first sample
        response = np.zeros_like(change)
        response[first:last] = sign * (change[first:last] - change[first])
        yield start, response
