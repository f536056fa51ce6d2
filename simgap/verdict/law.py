# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A law: an unknown input that is a function of something that the machine does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import FloatArray
from simgap.verdict.input_evidence import InputEvidence

# A function has its values at so many places of the range, with straight lines between.
_PLACES = 12
# Places that are hardly reached have no value: their share of the greatest hat.
_REACHED = 0.05
# What an input may be in proportion to.
_FACTORS = ('direction', 'load', 'rate')
Quantities = Mapping[str, Sequence[FloatArray]]


@dataclass(frozen=True)
class Law:
    """An input as a function of one quantity, the same in all tests."""

    by: str  # the quantity
    times: str  # what it is in proportion to; empty for nothing
    evidence: float  # natural logarithm of how much likelier it makes the gap
    at: tuple[float, ...]  # values of the quantity
    values: tuple[float, ...]  # of the input there, over the factor

    def __str__(self) -> str:
        return self.by + (f', in proportion to {self.times}' if self.times else '')


def quantities_of(problem: LeastSquares, point: Mapping[str, float]) -> Quantities:
    """Return what the machine does, by name: values at the samples of each test."""
    found: dict[str, list[FloatArray]] = {}
    for k, experiment in enumerate(problem.experiments):
        own = dict(zip(experiment.channels, problem.machine.predict(point, k).T, strict=True))
        for name, values in {**problem.machine.motion(k).covariates(), **own}.items():
            found.setdefault(name, []).append(np.asarray(values))
    return {name: values for name, values in found.items()
            if len(values) == len(problem.experiments) and np.ptp(np.concatenate(values)) > 0.0}


def likeliest(evidence: InputEvidence, square: FloatArray, slope: FloatArray,
              quantities: Quantities) -> Law | None:
    """Return the likeliest law of an input, given its normal equations; None if none helps."""
    # `quantities` have values at the pulses of each test
    best = None
    factors = {'': None, **{name: quantities[name] for name in _FACTORS if name in quantities}}
    for times, factor in factors.items():
        weight = 1.0 if factor is None else np.concatenate(factor)[:, np.newaxis]
        for by, values in quantities.items():
            if by == times:
                continue
            at, columns = _hats(np.concatenate(values))
            reached = np.abs(weight * columns).max(axis=0)
            kept = reached > _REACHED * reached.max()
            columns = (weight * columns)[:, kept]
            own = columns.T @ square @ columns
            if (size := float(np.trace(own)) / max(len(own), 1)) <= 0.0:
                continue
            found, _, heights = evidence.weighed(own, columns.T @ slope, size)
            found -= evidence.process_error
            if found > (best.evidence if best else 0.0):
                best = Law(by, times, found, tuple(at[kept].tolist()), tuple(heights.tolist()))
    return best


def _hats(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places over a range, and at values, shape (n,), the hats about them, (n, places)."""
    at, step = np.linspace(values.min(), values.max(), _PLACES, retstep=True)
    return at, np.maximum(0.0, 1.0 - np.abs(values[:, np.newaxis] - at) / step)
