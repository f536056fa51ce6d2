# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Which effects a set of tests can and cannot tell apart, before the tests are made."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache, partial
import math
from typing import Any

import numpy as np
from scipy.optimize import brentq
from simgap.fit.box_qp import box_constrained_step
from simgap.fit.cholesky import solver
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_model_error
from simgap.fit.state import FitState, prior_precision, proper_precision
from simgap.machine.contract import FloatArray, Machine, Parameter
from simgap.machine.everyday import everyday_of
from simgap.settings import DEFAULT

# A size is found to this share of itself.
_SHARE = 0.01


@dataclass(frozen=True)
class Confusability:
    """What a set of tests can tell of m effects."""

    effects: tuple[str, ...]  # ids
    # shape (m,), least size that shows; infinite if none within bounds does
    detectable: FloatArray
    units: tuple[str, ...]  # of that size, which is the effect's first parameter
    alike: FloatArray  # shape (m, m), share of an effect's squared remainder that another imitates
    limit: float  # share from which two effects count as alike


def confusability(machine: Machine, progress: Callable[[float], None] = lambda share: None,
                  inflated: float = 1.0, among: Collection[str] = ()) -> Confusability:
    """
    Say which effects the tests of a machine can tell apart, with the readings that it predicts.

    `progress` gets the share that is done. `inflated` divides differences of the cost. `among`
    names the effects that are judged; empty for all.
    """
    problem = LeastSquares(machine.with_experiments(
        with_model_error(machine.experiments, DEFAULT.noise)))
    return visibility(problem, problem.start(machine.nuisances, {}), progress, inflated, among)


def visibility(problem: LeastSquares, state: FitState,
               progress: Callable[[float], None] = lambda share: None,
               inflated: float = 1.0, among: Collection[str] = ()) -> Confusability:
    """Say how large each effect must be to show beside `state`, a fit of the nuisances."""
    machine, settings = problem.machine, problem.settings
    # an everyday size would imitate its own effect; up to the tolerance nothing is said to show
    here, state = state.point(), _without_everyday(state)
    imitated = solver(state.hessian + np.diag(proper_precision(state.parameters)))
    price = inflated * settings.evidence.shows
    hessian = state.hessian + np.diag(prior_precision(state.parameters))
    low, high = (np.array([getattr(p, side) for p in state.parameters]) - state.x
                 for side in ('low', 'high'))
    sure = 1.0 - settings.interval.derivative_error ** 2
    asked = [effect for effect in machine.catalogue.values() if not among or effect.id in among]
    forms = [machine.catalogue.typical_form(effect) for effect in asked]
    firsts = [form.parameters[0] for form in forms]
    # an effect that is not there has no shape either: all are looked at from one point
    shapes = {name: value for form in forms for name, value in form.shapes.items() if value}
    columns = problem.jacobian(
        {**here, **shapes}, firsts, state.residual, central=False).astype(float)
    crosses = state.jacobian.T @ columns
    powers, followed, sizes = np.sum(np.square(columns), axis=0), solver(hessian)(crosses), []
    for i, (first, cross, power, step) in enumerate(zip(
            firsts, crosses.T, powers.tolist(), followed.T, strict=True)):
        progress(i / len(asked))
        free = 0.5 * (power * sure - float(cross @ step))
        sizes.append(_least_visible(first, power, free, partial(
            _left, hessian, cross, power * sure, low, high, step, free), price))
    # what nuisances imitate has the price of their priors
    gram = columns.T @ (columns - state.jacobian @ imitated(crosses))
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    alike = (gram / np.outer(size, size)) ** 2
    return Confusability(tuple(effect.id for effect in asked), np.array(sizes),
                         tuple(first.unit for first in firsts), np.asarray(alike),
                         settings.confusability.alike)


def _without_everyday(state: FitState) -> FitState:
    kept = [j for j, p in enumerate(state.parameters) if not everyday_of(p.name)]
    return FitState(tuple(state.parameters[j] for j in kept), state.x[kept], state.residual,
                    state.jacobian[:, kept], state.weight, state.cost)


def _left(hessian: FloatArray, cross: FloatArray, power: float, low: FloatArray, high: FloatArray,
          followed: FloatArray, free: float, size: float) -> float:
    """Return what nuisances within their bounds leave of a size [half chi-square]."""
    if np.all(low <= -size * followed) and np.all(-size * followed <= high):
        return size ** 2 * free
    gradient = -size * cross
    step = box_constrained_step(hessian, gradient, low, high)
    return 0.5 * size ** 2 * power - float(gradient @ step - 0.5 * step @ hessian @ step)


def _least_visible(number: Parameter, power: float, free: float, left: Callable[[float], float],
                   price: float) -> float:
    """Return the size above which an effect exceeds its tolerance and leaves `price`."""
    # `number` is the effect's first, `power` the square of its column, and `left` what is surely
    # left of a size, in halves of a chi-square; of a size of one it is at least `free`, what is
    # left without bounds. Either sign has to show.
    # Where nothing imitates it, a little less: rounding is not to make it visible.
    least = (1.0 - _SHARE) * math.sqrt(2.0 * price / power) if power > 0.0 else math.inf
    least = max(least, number.tolerance)

    def of_sign(sign: float, bound: float) -> float:
        # the root finder asks for both ends again
        @cache
        def surplus(size: float) -> float:
            return math.log(max(left(sign * math.exp(size)), 1e-9) / price)

        if bound <= least:
            return math.inf
        most = math.sqrt(1.1 * price / free) if free > 0.0 else math.inf
        first, last = math.log(least), math.log(max(min(most, bound), least))
        if surplus(first) >= 0.0:
            return least
        # what is left over the square of the size grows with it, so there is one such size
        return (math.exp(brentq(surplus, first, last, xtol=_SHARE)) if surplus(last) > 0.0
                else math.inf)

    return max(of_sign(sign, bound)
               for sign, bound in ((-1.0, -number.low), (1.0, number.high)) if bound > 0.0)


def could_hide(problem: LeastSquares, state: FitState,
               inflated: float = 1.0) -> list[dict[str, Any]]:
    """Return how large each effect could be and still hide in these tests, for the JSON."""
    found = visibility(problem, state, inflated=inflated)
    sized = zip(found.effects, found.detectable.tolist(), found.units, strict=True)
    return [{'effect': effect, 'size': size if math.isfinite(size) else None, 'unit': unit}
            for effect, size, unit in sized]
