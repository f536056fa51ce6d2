# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Bounded, robust least squares with derivatives that are used again and again.

A run of the machine is dear and a derivative is many runs. A fit therefore starts from the
derivatives of a fit nearby and corrects them by Broyden's rule as it goes; fresh ones, central
differences all of them, are taken where a fit has settled. Offsets within the tolerance are
fitted together with whatever else is sought, with hard bounds and a mild pull to their middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from antenna_drive.diagnosis.machine import FloatArray, Model, Parameter
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

# Residuals beyond so many standard deviations count by their logarithm: after a contact that was
# made too late everything differs for a while, and must not bend what else is known.
OUTLIER = 3.0
# The curvature is made anew when the weights have changed by so much on the mean.
_STALE = 0.02
# A step corrects the derivatives if its error is less than so much of what was predicted.
_TEACHES = 0.5
# So many variants are simulated at once.
_CHUNK = 16


@dataclass(frozen=True)
class State:
    """
    Where a fit is.

    Attributes
    ----------
    parameters : what is fitted, m of them
    x : their values, shape (m,)
    residual : measured less predicted, in standard deviations, shape (n,); zero where nothing was
        measured
    taken : derivative of the prediction [standard deviations per unit] as it was taken last,
        shape (n, m), in single precision: it is large, and a direction is all that it gives
    weight : robust weight of each residual, shape (n,)
    cost : sum of robust losses, half a chi-square if all are small, and the pull of the offsets
    errors, directions : outer products that the fit has corrected the derivative by, shapes (n,)
        and (m,) each
    kept : the hessian of a state that has let its derivatives go and may be asked for it

    """

    parameters: tuple[Parameter, ...]
    x: FloatArray
    residual: FloatArray
    taken: NDArray[np.float32]
    weight: FloatArray
    cost: float
    errors: tuple[FloatArray, ...] = ()
    directions: tuple[FloatArray, ...] = ()
    kept: FloatArray | None = None

    @cached_property
    def jacobian(self) -> NDArray[np.float32]:
        """Return the derivative of the prediction, shape (n, m)."""
        return _with(self.taken, self.errors, self.directions)

    @cached_property
    def hessian(self) -> FloatArray:
        """Return derivative, weight, derivative, shape (m, m)."""
        return weighted_square(self.jacobian, self.weight) if self.kept is None else self.kept

    def light(self, hessian: bool = False) -> State:
        """Return the state without its derivatives, which take most of the memory."""
        return State(self.parameters, self.x, self.residual, np.empty((0, 0), np.float32),
                     self.weight, self.cost, kept=self.hessian if hessian else None)

    def point(self) -> dict[str, float]:
        """Return the values by name."""
        return dict(zip((p.name for p in self.parameters), self.x.tolist(), strict=True))

    def value(self, name: str) -> float:
        """Return one value by name."""
        return self.point()[name]


class Problem:
    """
    The residuals of a model against its experiments.

    Parameters
    ----------
    model
        the machine
    used
        for each experiment which samples are fitted, shape (n,) of bool; None for all
    scale
        by what the expected noise is multiplied: while a model lacks something strong, what it
        lacks is the noise, and the offsets must not be bent to fit it

    """

    def __init__(self, model: Model, used: Sequence[NDArray[np.bool_]] | None = None,
                 scale: float = 1.0) -> None:
        """Lay the measured samples out in one row."""
        self.model = model
        self.scale = scale
        self.experiments = list(model.experiments)
        self.sizes = [e.measured.size for e in self.experiments]
        self.ends = np.cumsum(self.sizes)
        self.valid = np.concatenate([
            (np.isfinite(e.measured)
             & (np.ones(e.time.size, bool) if used is None else used[k])[:, np.newaxis]).ravel()
            for k, e in enumerate(self.experiments)])
        self.samples = int(self.valid.sum())
        wanted = [k for k in range(len(self.experiments)) if self.valid[self.rows(k)].any()]
        # the one experiment that counts, if it is one: the others need not be simulated
        self._alone = wanted[0] if len(wanted) == 1 else None

    def rows(self, experiment: int) -> slice:
        """Return where an experiment's residuals lie."""
        end = int(self.ends[experiment])
        return slice(end - self.sizes[experiment], end)

    def shaped(self, state: State, experiment: int) -> FloatArray:
        """Return an experiment's residuals, NaN where nothing was measured, shape (n, c)."""
        rows = self.rows(experiment)
        z = np.where(self.valid[rows], state.residual[rows], np.nan)
        return np.asarray(z.reshape(self.experiments[experiment].measured.shape))

    def scaled(self, k: int, predicted: FloatArray | None) -> FloatArray:
        """Return an experiment's residuals, 0 without a measurement or a prediction at all."""
        experiment = self.experiments[k]
        if predicted is None:
            return np.zeros(self.sizes[k])
        z = ((experiment.measured - predicted) / (self.scale * experiment.noise)).ravel()
        z[~self.valid[self.rows(k)]] = 0.0
        # a prediction that has run away is a bad one, not a broken one
        if not np.isfinite(z).all():
            z = np.nan_to_num(z, nan=1e4, posinf=1e4, neginf=-1e4)
        return np.asarray(np.clip(z, -1e4, 1e4, out=z))

    def residuals(self, points: Sequence[dict[str, float]],
                  alone: int | None = None) -> list[FloatArray]:
        """Return the residuals of several variants, shape (n,) each; those of one test alone."""
        alone = self._alone if alone is None else alone
        only = [alone] * len(points) if alone is not None else None
        return [self._row(result) for result in self.model.simulate(points, only)]

    def _row(self, result: Sequence[FloatArray | None]) -> FloatArray:
        return np.concatenate([self.scaled(k, values) for k, values in enumerate(result)])

    def seen(self, state: State, scale: float) -> State:
        """Return a state of another scale as this problem sees it, without derivatives."""
        residual = state.residual * (scale / self.scale)
        return replace(state.light(), residual=residual,
                       cost=_cost(residual, state.x, pull_of(state.parameters)))

    def level(self, residual: FloatArray) -> float:
        """Return the size of residuals in standard deviations; few large ones count less."""
        z = np.abs(residual[self.valid]) * self.scale
        level = float(np.sqrt(np.mean(z ** 2)))
        for _ in range(10):
            level = float(np.sqrt(np.mean(np.minimum(z, OUTLIER * level) ** 2)))
        return level

    def columns(self, point: dict[str, float], parameters: Sequence[Parameter],
                residual: FloatArray, central: bool) -> NDArray[np.float32]:
        """
        Return derivatives of the prediction by difference quotients.

        Parameters
        ----------
        point
            where
        parameters
            by what
        residual
            at the point, for one-sided differences
        central
            take two sides where the bounds leave room for them

        """
        variants, only, plan = [], [], []
        for j, item in enumerate(parameters):
            here = point.get(item.name, 0.0)
            up = here + item.step <= item.high
            down = here - item.step >= item.low
            sides = [s for s, there in ((1.0, up), (-1.0, down)) if there]
            if not central and len(sides) == 2:
                sides = sides[:1]
            for side in sides:
                variants.append({**point, item.name: here + side * item.step})
                only.append(item.experiment)
                plan.append((j, side, len(sides)))
        jacobian = np.zeros((residual.size, len(parameters)), np.float32)
        model = self.model.rough()
        if model is not self.model and variants:
            # a difference of two runs, both of them as rough
            residual = self._row(model.simulate([point])[0])
        for first in range(0, len(variants), _CHUNK):
            part = slice(first, first + _CHUNK)
            results = model.simulate(variants[part], only[part])
            for (j, side, count), result in zip(plan[part], results, strict=True):
                for k, values in enumerate(result):
                    if values is None:
                        continue
                    rows = self.rows(k)
                    change = residual[rows] - self.scaled(k, values)
                    jacobian[rows, j] += side * change / (parameters[j].step * count)
        # less than a thousandth of the noise in all is rounding, no derivative
        for j, item in enumerate(parameters):
            if float(np.abs(jacobian[:, j]).max(initial=0.0)) * item.step < 1e-6:
                jacobian[:, j] = 0.0
        return jacobian

    def start(self, parameters: Sequence[Parameter], point: dict[str, float],
              jacobian: NDArray[np.float32] | None = None, central: bool = False) -> State:
        """Begin a fit at a point; derivatives are taken unless they are given."""
        x = np.array([np.clip(point.get(p.name, 0.0), p.low, p.high) for p in parameters])
        at = dict(zip((p.name for p in parameters), x.tolist(), strict=True))
        residual = self.residuals([at])[0]
        if jacobian is None:
            jacobian = self.columns(at, parameters, residual, central)
        weight = robust_weight(residual, self.valid)
        return _state(tuple(parameters), x, residual, jacobian, weight)

    def begun(self, known: Sequence[Parameter], columns: NDArray[np.float32],
              others: Sequence[Parameter], point: dict[str, float]) -> State:
        """Begin a fit at a point; derivatives by `known` are given, by the others taken."""
        fresh = self.columns(point, others, self.residuals([point])[0], central=True)
        return self.start((*known, *others), point, np.column_stack([columns, fresh]))

    def refreshed(self, state: State, central: bool = True) -> State:
        """Return the state with fresh derivatives and weights."""
        jacobian = self.columns(state.point(), state.parameters, state.residual, central)
        weight = robust_weight(state.residual, self.valid)
        return _state(state.parameters, state.x, state.residual, jacobian, weight)

    def widened(self, state: State, parameters: Sequence[Parameter], values: Sequence[float],
                columns: NDArray[np.float32]) -> State:
        """Return the state with more parameters, at these values, with these derivatives."""
        x = np.r_[state.x, values]
        everything = (*state.parameters, *parameters)
        point = dict(zip((p.name for p in everything), x.tolist(), strict=True))
        residual = self.residuals([point])[0]
        return _state(everything, x, residual, np.column_stack([state.jacobian, columns]),
                      state.weight)

    def replaced(self, state: State, where: Sequence[int],
                 columns: NDArray[np.float32]) -> State:
        """Return the state with other derivatives by some of its parameters."""
        jacobian = state.jacobian.copy()
        jacobian[:, where] = columns
        return _state(state.parameters, state.x, state.residual, jacobian, state.weight)

    def fit(self, state: State, turns: int = 10, gain: float = 1.0) -> State:
        """
        Go downhill until a turn gains less than `gain` in cost, or for so many turns.

        Every run, a failed one too, corrects the derivatives along its own direction.
        """
        low = np.array([p.low for p in state.parameters])
        high = np.array([p.high for p in state.parameters])
        pull = pull_of(state.parameters)
        weight, hessian = state.weight, state.hessian.copy()
        shaped = weight
        x, residual, cost = state.x, state.residual, state.cost
        # The derivatives are those given plus a few outer products of these.
        errors: list[FloatArray] = []
        directions: list[FloatArray] = []
        slope = across(state.jacobian, weight * residual)
        damping = 1e-3
        idle = 0
        for _ in range(turns):
            gradient = slope - pull * x
            for error, direction in zip(errors, directions, strict=True):
                gradient += direction * float(error @ (weight * residual))
            curvature = hessian + np.diag(pull)
            diagonal = np.diag(curvature).copy()
            step = bounded_step(curvature + damping * np.diag(diagonal + 1e-12), gradient,
                                low - x, high - x)
            expected = float(gradient @ step - 0.5 * step @ curvature @ step)
            if not np.any(step) or expected < 0.3 * gain:
                break
            trial = np.clip(x + step, low, high)
            point = dict(zip((p.name for p in state.parameters), trial.tolist(), strict=True))
            after = self.residuals([point])[0]
            trial_cost = _cost(after, trial, pull)
            gained = cost - trial_cost
            # Broyden's rule, in the metric in which all parameters are alike; a step on which the
            # derivatives were all wrong, past a contact that was or was not made, teaches nothing
            metric = step * diagonal
            length = float(step @ metric)
            change = residual - after
            predicted = (state.jacobian @ step.astype(np.float32)).astype(np.float64)
            for error, direction in zip(errors, directions, strict=True):
                predicted += error * float(direction @ step)
            wrong = change - predicted
            if length > 0.0 and (float(wrong @ (weight * wrong))
                                 < _TEACHES * float(predicted @ (weight * predicted))):
                new = metric / length
                weighted = weight * wrong
                cross = across(state.jacobian, weighted)
                for error, direction in zip(errors, directions, strict=True):
                    cross += direction * float(error @ weighted)
                hessian += (np.outer(cross, new) + np.outer(new, cross)
                            + float(wrong @ weighted) * np.outer(new, new))
                errors.append(wrong)
                directions.append(new)
            if gained > 0.0:
                x, residual, cost = trial, after, trial_cost
                now = robust_weight(residual, self.valid)
                if float(np.mean(np.abs(now - shaped))) > _STALE:
                    jacobian = _with(state.jacobian, errors, directions)
                    hessian = weighted_square(jacobian, now)
                    shaped = now
                weight = now
                slope = across(state.jacobian, weight * residual)
                damping = max(damping / (5.0 if gained > 0.5 * expected else 1.0), 1e-6)
                idle = idle + 1 if gained < gain else 0
                if idle > 1:
                    break
            else:
                damping = min(max(damping, 1e-2) * 8.0, 1e4)
        return State(state.parameters, x, residual, state.jacobian, weight, cost,
                     tuple(errors), tuple(directions))


def best_of(problem: Problem, trials: Sequence[dict[str, float]], experiment: int,
            until: float) -> tuple[float, dict[str, float]]:
    """
    Return the least cost that a trial has in the first part of one experiment, and that trial.

    Where a body starts inside a gap, or where a strong effect is, is no matter of going downhill:
    it is tried out.

    Parameters
    ----------
    problem
        what is fitted
    trials
        points, the first of them counts if several are as good
    experiment
        the one that is looked at
    until
        how much of it [s]

    """
    here = problem.experiments[experiment]
    early = (here.time - here.time[0] < until)[:, np.newaxis]
    best, least = trials[0], np.inf
    for first in range(0, len(trials), _CHUNK):
        part = trials[first:first + _CHUNK]
        results = problem.model.simulate(part, [experiment] * len(part), until)
        for trial, result in zip(part, results, strict=True):
            z = problem.scaled(experiment, result[experiment]).reshape(here.measured.shape)
            cost = robust_loss(np.where(early, z, 0.0).ravel())
            if cost < least:
                best, least = trial, cost
    return least, best


def across(jacobian: NDArray[np.float32], vector: FloatArray) -> FloatArray:
    """Return the product of the transposed derivatives and a vector, shape (m,)."""
    return np.asarray(jacobian.T @ vector.astype(np.float32), np.float64)


def weighted_square(jacobian: NDArray[np.float32], weight: FloatArray,
                    other: NDArray[np.float32] | None = None) -> FloatArray:
    """Return derivatives, weight, derivatives (or others), shape (m, m)."""
    other = jacobian if other is None else other
    return np.asarray(jacobian.T @ (weight.astype(np.float32)[:, np.newaxis] * other), np.float64)


def robust_weight(residual: FloatArray, valid: NDArray[np.bool_]) -> FloatArray:
    """Return the weight of each residual, shape (n,); none where nothing was measured."""
    size = np.maximum(np.abs(residual), OUTLIER)
    return np.asarray(np.where(valid, (OUTLIER / size) ** 2, 0.0))


def robust_loss(residual: FloatArray) -> float:
    """Return the sum of losses: half the square of small residuals, logarithmic in large ones."""
    size = np.abs(residual)
    large = np.maximum(size, OUTLIER)
    return float(np.sum(np.where(size < OUTLIER, 0.5 * size ** 2,
                                 OUTLIER ** 2 * (0.5 + np.log(large / OUTLIER)))))


def _with(jacobian: NDArray[np.float32], errors: Sequence[FloatArray],
          directions: Sequence[FloatArray]) -> NDArray[np.float32]:
    """Return derivatives with the corrections that were found on the way."""
    if not errors:
        return jacobian
    return np.asarray(jacobian + np.array(errors, np.float32).T
                      @ np.array(directions, np.float32))


def pull_of(parameters: Sequence[Parameter]) -> FloatArray:
    """Return how strongly each parameter is pulled to nought, 1 / spread^2, shape (m,)."""
    return np.array([1.0 / p.spread ** 2 if p.spread > 0.0 else 0.0 for p in parameters])


def _cost(residual: FloatArray, x: FloatArray, pull: FloatArray) -> float:
    return robust_loss(residual) + float(0.5 * x @ (pull * x))


def _state(parameters: tuple[Parameter, ...], x: FloatArray, residual: FloatArray,
           jacobian: NDArray[np.float32], weight: FloatArray) -> State:
    return State(parameters, x, residual, jacobian, weight,
                 _cost(residual, x, pull_of(parameters)))


def bounded_step(curvature: FloatArray, gradient: FloatArray, low: FloatArray,
                 high: FloatArray) -> FloatArray:
    """
    Return the step d within bounds that maximises gradient d - d curvature d / 2.

    Parameters
    ----------
    curvature
        symmetric and positive definite, shape (m, m)
    gradient
        shape (m,)
    low, high
        bounds of the step, low <= 0 <= high, shape (m,)

    """
    m = gradient.size
    step = np.zeros(m)
    diagonal = np.diag(curvature)
    dead = diagonal <= 1e-30  # what changes nothing stays where it is
    scale = np.where(dead, 0.0, 1.0 / np.sqrt(np.where(dead, 1.0, diagonal)))
    scaled = curvature * np.outer(scale, scale)
    scaled[np.diag_indices(m)] += 1e-12
    room = (high > low) & ~dead
    free = room & ~((low >= 0.0) & (gradient < 0.0)) & ~((high <= 0.0) & (gradient > 0.0))
    for turn in range(4 * m):
        index = np.flatnonzero(free)
        if index.size:
            rest = gradient - curvature @ np.where(free, 0.0, step)
            step[index] = scale[index] * _solved(scaled[np.ix_(index, index)],
                                                 (scale * rest)[index])
        out = free & ((step < low) | (step > high))
        if out.any():
            np.clip(step, low, high, out=step)
            free &= ~out
            continue
        slope = gradient - curvature @ step
        wrong = ~free & room & (((step <= low) & (slope > 0.0)) | ((step >= high) & (slope < 0.0)))
        # what is nearly level gains nothing
        wrong &= np.abs(slope) * scale > 1e-6
        if not wrong.any():
            break
        if turn < _AT_ONCE:
            free |= wrong
        else:
            # one at a time, the steepest: letting all go at once may cycle
            free[np.argmax(np.where(wrong, np.abs(slope) * scale, -1.0))] = True
    return np.asarray(np.clip(step, low, high))


# For so many turns of the search for the active bounds all wrong ones are let go at once.
_AT_ONCE = 12


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Solve for a symmetric matrix, by its Cholesky factor if it has one."""
    factor, failed = linalg.lapack.dpotrf(matrix, lower=1)
    if failed:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-10)[0])
    return np.asarray(linalg.lapack.dpotrs(factor, right, lower=1)[0])
