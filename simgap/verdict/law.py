# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The likeliest law of an unknown input, linear about a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from simgap.machine.contract import FloatArray, Machine
from simgap.machine.with_law import Law, Quantities, Quantity
from simgap.verdict.input_evidence import InputEvidence

# A function has its values at so many places of the range, with straight lines between.
_PLACES = 12
# Places that are hardly reached have no value: their share of the greatest hat.
REACHED = 0.05
# What an input may be in proportion to.
_FACTORS = ('direction', 'load', 'rate')


def predicted(machine: Machine, point: Mapping[str, float]) -> list[FloatArray]:
    """Return the readings of each test at a point, shape (n, c)."""
    return [machine.predict(point, k) for k in range(len(machine.experiments))]


def quantities_of(machine: Machine, readings: Sequence[FloatArray]) -> Quantities:
    """Return what a machine does where it reads so, by name, at the samples of each test."""
    found: dict[str, Quantity] = {}
    # readings are those of a model, because what was measured has noise
    moving = machine.with_experiments([replace(e, measured=own) for e, own in zip(
        machine.experiments, readings, strict=True)])
    for k, experiment in enumerate(machine.experiments):
        motion, predicted = moving.motion(k), readings[k].T
        # a reading counts, where the motion has a quantity of its name
        seen = {name: (motion.unit(name), own) for name, own in motion.covariates().items()}
        seen |= {name: (unit, own) for name, unit, own in zip(
            experiment.channels, experiment.units, predicted, strict=True)}
        for name, (unit, own) in seen.items():
            found.setdefault(name, Quantity(unit, [])).values.append(np.asarray(own))
    return {name: item for name, item in found.items()
            if len(item.values) == len(machine.experiments)}


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
            if by == times or np.ptp(np.concatenate(quantity.values)) == 0.0:
                continue
            at, columns = _hats(np.concatenate(quantity.values))
            reached = np.abs(weight * columns).max(axis=0)
            kept = reached > REACHED * reached.max()
            columns = (weight * columns)[:, kept]
            own = columns.T @ square @ columns
            if (size := float(np.trace(own)) / max(len(own), 1)) <= 0.0:
                continue
            found = evidence.weighed(own, columns.T @ slope, size)
            if found.evidence > (best.evidence if best else 0.0):
                best = Law(by, times, found.evidence, tuple(at[kept].tolist()),
                           tuple(found.factors.tolist()), tuple(found.deviations.tolist()),
                           quantity.unit, factor.unit, float(at[1] - at[0]), found.spread)
    return best


def _hats(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places over a range, and at values, shape (n,), the hats about them, (n, places)."""
    at, step = np.linspace(values.min(), values.max(), _PLACES, retstep=True)
    return at, np.maximum(0.0, 1.0 - np.abs(values[:, np.newaxis] - at) / step)
