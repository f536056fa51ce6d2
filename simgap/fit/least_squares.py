# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Robust nonlinear least squares with bounds and Gaussian priors.

The fits are Levenberg-Marquardt steps within a box, with iteratively reweighted residuals. A run
of the machine is expensive and a Jacobian takes many runs. A fit therefore starts from the
Jacobian of a fit nearby and corrects it with Broyden's rank-one updates (C. G. Broyden,
Mathematics of Computation 19, 1965). A fresh Jacobian is taken where a fit has settled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from simgap.fit.box_qp import box_constrained_step
from simgap.fit.noise import whitened
from simgap.machine.contract import FloatArray, Machine, Parameter, Point
from simgap.settings import DEFAULT, FitSettings, SearchSettings, Settings

Jacobian = NDArray[np.float32]


@dataclass(frozen=True)
class FitState:
    """
    Where a fit is.

    Attributes
    ----------
    parameters : what is fitted, m of them
    x : their values, shape (m,)
    residual : measured minus predicted, in standard deviations, shape (n,); zero where nothing
        was measured
    base_jacobian : derivative of the prediction [standard deviations per unit] as last taken,
        shape (n, m); in single precision, because it is large and gives a direction only
    weight : weight of each residual in iteratively reweighted least squares, shape (n,)
    cost : sum of the robust losses (half a chi-square if all are small) and of the priors
    broyden_errors, broyden_directions : the rank-one updates of the Jacobian since then, shapes
        (n,) and (m,) each
    kept_hessian : the Hessian of a state that has dropped its Jacobian

    """

    parameters: tuple[Parameter, ...]
    x: FloatArray
    residual: FloatArray
    base_jacobian: Jacobian
    weight: FloatArray
    cost: float
    broyden_errors: tuple[FloatArray, ...] = ()
    broyden_directions: tuple[FloatArray, ...] = ()
    kept_hessian: FloatArray | None = None

    @property
    def jacobian(self) -> Jacobian:
        """Return the derivative of the prediction, shape (n, m); not kept, to save memory."""
        return _updated(self.base_jacobian, self.broyden_errors, self.broyden_directions)

    @property
    def has_hessian(self) -> bool:
        """Return whether the Hessian is known: a state may have dropped its derivatives."""
        return self.kept_hessian is not None or self.base_jacobian.size > 0

    @cached_property
    def hessian(self) -> FloatArray:
        """Return the Gauss-Newton Hessian without the priors, shape (m, m)."""
        if self.kept_hessian is not None:
            return self.kept_hessian
        return weighted_product(self.jacobian, self.weight)

    def without_jacobian(self, keep_hessian: bool = False) -> FitState:
        """Return the state without its Jacobian, which takes most of the memory."""
        return FitState(self.parameters, self.x, self.residual, np.empty((0, 0), np.float32),
                        self.weight, self.cost,
                        kept_hessian=self.hessian if keep_hessian else None)

    def point(self) -> dict[str, float]:
        """Return the values by name."""
        return _point(self.parameters, self.x)

    def value(self, name: str) -> float:
        """Return one value by name."""
        return self.point()[name]


class LeastSquares:
    """
    The residuals of a machine in its experiments.

    Parameters
    ----------
    machine
        what is fitted
    used
        for each experiment the samples that are fitted, shape (n,) of bool; None for all
    scale
        factor of the expected noise; while the model lacks something strong, the misfit counts
        as noise, so that the nuisances are not bent to imitate it
    settings
        thresholds

    """

    def __init__(self, machine: Machine, used: Sequence[NDArray[np.bool_]] | None = None,
                 scale: float = 1.0, settings: Settings = DEFAULT) -> None:
        """Lay the measured samples out in one row."""
        self.machine = machine
        self.scale = scale
        self.settings = settings
        self.experiments = list(machine.experiments)
        self.sizes = [e.measured.size for e in self.experiments]
        self.ends = np.cumsum(self.sizes)
        self.valid = np.concatenate([
            (np.isfinite(e.measured)
             & (np.ones(e.time.size, bool) if used is None else used[k])[:, np.newaxis]).ravel()
            for k, e in enumerate(self.experiments)])
        self.samples = int(self.valid.sum())
        wanted = [k for k in range(len(self.experiments)) if self.valid[self.rows(k)].any()]
        # where one experiment alone counts, the others need not be simulated
        self._alone = wanted[0] if len(wanted) == 1 else None

    def at_scale(self, scale: float) -> LeastSquares:
        """Return the same problem at another noise scale."""
        return LeastSquares(self.machine, scale=scale, settings=self.settings)

    def of_experiment(self, experiment: int) -> LeastSquares:
        """Return the problem in which one experiment alone counts, at the sensors' own noise."""
        return LeastSquares(self.machine, [
            np.full(e.time.size, k == experiment) for k, e in enumerate(self.experiments)],
            settings=self.settings)

    def best_fitted(self, state: FitState) -> int:
        """Return the experiment with the least loss per sample."""
        return int(np.argmin([
            self.loss(state.residual[self.rows(k)]) / max(self.valid[self.rows(k)].sum(), 1)
            for k in range(len(self.experiments))]))

    def rows(self, experiment: int) -> slice:
        """Return where an experiment's residuals lie."""
        end = int(self.ends[experiment])
        return slice(end - self.sizes[experiment], end)

    def residuals_of(self, state: FitState, experiment: int) -> FloatArray:
        """Return an experiment's residuals, NaN where nothing was measured, shape (n, c)."""
        rows = self.rows(experiment)
        z = np.where(self.valid[rows], state.residual[rows], np.nan)
        return np.asarray(z.reshape(self.experiments[experiment].measured.shape))

    def standardised(self, k: int, predicted: FloatArray | None) -> FloatArray:
        """Return an experiment's residuals in standard deviations, shape (n c,); 0 for none."""
        experiment = self.experiments[k]
        if predicted is None:
            return np.zeros(self.sizes[k])
        z = (experiment.measured - predicted) / (self.scale * experiment.noise)
        for c, colour in enumerate(experiment.colours):
            z[:, c] = whitened(z[:, c], colour)
        z = z.ravel()
        z[~self.valid[self.rows(k)]] = 0.0
        # a prediction that diverged is a bad one, not an error
        bound = self.settings.fit.runaway
        if not np.isfinite(z).all():
            z = np.nan_to_num(z, nan=bound, posinf=bound, neginf=-bound)
        return np.asarray(np.clip(z, -bound, bound, out=z))

    def residuals(self, point: dict[str, float], alone: int | None = None) -> FloatArray:
        """Return the residuals at a point, shape (n,); of one experiment if it is named."""
        alone = self._alone if alone is None else alone
        return self._row(self.machine.simulate([point], None if alone is None else [alone])[0])

    def residuals_at(self, points: Sequence[Point]) -> FloatArray:
        """Return the residuals at several points, simulated together, shape (points, n)."""
        return np.array([self._row(result) for result in self.machine.simulate(points)])

    def _row(self, result: Sequence[FloatArray | None]) -> FloatArray:
        return np.concatenate([self.standardised(k, values) for k, values in enumerate(result)])

    def rescaled(self, state: FitState, scale: float) -> FitState:
        """Return a state of a problem with another noise scale, without its Jacobian."""
        residual = state.residual * (scale / self.scale)
        return replace(state.without_jacobian(), residual=residual,
                       cost=self._cost(residual, state.x, prior_precision(state.parameters)))

    def judged(self, state: FitState) -> FitState:
        """Return a state of a problem with other noise as it is in this one, not fitted."""
        residual = self.residuals(state.point())
        return replace(state.without_jacobian(keep_hessian=True), residual=residual,
                       weight=self.weights(residual),
                       cost=self._cost(residual, state.x, prior_precision(state.parameters)))

    def noise_level(self, residual: FloatArray) -> float:
        """Return the size of residuals in standard deviations of the noise, outliers clipped."""
        z = np.abs(residual[self.valid]) * self.scale
        level = float(np.sqrt(np.mean(z ** 2)))
        for _ in range(10):
            level = float(np.sqrt(np.mean(
                np.minimum(z, self.settings.fit.outlier * level) ** 2)))
        return level

    def leaves_much(self, state: FitState) -> bool:
        """Return whether a fit leaves more than the sensors' noise."""
        return self.noise_level(state.residual) > self.settings.search.wanting

    # -- beginning a fit -----------------------------------------------------------------------

    def jacobian(self, point: dict[str, float], parameters: Sequence[Parameter],
                 residual: FloatArray, central: bool,
                 steps: Mapping[str, float] = MappingProxyType({})) -> Jacobian:
        """
        Return the derivative of the prediction by difference quotients.

        Parameters
        ----------
        point
            where
        parameters
            with respect to what
        residual
            at the point, for one-sided differences
        central
            take central differences where the bounds leave room for them
        steps
            of the difference quotients, by name, where they are not the usual ones

        """
        variants, only, plan = [], [], []
        sizes = [steps.get(item.name, item.step) for item in parameters]
        for j, item in enumerate(parameters):
            here, step = point.get(item.name, 0.0), sizes[j]
            # a value at a bound may be off it by a rounding error
            room = step * (1.0 - 1e-9)
            up = here + room <= item.high
            down = here - room >= item.low
            sides = [s for s, there in ((1.0, up), (-1.0, down)) if there]
            # a tread of a staircase is seen from both sides
            if not central and len(sides) == 2 and not item.least_step:
                sides = sides[:1]
            for side in sides:
                variants.append({**point, item.name: here + side * step})
                only.append(item.experiment)
                plan.append((j, side, len(sides)))
        jacobian = np.zeros((residual.size, len(parameters)), np.float32)
        machine = self.machine.low_fidelity()
        if machine is not self.machine and variants:
            # both runs of a difference must have the same fidelity
            residual = self._row(machine.simulate([point])[0])
        chunk = self.settings.fit.batch
        for first in range(0, len(variants), chunk):
            part = slice(first, first + chunk)
            results = machine.simulate(variants[part], only[part])
            for (j, side, count), result in zip(plan[part], results, strict=True):
                for k, values in enumerate(result):
                    if values is None:
                        continue
                    rows = self.rows(k)
                    change = residual[rows] - self.standardised(k, values)
                    jacobian[rows, j] += side * change / (sizes[j] * count)
        for j, item in enumerate(parameters):
            greatest = float(np.abs(jacobian[:, j]).max(initial=0.0))
            if greatest * sizes[j] < self.settings.fit.dead_column:
                jacobian[:, j] = 0.0
        return jacobian

    def start(self, parameters: Sequence[Parameter], point: dict[str, float],
              jacobian: Jacobian | None = None, central: bool = False) -> FitState:
        """Begin a fit at a point; the Jacobian is taken unless it is given."""
        x = np.array([np.clip(point.get(p.name, 0.0), p.low, p.high) for p in parameters])
        at = _point(parameters, x)
        residual = self.residuals(at)
        if jacobian is None:
            jacobian = self.jacobian(at, parameters, residual, central)
        return self._state(tuple(parameters), x, residual, jacobian, self.weights(residual))

    def start_from(self, known: Sequence[Parameter], columns: Jacobian,
                   others: Sequence[Parameter], point: dict[str, float]) -> FitState:
        """Begin a fit at a point; the derivatives by `known` are given, the others taken."""
        fresh = self.jacobian(point, others, self.residuals(point), central=True)
        return self.start((*known, *others), point, np.column_stack([columns, fresh]))

    def refreshed(self, state: FitState) -> FitState:
        """
        Return the state with a fresh Jacobian and fresh weights.

        Where sticking and slipping bend the prediction, a difference quotient over many standard
        deviations is no derivative. The data that have been fitted tell how small a step may be.
        """
        jacobian = self.jacobian(state.point(), state.parameters, state.residual, False,
                                 self.local_steps(state))
        return self._state(state.parameters, state.x, state.residual, jacobian,
                           self.weights(state.residual))

    def local_steps(self, state: FitState) -> dict[str, float]:
        """Return steps of difference quotients that change the prediction by little, by name."""
        if not state.has_hessian:
            return {}
        options = self.settings.fit
        visible = np.sqrt(np.maximum(np.diag(state.hessian), 1e-30))
        return {p.name: min(max(options.local_step / seen, options.least_step * p.step,
                                p.least_step), p.step)
                for p, seen in zip(state.parameters, visible.tolist(), strict=True)
                if not p.is_shape}

    def extended(self, state: FitState, parameters: Sequence[Parameter],
                 values: Sequence[float], columns: Jacobian) -> FitState:
        """Return the state with more parameters, at these values, with these derivatives."""
        x = np.r_[state.x, values]
        everything = (*state.parameters, *parameters)
        return self._state(everything, x, self.residuals(_point(everything, x)),
                           np.column_stack([state.jacobian, columns]), state.weight)

    def with_columns(self, state: FitState, indices: Sequence[int],
                     columns: Jacobian) -> FitState:
        """Return the state with other derivatives by some of its parameters."""
        jacobian = state.jacobian.copy()
        jacobian[:, indices] = columns
        return self._state(state.parameters, state.x, state.residual, jacobian, state.weight)

    def _state(self, parameters: tuple[Parameter, ...], x: FloatArray, residual: FloatArray,
               jacobian: Jacobian, weight: FloatArray) -> FitState:
        return FitState(parameters, x, residual, jacobian, weight,
                        self._cost(residual, x, prior_precision(parameters)))

    # -- fitting -------------------------------------------------------------------------------

    def fit(self, state: FitState, iterations: int = 10) -> FitState:
        """Run Levenberg-Marquardt iterations until they gain nothing, or this many of them."""
        options = self.settings.fit
        low = np.array([p.low for p in state.parameters])
        high = np.array([p.high for p in state.parameters])
        prior = prior_precision(state.parameters)
        x, residual, cost, weight = state.x, state.residual, state.cost, state.weight
        model = _LocalModel(state, options)
        damping = options.initial_damping
        idle = 0
        for _ in range(iterations):
            gradient = model.gradient(weight * residual, prior * x)
            hessian = model.hessian + np.diag(prior)
            diagonal = np.diag(hessian).copy()
            step = box_constrained_step(hessian + damping * np.diag(diagonal + 1e-12), gradient,
                                        low - x, high - x)
            expected = float(gradient @ step - 0.5 * step @ hessian @ step)
            if not np.any(step) or expected < options.worth_a_step * options.least_gain:
                break
            trial = np.clip(x + step, low, high)
            after = self.residuals(_point(state.parameters, trial))
            trial_cost = self._cost(after, trial, prior)
            gained = cost - trial_cost
            # a failed step corrects the Jacobian, too
            model.update(step, diagonal, residual - after, weight)
            if gained > 0.0:
                x, residual, cost = trial, after, trial_cost
                weight = self.weights(residual)
                model.reweight(weight, weight * residual)
                good = gained > options.good_step * expected
                damping = max(damping / (options.damping_decay if good else 1.0),
                              options.least_damping)
                idle = idle + 1 if gained < options.least_gain else 0
                if idle > options.idle_iterations:
                    break
            else:
                damping = min(max(damping, options.damping_after_failure) * options.damping_growth,
                              options.greatest_damping)
        return FitState(state.parameters, x, residual, model.jacobian, weight, cost,
                        tuple(model.errors), tuple(model.directions))

    def weights(self, residual: FloatArray) -> FloatArray:
        """Return the weight of each residual, shape (n,); 0 where nothing was measured."""
        return robust_weight(residual, self.valid, self.settings.fit.outlier)

    def loss(self, residual: FloatArray) -> float:
        """Return the sum of the robust losses."""
        return robust_loss(residual, self.settings.fit.outlier)

    def _cost(self, residual: FloatArray, x: FloatArray, prior: FloatArray) -> float:
        return self.loss(residual) + float(0.5 * x @ (prior * x))


class _LocalModel:
    """The linear model of the residuals about a fit, with Broyden's updates."""

    def __init__(self, state: FitState, settings: FitSettings) -> None:
        self.jacobian = state.jacobian
        self.hessian = state.hessian.copy()
        # the Jacobian is the given one plus a few outer products of these
        self.errors: list[FloatArray] = []
        self.directions: list[FloatArray] = []
        self._settings = settings
        self._hessian_weight = state.weight
        self._slope = transposed_product(self.jacobian, state.weight * state.residual)

    def gradient(self, weighted_residual: FloatArray, prior_slope: FloatArray) -> FloatArray:
        """Return the gradient of the gain, shape (m,)."""
        gradient = self._slope - prior_slope
        for error, direction in zip(self.errors, self.directions, strict=True):
            gradient += direction * float(error @ weighted_residual)
        return gradient

    def update(self, step: FloatArray, diagonal: FloatArray, change: FloatArray,
               weight: FloatArray) -> None:
        """
        Correct the Jacobian along a step by Broyden's rule, in the metric of the Hessian.

        A step whose prediction was all wrong, past a contact that was or was not made, is not
        used.
        """
        metric = step * diagonal
        length = float(step @ metric)
        predicted = (self.jacobian @ step.astype(np.float32)).astype(np.float64)
        for error, direction in zip(self.errors, self.directions, strict=True):
            predicted += error * float(direction @ step)
        wrong = change - predicted
        if length <= 0.0 or (float(wrong @ (weight * wrong)) >= self._settings.broyden_error
                             * float(predicted @ (weight * predicted))):
            return
        new = metric / length
        weighted = weight * wrong
        cross = transposed_product(self.jacobian, weighted)
        for error, direction in zip(self.errors, self.directions, strict=True):
            cross += direction * float(error @ weighted)
        self.hessian += (np.outer(cross, new) + np.outer(new, cross)
                         + float(wrong @ weighted) * np.outer(new, new))
        self.errors.append(wrong)
        self.directions.append(new)

    def reweight(self, weight: FloatArray, weighted_residual: FloatArray) -> None:
        """Take new weights and residuals; make the Hessian anew if the weights moved much."""
        if float(np.mean(np.abs(weight - self._hessian_weight))) > self._settings.stale_weights:
            self.hessian = weighted_product(
                _updated(self.jacobian, self.errors, self.directions), weight)
            self._hessian_weight = weight
        self._slope = transposed_product(self.jacobian, weighted_residual)


def settled(problem: LeastSquares, state: FitState, options: SearchSettings, passes: int,
            iterations: int) -> FitState:
    """
    Go on with a fit, with fresh derivatives, as long as that gains much.

    Parameters
    ----------
    problem, state
        the fit
    options
        what is much
    passes
        greatest number of fresh Jacobians
    iterations
        of the fit between two of them

    """
    for _ in range(passes):
        before = state.cost
        state = problem.fit(problem.refreshed(state), iterations)
        if before - state.cost < max(options.settled, options.final_gain * before):
            break
    return state


def led(problem: LeastSquares, state: FitState, options: SearchSettings) -> FitState:
    """
    Return a fit that was led out of a local minimum, or the given one if that gains nothing.

    Where motors stick and slip, the cost of a test has many minima, and a slow test holds the fit
    to all of them in one. The cost of a test that moves smoothly leads to its optimum. So the
    test that fits best is fitted alone, and all of them from there. If another one then fits
    best, it leads in its turn.

    Parameters
    ----------
    problem, state
        the fit to all experiments, after it has stopped
    options
        how long a fit goes on

    """
    def fitted(part: LeastSquares, point: Point, target: float = math.inf) -> FitState:
        begun = part.start(state.parameters, with_initial_conditions(part, dict(point)))
        found = part.fit(begun, options.settling_iterations)
        if found.cost >= target:
            return found
        return settled(part, found, options, options.final_passes, options.settling_iterations)

    led_by: set[int] = set()
    while len(led_by) < len(problem.experiments) > 1:
        leader = problem.best_fitted(state)
        if leader in led_by:
            break
        led_by.add(leader)
        ahead = fitted(problem.of_experiment(leader), state.point())
        found = fitted(problem, ahead.point(), state.cost)
        if found.cost > (1.0 - options.first_gain) * state.cost:
            break
        state = found
    return state


def least_cost(problem: LeastSquares, trials: Sequence[dict[str, float]], experiment: int,
               until: float) -> tuple[float, dict[str, float]]:
    """
    Return the least cost among trial points in the first part of one experiment, and its point.

    Parameters
    ----------
    problem
        what is fitted
    trials
        points; the first of them wins a tie
    experiment
        the one that is looked at
    until
        how much of it [s]

    """
    here = problem.experiments[experiment]
    early = (here.time - here.time[0] < until)[:, np.newaxis]
    best, least = trials[0], np.inf
    chunk = problem.settings.fit.batch
    for first in range(0, len(trials), chunk):
        part = trials[first:first + chunk]
        results = problem.machine.simulate(part, [experiment] * len(part), until)
        for trial, result in zip(part, results, strict=True):
            z = problem.standardised(experiment, result[experiment]).reshape(here.measured.shape)
            cost = problem.loss(np.where(early, z, 0.0).ravel())
            if cost < least:
                best, least = trial, cost
    return least, best


def with_initial_conditions(problem: LeastSquares, point: dict[str, float]) -> dict[str, float]:
    """Return a point with the initial conditions that fit the first moments best."""
    until = problem.machine.time_scales.start_s
    for k in range(len(problem.experiments)):
        if not problem.valid[problem.rows(k)].any():
            continue
        for trials in problem.machine.initial_conditions(k):
            _, point = least_cost(
                problem, [point, *({**point, **trial} for trial in trials)], k, until)
    return point


def transposed_product(jacobian: Jacobian, vector: FloatArray) -> FloatArray:
    """Return the product of the transposed Jacobian and a vector, shape (m,)."""
    return np.asarray(jacobian.T @ vector.astype(np.float32), np.float64)


def weighted_product(jacobian: Jacobian, weight: FloatArray,
                     other: Jacobian | None = None) -> FloatArray:
    """Return jacobian^T weight jacobian, or other in place of the second, shape (m, m)."""
    other = jacobian if other is None else other
    return np.asarray(jacobian.T @ (weight.astype(np.float32)[:, np.newaxis] * other), np.float64)


def robust_weight(residual: FloatArray, valid: NDArray[np.bool_], outlier: float) -> FloatArray:
    """Return the derivative of the robust loss by half the squared residual; 0 if not valid."""
    size = np.maximum(np.abs(residual), outlier)
    return np.asarray(np.where(valid, (outlier / size) ** 2, 0.0))


def robust_loss(residual: FloatArray, outlier: float) -> float:
    """
    Return the sum of losses: half the square of small residuals, logarithmic in large ones.

    After a contact that is made too late everything differs for a while. That must not bend what
    else is known.
    """
    size = np.abs(residual)
    large = np.maximum(size, outlier)
    return float(np.sum(np.where(size < outlier, 0.5 * size ** 2,
                                 outlier ** 2 * (0.5 + np.log(large / outlier)))))


def prior_precision(parameters: Sequence[Parameter]) -> FloatArray:
    """Return 1 / prior_sigma^2 of each parameter, 0 without a prior, shape (m,)."""
    return np.array([1.0 / p.prior_sigma ** 2 if p.prior_sigma > 0.0 else 0.0
                     for p in parameters])


def proper_precision(parameters: Sequence[Parameter]) -> FloatArray:
    """Return the prior precision; without a prior that of an even spread within the bounds."""
    prior = prior_precision(parameters)
    # one that is held has no width
    even = np.array([12.0 / max(p.high - p.low, 1e-30) ** 2 for p in parameters])
    return np.where(prior > 0.0, prior, even)


def _updated(jacobian: Jacobian, errors: Sequence[FloatArray],
             directions: Sequence[FloatArray]) -> Jacobian:
    """Return a Jacobian with Broyden's rank-one updates."""
    if not errors:
        return jacobian
    return np.asarray(jacobian + np.array(errors, np.float32).T
                      @ np.array(directions, np.float32))


def _point(parameters: Sequence[Parameter], x: FloatArray) -> dict[str, float]:
    return dict(zip((p.name for p in parameters), x.tolist(), strict=True))
