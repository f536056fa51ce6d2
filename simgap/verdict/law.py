# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A law: an unknown input that is a function of something that the machine does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import FloatArray
from simgap.verdict.input_evidence import InputEvidence

# A function has its values at so many places of the range, with straight lines between.
_PLACES = 12
# Places that are hardly reached have no value: their share of the greatest hat.
REACHED = 0.05
# What an input may be in proportion to.
_FACTORS = ('direction', 'load', 'rate')


@dataclass(frozen=True)
class Quantity:
    """Something that a machine does: its unit, and its values in each test."""

    unit: str
    values: list[FloatArray]


Quantities = Mapping[str, Quantity]


@dataclass(frozen=True)
class Law:
    """An input as a function of one quantity, the same in all tests."""

    by: str  # the quantity
    times: str  # what it is in proportion to; empty for nothing
    evidence: float  # natural logarithm of how much likelier it makes the gap
    at: tuple[float, ...]  # values of the quantity
    values: tuple[float, ...]  # of the input there, over the factor
    deviations: tuple[float, ...]  # standard deviations of these values
    by_unit: str  # of the quantity
    unit: str  # of the values
    width: float  # of the hats that the function is made of, in by_unit
    spread: float  # standard deviation that the values were thought to have
    # share of what is left of each test that it takes, fitted to the others; None for one test
    withheld: float | None = None

    def __str__(self) -> str:
        return self.by + (f', in proportion to {self.times}' if self.times else '')

    def in_units(self, size: float, unit: str) -> Law:
        """Return the law of an input, one of which is of a size in a unit."""
        per = f'{unit}/({self.unit})' if self.unit else unit
        return replace(self, values=tuple(size * value for value in self.values), unit=per,
                       deviations=tuple(size * value for value in self.deviations),
                       spread=size * self.spread)

    def weights(self, quantities: Quantities) -> list[FloatArray]:
        """Return what one unit of each of the k values adds over time in each test, (n, k)."""
        at = np.array(self.at)
        factors = quantities[self.times].values if self.times else [
            np.ones_like(values) for values in quantities[self.by].values]
        return [factor[:, np.newaxis] * np.maximum(0.0, 1.0 - np.abs(np.clip(
            values, at.min(), at.max())[:, np.newaxis] - at) / self.width)
            for factor, values in zip(factors, quantities[self.by].values, strict=True)]


def quantities_of(problem: LeastSquares, point: Mapping[str, float]) -> Quantities:
    """Return what the machine does, by name, at the samples of each test."""
    found: dict[str, Quantity] = {}
    # the motion of the model, because what was measured has noise
    readings = [problem.machine.predict(point, k) for k in range(len(problem.experiments))]
    moving = problem.machine.with_experiments([replace(e, measured=own) for e, own in zip(
        problem.experiments, readings, strict=True)])
    for k, experiment in enumerate(problem.experiments):
        motion, predicted = moving.motion(k), readings[k].T
        # a reading counts, where the motion has a quantity of its name
        seen = {name: (motion.unit(name), own) for name, own in motion.covariates().items()}
        seen |= {name: (unit, own) for name, unit, own in zip(
            experiment.channels, experiment.units, predicted, strict=True)}
        for name, (unit, own) in seen.items():
            found.setdefault(name, Quantity(unit, [])).values.append(np.asarray(own))
    return {name: item for name, item in found.items()
            if len(item.values) == len(problem.experiments)
            and np.ptp(np.concatenate(item.values)) > 0.0}


def likeliest(evidence: InputEvidence, square: FloatArray, slope: FloatArray,
              quantities: Quantities) -> Law | None:
    """
    Return the likeliest law of an input, given its normal equations; None if none helps.

    `quantities` have values at the m pulses of all tests.
    """
    best = None
    factors = {'': Quantity('', []), **{
        name: quantities[name] for name in _FACTORS if name in quantities}}
    for times, factor in factors.items():
        weight = np.concatenate(factor.values)[:, np.newaxis] if times else 1.0
        for by, quantity in quantities.items():
            if by == times:
                continue
            at, columns = _hats(np.concatenate(quantity.values))
            reached = np.abs(weight * columns).max(axis=0)
            kept = reached > REACHED * reached.max()
            columns = (weight * columns)[:, kept]
            own = columns.T @ square @ columns
            if (size := float(np.trace(own)) / max(len(own), 1)) <= 0.0:
                continue
            found = evidence.weighed(own, columns.T @ slope, size)
            if found.evidence > (best.evidence if best else evidence.process_error):
                best = Law(by, times, found.evidence, tuple(at[kept].tolist()),
                           tuple(found.factors.tolist()), tuple(found.deviations.tolist()),
                           quantity.unit, factor.unit, float(at[1] - at[0]), found.spread)
    return best


def _hats(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places over a range, and at values, shape (n,), the hats about them, (n, places)."""
    at, step = np.linspace(values.min(), values.max(), _PLACES, retstep=True)
    return at, np.maximum(0.0, 1.0 - np.abs(values[:, np.newaxis] - at) / step)
