# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Screening: how much of the residual each effect could explain, by its derivative alone."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from simgap.fit.box_qp import box_constrained_step
from simgap.fit.broyden import Jacobian, transposed_product, weighted_product
from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import least_cost
from simgap.fit.state import FitState, prior_precision
from simgap.machine.contract import Effect, FloatArray, Form, Point

# How often a scan looks between the values of a single size that it has tried.
_REFINEMENTS = 10


@dataclass(frozen=True)
class Sensitivity:
    """A form of an effect and the derivatives of the prediction by its parameters."""

    effect: str  # its id
    form: Form  # of the effect
    jacobian: Jacobian  # shape (n, m); zero for shape parameters


def sensitivities(problem: LeastSquares, state: FitState,
                  concurrently: Callable[..., Iterable[Any]] = map) -> list[Sensitivity]:
    """Return the sensitivity to every form of every effect, at the end of a fit."""
    machine = problem.machine
    residuals = [
        state.residual[problem.rows(k)].reshape(e.measured.shape) * e.noise * problem.scale
        for k, e in enumerate(problem.experiments)]
    forms = [(effect.id, form) for effect in machine.catalogue.values()
             for form in machine.catalogue.forms(effect, problem.experiments, residuals)]
    return list(concurrently(
        lambda item: Sensitivity(item[0], item[1], jacobian_of_form(problem, state, item[1])),
        forms))


def jacobian_of_form(problem: LeastSquares, state: FitState, form: Form) -> Jacobian:
    """Return the derivatives by a form's parameters, zero for those of its shape."""
    columns = np.zeros((state.residual.size, len(form.parameters)), np.float32)
    sizes = [j for j, p in enumerate(form.parameters) if not p.is_shape]
    columns[:, sizes] = problem.jacobian(
        {**state.point(), **form.shapes}, [form.parameters[j] for j in sizes], state.residual,
        central=form.scanned)
    return columns


def same_effect(effects: Mapping[str, Effect], effect: str, others: Sequence[str]) -> bool:
    """Return whether an effect is one of the others, or contains or is a part of one."""
    return any(effect == other or effect in effects[other].parts
               or other in effects[effect].parts for other in others)


def screened(problem: LeastSquares, state: FitState, known: Sequence[Sensitivity],
             besides: Sequence[str] = ()) -> list[tuple[float, Sensitivity]]:
    """Return the gain that each form promises beside the effects `besides`, the greatest first."""
    # what the fit would gain without it, because it has not converged, is not part of the promise
    names = {p.name for p in state.parameters}
    low = np.array([p.low for p in state.parameters]) - state.x
    high = np.array([p.high for p in state.parameters]) - state.x
    prior = prior_precision(state.parameters)
    hessian = state.hessian + np.diag(prior)
    jacobian = state.jacobian
    gradient = transposed_product(jacobian, state.weight * state.residual) - prior * state.x
    own_gain = _promised(hessian, gradient, low, high)
    found: dict[str, list[tuple[float, Sensitivity]]] = {}
    for item in known:
        form = item.form
        if same_effect(problem.machine.catalogue, item.effect, besides):
            continue
        if any(p.name in names for p in form.parameters):
            continue  # another effect with the same numbers
        own = item.jacobian[:, [j for j, p in enumerate(form.parameters) if not p.is_shape]]
        cross = weighted_product(jacobian, state.weight, own)
        full = np.block([[hessian, cross], [cross.T, weighted_product(own, state.weight)]])
        slope = np.r_[gradient, transposed_product(own, state.weight * state.residual)]
        gain = _promised(full, slope, np.r_[low, [p.low for p in form.sizes]],
                         np.r_[high, [p.high for p in form.sizes]]) - own_gain
        found.setdefault(item.effect, []).append((gain, item))
    # a screening does not tell the forms of an effect apart: the second one is kept, too
    best = [pair for forms in found.values() for pair in sorted(forms, key=lambda p: -p[0])[:2]]
    return sorted(best, key=lambda pair: -pair[0])


def _promised(hessian: FloatArray, gradient: FloatArray, low: FloatArray,
              high: FloatArray) -> float:
    """Return what the best step within bounds would gain, were the problem linear."""
    step = box_constrained_step(hessian + 1e-9 * np.diag(np.diag(hessian) + 1e-9), gradient,
                                low, high)
    return float(gradient @ step - 0.5 * step @ hessian @ step)


def scan(problem: LeastSquares, state: FitState, known: Sequence[Sensitivity],
         besides: Sequence[str] = ()) -> list[tuple[Sensitivity, dict[str, float]]]:
    """
    Return the forms that fit best once their sizes are tried out far from zero, best first.

    A strong effect may bend the misfit so much that its derivative at zero says nothing. Values
    are sought in the worst test, and each form comes with the sizes from which a fit should begin.
    Parameters are those of `screened`.
    """
    here = state.point()
    count = problem.settings.search.partners
    until = problem.machine.time_scales.scan_s
    worst = int(np.argmax([problem.loss(state.residual[problem.rows(k)])
                           for k in range(len(problem.experiments))]))

    def tried(item: Sensitivity, trials: Sequence[Point]) -> tuple[float, int]:
        """Return the least cost and the number of its trial."""
        points = [{**here, **item.form.start, **trial} for trial in trials]
        cost, best = least_cost(problem, points, worst, until)
        return cost, points.index(best)

    coarse: list[tuple[float, int, Sensitivity]] = []
    for item in known:
        trials = item.form.trials
        if trials and not same_effect(problem.machine.catalogue, item.effect, besides) and not any(
                p.name in here for p in item.form.parameters):
            coarse.append((*tried(item, trials), item))
    coarse.sort(key=lambda entry: entry[0])

    def refined(entry: tuple[float, int, Sensitivity],
                ) -> tuple[float, Sensitivity, dict[str, float]]:
        """Return the best value between the neighbours of the best trial; all tests judge."""
        _, least, item = entry
        [size] = item.form.sizes  # no other form has trials
        grid = [size.low, *(trial[size.name] for trial in item.form.trials), size.high]
        found = {size.name: float(minimize_scalar(
            lambda value: tried(item, [{size.name: value}])[0], method='bounded',
            bounds=(grid[least], grid[least + 2]), options={'maxiter': _REFINEMENTS}).x)}
        total = problem.loss(problem.residuals({**here, **item.form.start, **found}))
        return total, item, found

    fine = sorted(map(refined, coarse[:2 * count]), key=lambda entry: entry[0])
    none = problem.loss(state.residual)
    return [(item, found) for total, item, found in fine[:count] if total < none]
