# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a planned test tells of rivals: how badly a wrong one would fit, and what that decides."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg
from simgap.fit.box_qp import box_constrained_step
from simgap.fit.cholesky import factored, ROUNDING, solved
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_model_error
from simgap.fit.state import proper_precision
from simgap.machine.contract import FloatArray, Machine, Point
from simgap.next_test.rivals import known_to, numbers_of
from simgap.search.rival import Rival
from simgap.settings import DEFAULT

# A rival as good as impossible is no less probable than this.
_LEAST = 1e-12
# Gauss-Newton steps with which a rival follows the readings of another one.
_STEPS = 8


@dataclass(frozen=True)
class Separation:
    """What a planned test tells of r rivals."""

    prior: FloatArray  # probability of each rival before the test, shape (r,)
    lack: FloatArray  # half the chi-square by which j fits worse than i if i is true, shape (r, r)
    promised: FloatArray  # the same to first order
    channels: Mapping[str, float]  # share of it that each signal gives
    points: Mapping[tuple[int, int], Point]  # where the fit of j to i ended, by (i, j)

    def posterior(self) -> FloatArray:
        """Return the probability of j if i is true, shape (r, r)."""
        return _posterior(self.prior, self.lack)

    def expected(self) -> float:
        """Return the probability that the true rival is expected to get, if one of them is."""
        return float(self.prior @ np.diag(self.posterior()))

    def promise(self) -> float:
        """Return the same to first order."""
        return float(self.prior @ np.diag(_posterior(self.prior, self.promised)))

    def information(self) -> float:
        """Return the information on which rival is true that is expected, in nats."""
        after = np.maximum(np.diag(self.posterior()), _LEAST)
        return float(self.prior @ np.log(after / np.maximum(self.prior, _LEAST)))

    def surely(self, sure: float) -> float:
        """Return how probable it is that the true rival gets at least the probability `sure`."""
        return float(self.prior @ (np.diag(self.posterior()) >= sure))


def _posterior(prior: FloatArray, lack: FloatArray) -> FloatArray:
    logits = np.log(np.maximum(prior, _LEAST)) - lack
    weights = np.exp(logits - logits.max(axis=1, keepdims=True))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def separation(machine: Machine, rivals: Sequence[Rival], inflated: float) -> Separation:
    """
    Return how well the planned tests of a machine would tell rivals apart.

    Each rival is fitted to the readings of each other one. `inflated` divides differences of the
    cost. Raises KeyError if the catalogue lacks an effect or a form.
    """
    likeliest = max(rivals, key=lambda rival: rival.probability)
    problem = _planned(machine, known_to(machine, likeliest))
    readings = problem.residuals_at([known_to(machine, rival) for rival in rivals])
    prior = np.array([rival.probability for rival in rivals])
    prior = prior / prior.sum()
    count, channels = len(rivals), problem.experiments[0].channels
    promised, lack = np.zeros((2, count, count))
    ends: dict[tuple[int, int], Point] = {}
    power = np.zeros(len(channels))
    for j, rival in enumerate(rivals):
        fit = _Fit(problem, rival, inflated)
        promised[:, j], lack[:, j], points, rest = fit.to(readings, j)
        ends |= {(i, j): point for i, point in enumerate(points)}
        power += prior @ np.sum(rest.reshape(count, -1, power.size) ** 2, axis=1)
    # what a fit of the true rival leaves because it sticks is no evidence against the others
    lack = np.maximum(lack - np.diag(lack)[:, np.newaxis], 0.0)
    parts = power / max(float(power.sum()), _LEAST)
    return Separation(prior, lack, promised, dict(zip(channels, parts.tolist(), strict=True)),
                      ends)


def deviations(machine: Machine, rival: Rival, inflated: float,
               ) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Return a rival's m names, and their covariances before and after tests, shape (m, m)."""
    fit = _Fit(_planned(machine, known_to(machine, rival)), rival, inflated)
    names = [p.name for p in fit.numbers if p.name in rival.names]
    places = [j for j, p in enumerate(fit.numbers) if p.name in rival.names]
    scale = np.sqrt(np.diag(fit.hessian))
    unit = np.outer(scale, scale)
    inverse = solved(factored(fit.hessian / unit, ROUNDING), np.eye(scale.size)) / unit
    return (tuple(names), rival.covariance_of(names),
            np.asarray(inflated * inverse[np.ix_(places, places)]))


def _planned(machine: Machine, point: Point) -> LeastSquares:
    """Return planned tests with the readings at a point, and with a model's usual error."""
    experiments = [replace(e, measured=machine.predict(point, k))
                   for k, e in enumerate(machine.experiments)]
    return LeastSquares(machine.with_experiments(with_model_error(experiments, DEFAULT.noise)))


class _Fit:
    """Fits of a rival, from its own numbers with what is known of them."""

    def __init__(self, problem: LeastSquares, rival: Rival, inflated: float) -> None:
        self._problem, self._half = problem, 0.5 / inflated
        self.numbers = numbers_of(problem.machine, rival)
        own = known_to(problem.machine, rival)
        self._start = np.array([own.get(p.name, 0.0) for p in self.numbers])
        self._residual = problem.residuals(self._point(self._start))
        self._jacobian = problem.jacobian(self._point(self._start), self.numbers, self._residual,
                                          central=False)
        self._precision = np.diag(proper_precision(self.numbers))
        self._away = np.zeros(self._start.size)
        places = [j for j, p in enumerate(self.numbers) if p.name in rival.names]
        if places:
            known = rival.covariance_of([self.numbers[j].name for j in places])
            scale = np.sqrt(np.maximum(np.diag(known), 1e-30))
            unit = np.outer(scale, scale)
            # the digits of a file leave eigenvalues near zero of either sign: well known, not
            # unknown
            values, vectors = linalg.eigh(known / unit)
            values = np.maximum(values, ROUNDING * values[-1])
            # costs are divided by the inflation in the end, which the covariance holds already
            self._precision[np.ix_(places, places)] = inflated * (
                vectors / values @ vectors.T / unit)
            # a standard deviation along each direction, to one side or the other
            signs = np.random.default_rng(0).choice([-1.0, 1.0], len(places))
            self._away[places] = scale * (vectors @ (np.sqrt(values) * signs))
        self.hessian = (self._jacobian.T @ self._jacobian).astype(float) + self._precision

    def _point(self, values: FloatArray) -> dict[str, float]:
        return dict(zip((p.name for p in self.numbers), values.tolist(), strict=True))

    def to(self, truths: FloatArray, own: int,
           ) -> tuple[FloatArray, FloatArray, list[Point], FloatArray]:
        """
        Fit it to the readings of r rivals, of which `own` are its own, shape (r, n).

        Returns what each fit leaves [half chi-square], to first order and in the end; where it
        ended; and what is left of the readings. Its own are fitted from a little way off.
        """
        low, high = (np.array([getattr(p, side) for p in self.numbers]) - self._start
                     for side in ('low', 'high'))
        x = np.zeros((len(truths), self._start.size))
        rest = self._residual - truths
        step = self._steps(x, rest, low, high)
        promised = self._cost(step, rest - step @ self._jacobian.T)
        step[own] = self._away
        cost, length = np.full(len(truths), np.inf), 1.0
        cost = self._cost(x, rest)
        cost[own] = np.inf
        length = np.ones((len(truths), 1))
        for _ in range(_STEPS):
            trial = np.clip(x + length * step, low, high)
            left = self._problem.residuals_at([
                self._point(self._start + row) for row in trial]) - truths
            after = self._cost(trial, left)
            gained = after < cost
            x[gained], rest[gained], cost[gained] = trial[gained], left[gained], after[gained]
            length = np.where(gained[:, np.newaxis], 1.0, 0.3 * length)
            step = self._steps(x, rest, low, high)
        return promised, cost, [self._point(self._start + row) for row in x], rest

    def _steps(self, x: FloatArray, rest: FloatArray, low: FloatArray,
               high: FloatArray) -> FloatArray:
        slopes = (rest.astype(np.float32) @ self._jacobian).astype(float) - x @ self._precision
        return np.array([box_constrained_step(self.hessian, slope, low - at, high - at)
                         for slope, at in zip(slopes, x, strict=True)])

    def _cost(self, x: FloatArray, rest: FloatArray) -> FloatArray:
        return self._half * (np.sum(rest ** 2, axis=1) + np.sum((x @ self._precision) * x, axis=1))
