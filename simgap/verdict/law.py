# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The likeliest law of an unknown input, linear about a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import DisturbanceInput, FloatArray, Machine
from simgap.machine.with_law import Law, Quantities, Quantity, WithLaw
from simgap.verdict.input_evidence import InputEvidence

# A function has its values at so many places of the range, with straight lines between.
_PLACES = 12
# The same of a turn: four for each wave of the greatest order.
_FINEST, _TURN = 800, 2.0 * np.pi
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
        motion, read = moving.motion(k), readings[k].T
        # a reading counts, where the motion has a quantity of its name
        seen = {name: (motion.unit(name), own) for name, own in motion.covariates().items()}
        seen |= {name: (unit, own) for name, unit, own in zip(
            experiment.channels, experiment.units, read, strict=True)}
        for name, (unit, own) in seen.items():
            found.setdefault(name, Quantity(unit, [])).values.append(np.asarray(own))
        for name, (unit, own) in machine.offered(k).items():
            found.setdefault(name, Quantity(unit, [])).values.append(own)
            if unit == 'rad':
                found.setdefault(f'{name} within a turn', Quantity(
                    unit, [], _TURN)).values.append(np.mod(own, _TURN))
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
            if by == times or quantity.period or np.ptp(np.concatenate(quantity.values)) == 0.0:
                continue
            values = np.concatenate(quantity.values)
            at = np.linspace(values.min(), values.max(), _PLACES)
            columns = _hats(values, at)
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


def within_a_turn(evidence: InputEvidence, problem: LeastSquares, point: Mapping[str, float],
                  place: DisturbanceInput, quantities: Quantities) -> Law | None:
    """
    Return the likeliest law of an angle within a turn, a sum of waves; None if none helps.

    It may be finer than pulses in time, because each part of a turn is moved in the simulation.
    """
    best = None
    for by, quantity in quantities.items():
        if not quantity.period:
            continue
        at, step = np.linspace(0.0, quantity.period, _FINEST + 1, retstep=True)
        law = Law(by, '', 0.0, tuple(at.tolist()), (0.0,) * at.size, (), quantity.unit, '',
                  float(step), 1.0)
        weights, effect = law.weights(quantities), law.as_effect(place)
        columns = problem.of(WithLaw(problem.machine, effect, place, weights)).jacobian(
            dict(point), effect.forms[0].parameters, evidence.residual, central=False)
        square, slope = evidence.reduced([
            columns[problem.rows(k)].astype(float) for k in range(len(weights))])
        waves = replace(law, orders=tuple(range(1, _FINEST // 4))).shapes
        everywhere = np.tile(waves, (len(weights), 1))
        square, slope = everywhere.T @ square @ everywhere, everywhere.T @ slope
        found = evidence.orders(square, slope)
        kept = [*found, *(order + waves.shape[1] // 2 for order in found)]
        own = square[np.ix_(kept, kept)]
        if not kept or (weighed := evidence.weighed(
                own, slope[kept], float(np.trace(own)) / len(own))).evidence <= (
                    best.evidence if best else 0.0):
            continue
        values, deviations = waves[:, kept] @ weighed.factors, np.sqrt(
            waves[:, kept] ** 2 @ weighed.deviations ** 2)
        best = replace(law, orders=tuple(order + 1 for order in found), spread=weighed.spread,
                       evidence=weighed.evidence, values=tuple(values.tolist()),
                       deviations=tuple(deviations.tolist()))
    return best


def _hats(values: FloatArray, at: FloatArray) -> FloatArray:
    """Return hats about k places at even distances, at n values, shape (n, k)."""
    return np.maximum(0.0, 1.0 - np.abs(values[:, np.newaxis] - at) / (at[1] - at[0]))
