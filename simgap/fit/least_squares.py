# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The residuals of a machine in its experiments, as a nonlinear least-squares problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from simgap.fit.broyden import Jacobian
from simgap.fit.levenberg_marquardt import LevenbergMarquardt
from simgap.fit.robust_loss import robust_level, robust_loss, robust_losses, robust_weight
from simgap.fit.state import FitState, point_of, prior_precision
from simgap.fit.whitener import Whitener
from simgap.machine.contract import FloatArray, Machine, Parameter, Point
from simgap.settings import DEFAULT, Settings


class LeastSquares:
    """
    The residuals of a machine in its experiments.

    scale : factor of the expected noise, above 1 while something strong is missing, so that the
        nuisances are not bent to imitate it
    """

    def __init__(self, machine: Machine, scale: float = 1.0,
                 settings: Settings = DEFAULT) -> None:
        self.machine = machine
        self.scale = scale
        self.settings = settings
        self.experiments = list(machine.experiments)
        self.sizes = [e.measured.size for e in self.experiments]
        self.ends = np.cumsum(self.sizes)
        self.valid = np.concatenate([np.isfinite(e.measured).ravel() for e in self.experiments])
        self.samples = int(self.valid.sum())
        self._linear: dict[str, Jacobian] = {}  # derivatives by what is linear, shape (n,) each
        self._whiteners = [Whitener(e, self.valid[self.rows(k)], settings.fit.runaway)
                           for k, e in enumerate(self.experiments)]

    def of(self, machine: Machine, scale: float = 1.0) -> LeastSquares:
        """Return the problem of another machine, in all or some of the same tests."""
        other = LeastSquares(machine, scale=scale, settings=self.settings)
        # what makes a test's residuals white takes long to find
        known = {id(own.experiment): own for own in self._whiteners}
        other._whiteners = [known.get(id(own.experiment), own) for own in other._whiteners]
        return other

    def at_noise(self, level: float) -> LeastSquares:
        """Return the problem with a misfit as noise, or the sensors' noise if it is small."""
        return self.of(self.machine, level if level > self.settings.search.strong else 1.0)

    def as_stated(self) -> LeastSquares:
        """Return the same problem with the stated noise, which is white."""
        return LeastSquares(self.machine.with_experiments(
            [replace(e, colours=()) for e in self.experiments]), settings=self.settings)

    def rows(self, experiment: int) -> slice:
        """Return where an experiment's residuals lie."""
        end = int(self.ends[experiment])
        return slice(end - self.sizes[experiment], end)

    def of_test(self, residual: FloatArray, experiment: int) -> FloatArray:
        """Return an experiment's residuals, NaN where nothing was measured, shape (n, c)."""
        rows = self.rows(experiment)
        z = np.where(self.valid[rows], residual[rows], np.nan)
        return np.asarray(z.reshape(self.experiments[experiment].measured.shape))

    def standardised(self, k: int, predicted: FloatArray | None) -> FloatArray:
        """Return an experiment's residuals in standard deviations, shape (n c,); 0 for none."""
        if predicted is None:
            return np.zeros(self.sizes[k])
        own = self._whiteners[k]
        return own.without_process(own.of_sensors(predicted, self.scale), self.scale)

    def whitened(self, k: int, changes: FloatArray) -> FloatArray:
        """Return changes of readings, shape (n, c, m), as residuals have them, shape (n c, m)."""
        return self._whiteners[k].changes(changes, self.scale)

    def residuals(self, point: dict[str, float]) -> FloatArray:
        """Return the residuals at a point, shape (n,)."""
        return self._row(self.machine.simulate([point])[0])

    def residuals_at(self, points: Sequence[Point]) -> FloatArray:
        """Return the residuals at several points, simulated together, shape (points, n)."""
        return np.array([self._row(result) for result in self.machine.simulate(points)])

    def _row(self, result: Sequence[FloatArray | None]) -> FloatArray:
        return np.concatenate([self.standardised(k, values) for k, values in enumerate(result)])

    def noise_level(self, residual: FloatArray) -> float:
        """Return the size of residuals in standard deviations of the noise, outliers clipped."""
        return robust_level(residual[self.valid] * self.scale, self.settings.fit.outlier)

    def jacobian(self, point: dict[str, float], parameters: Sequence[Parameter],
                 residual: FloatArray | None, central: bool,
                 steps: Mapping[str, float] = MappingProxyType({})) -> Jacobian:
        """
        Return the derivative of the prediction at a point by difference quotients, shape (n, m).

        `residual`, at the point if known, serves one-sided differences; `central` takes central
        ones where the bounds leave room. `steps` has unusual steps by name.
        """
        sizes = [steps.get(item.name, item.step) for item in parameters]
        known = self._linear_columns(parameters)
        places = {item.name: j for j, item in enumerate(parameters)}
        shared = {j: places[item.of] for j, item in enumerate(parameters) if item.of in places}
        plan = [(j, item, step, len(own)) for j, item in enumerate(parameters)
                if j not in known and j not in shared
                for own in [_steps(item, point.get(item.name, 0.0), sizes[j], central)]
                for step in own]
        only = [item.experiment for _, item, *_ in plan]
        variants = [{**point, item.name: point.get(item.name, 0.0) + step}
                    for _, item, step, _ in plan]
        machine = self.machine.low_fidelity()
        if variants and (residual is None or machine is not self.machine):
            # both runs of a difference must have the same fidelity
            residual = self._row(machine.simulate([point])[0])
        jacobian = np.zeros((self.valid.size, len(parameters)))
        # what each difference has of the residual at the point, by experiment
        shares = np.zeros((len(self.experiments), len(parameters)))
        chunk = self.settings.fit.batch
        for first in range(0, len(variants), chunk):
            part = slice(first, first + chunk)
            results = machine.simulate(variants[part], only[part])
            for (j, _, step, count), result in zip(plan[part], results, strict=True):
                for k, values in enumerate(result):
                    if values is not None:
                        shares[k, j] += (share := 1.0 / (step * count))
                        jacobian[self.rows(k), j] -= share * self._whiteners[k].of_sensors(
                            values, self.scale)
        for k in range(len(self.experiments)):
            there = np.flatnonzero(jacobian[rows := self.rows(k)].any(axis=0))
            jacobian[rows, there] = self._whiteners[k].without_process(
                jacobian[rows, there], self.scale)
            if residual is not None:
                jacobian[rows] += residual[rows, np.newaxis] * shares[k]
        for j, column in known.items():
            jacobian[:, j] = column
        for j, place in shared.items():
            own = self._with_label(*parameters[j].label or ('', ''))
            jacobian[own, j] = jacobian[own, place]
        greatest = np.maximum(jacobian.max(axis=0, initial=0.0),
                              -jacobian.min(axis=0, initial=0.0))
        jacobian[:, greatest * sizes < self.settings.fit.dead_column] = 0.0
        return jacobian.astype(np.float32)

    def _with_label(self, key: str, value: str) -> NDArray[np.bool_]:
        # a deviation is added to its number in the tests of a label
        return np.repeat([e.labels.get(key, '') == value for e in self.experiments], self.sizes)

    def _linear_columns(self, items: Sequence[Parameter]) -> dict[int, Jacobian]:
        """Return the derivatives by numbers in which the machine is linear, by their places."""
        fresh = [p for p in items if p.name not in self._linear
                 and self.machine.linear_response(p.name, 0) is not None]
        chunk = self.settings.fit.batch
        for first in range(0, len(fresh), chunk):
            part = fresh[first:first + chunk]
            columns = np.zeros((len(part), self.valid.size), np.float32)
            for k in range(len(self.experiments)):
                columns[:, self.rows(k)] = self.whitened(k, np.stack([
                    p.step * np.asarray(self.machine.linear_response(p.name, k)) for p in part],
                    axis=-1)).T
            self._linear |= {p.name: column / p.step
                             for p, column in zip(part, columns, strict=True)}
        return {j: self._linear[p.name] for j, p in enumerate(items) if p.name in self._linear}

    def start(self, parameters: Sequence[Parameter], point: dict[str, float],
              jacobian: Jacobian | None = None, central: bool = False) -> FitState:
        """Begin a fit at a point; the Jacobian is taken unless it is given."""
        x = np.array([np.clip(point.get(p.name, 0.0), p.low, p.high) for p in parameters])
        at = point_of(parameters, x)
        residual = self.residuals(at)
        if jacobian is None:
            jacobian = self.jacobian(at, parameters, residual, central)
        return self._state(tuple(parameters), x, residual, jacobian, self.weights(residual))

    def refreshed(self, state: FitState) -> FitState:
        """Return the state with a fresh Jacobian and fresh weights."""
        # Where sticking and slipping bend the prediction, a difference quotient over many standard
        # deviations is not a derivative. The fitted data show how small a step may be.
        jacobian = self.jacobian(state.point(), state.parameters, state.residual, False,
                                 self.local_steps(state))
        return self._state(state.parameters, state.x, state.residual, jacobian,
                           self.weights(state.residual))

    def local_steps(self, state: FitState) -> dict[str, float]:
        """Return steps of difference quotients that change the prediction by little, by name."""
        options = self.settings.fit
        visible = np.sqrt(np.maximum(np.diag(state.hessian), 1e-30))
        return {p.name: min(max(options.local_step / seen, options.least_step * p.step,
                                p.least_step), p.step)
                for p, seen in zip(state.parameters, visible.tolist(), strict=True)
                if not p.is_shape}

    def with_columns(self, state: FitState, indices: Sequence[int], columns: Jacobian) -> FitState:
        """Return the state with other derivatives by some of its parameters."""
        jacobian = state.jacobian.copy()
        jacobian[:, indices] = columns
        return self._state(state.parameters, state.x, state.residual, jacobian, state.weight)

    def _state(self, parameters: tuple[Parameter, ...], x: FloatArray, residual: FloatArray,
               jacobian: Jacobian, weight: FloatArray) -> FitState:
        return FitState(parameters, x, residual, jacobian, weight,
                        self.cost(residual, x, prior_precision(parameters)))

    def fit(self, state: FitState, iterations: int = 10) -> FitState:
        """Run Levenberg-Marquardt iterations until they gain nothing, or this many of them."""
        return LevenbergMarquardt(self.residuals, self.weights, self.cost,
                                  self.settings.fit).minimised(state, iterations)

    def weights(self, residual: FloatArray) -> FloatArray:
        """Return the weight of each residual, shape (n,); 0 where nothing was measured."""
        return robust_weight(residual, self.valid, self.settings.fit.outlier)

    def loss(self, residual: FloatArray) -> float:
        """Return the sum of the robust losses."""
        return robust_loss(residual, self.settings.fit.outlier)

    def losses(self, residual: FloatArray) -> FloatArray:
        """Return the sum of the robust losses of each signal, shape (c,)."""
        return np.sum([robust_losses(residual[self.rows(k)].reshape(
            e.measured.shape), self.settings.fit.outlier).sum(axis=0)
            for k, e in enumerate(self.experiments)], axis=0)

    def cost(self, residual: FloatArray, x: FloatArray, prior: FloatArray) -> float:
        """Return the sum of the robust losses and of the priors, given their precision."""
        return self.loss(residual) + float(0.5 * x @ (prior * x))


def _steps(number: Parameter, here: float, size: float, central: bool) -> list[float]:
    """Return the steps of a number's difference quotient."""
    # a value at a bound may be off it by a rounding error
    room = size * (1.0 - 1e-9)
    steps = [side * size for side in (1.0, -1.0)
             if number.low <= here + side * room <= number.high]
    # a tread of a staircase is seen from both sides
    return steps if central or number.least_step else steps[:1]
