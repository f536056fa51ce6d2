# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a planned test tells of rivals: how badly a wrong one would fit, and what that decides."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg
from simgap.fit.box_qp import box_constrained_step
from simgap.fit.broyden import Jacobian
from simgap.fit.cholesky import ROUNDING
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_model_error
from simgap.fit.state import proper_precision
from simgap.machine.contract import FloatArray, Machine, Point
from simgap.next_test.rivals import known_to, numbers_of
from simgap.search.rival import Rival
from simgap.settings import DEFAULT

# A rival as good as impossible is no less probable than this.
_LEAST = 1e-12
# Gauss-Newton steps, passes with derivatives of their own, what is left of a step without gain,
# and the gain of a step that is the last one [half chi-square].
_STEPS, _PASSES, _SHORTER, _SETTLED = 8, 2, 0.3, 0.01


@dataclass(frozen=True)
class Separation:
    """What a planned test tells of r rivals."""

    prior: FloatArray  # probability of each rival before the test, shape (r,)
    lack: FloatArray  # half the chi-square by which j fits worse than i if i is true, shape (r, r)
    channels: Mapping[str, float]  # share of it that each signal gives
    points: Mapping[tuple[int, int], Point]  # where the fit of j to i ended, by (i, j)

    def posterior(self) -> FloatArray:
        """Return the probability of j if i is true, shape (r, r)."""
        logits = np.log(np.maximum(self.prior, _LEAST)) - self.lack
        weights = np.exp(logits - logits.max(axis=1, keepdims=True))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def expected(self) -> float:
        """Return the probability that the true rival is expected to get, if one of them is."""
        return float(self.prior @ np.diag(self.posterior()))

    def information(self) -> float:
        """Return the information on which rival is true that is expected, in nats."""
        after = np.maximum(np.diag(self.posterior()), _LEAST)
        return float(self.prior @ np.log(after / np.maximum(self.prior, _LEAST)))

    def surely(self, sure: float) -> float:
        """Return how probable it is that the true rival gets at least the probability `sure`."""
        return float(self.prior @ (np.diag(self.posterior()) >= sure))


def separation(machine: Machine, rivals: Sequence[Rival], inflated: float,
               fitted: bool = True) -> Separation:
    """
    Return how well the planned tests of a machine would tell rivals apart.

    Each rival is fitted to the readings of each other one; if not, its numbers stay as they are.
    `inflated` divides differences of the cost. Raises KeyError if the catalogue lacks an effect or
    a form.
    """
    likeliest = max(rivals, key=lambda rival: rival.probability)
    problem = _planned(machine, known_to(machine, likeliest))
    fits = [_Fit(problem, rival, inflated) for rival in rivals]
    prior = np.array([rival.probability for rival in rivals])
    prior = prior / prior.sum()
    lack, ends = np.zeros((len(rivals), len(rivals))), {}
    channels = problem.experiments[0].channels
    power = np.zeros(len(channels))
    for j, fit in enumerate(fits):
        for i, true in enumerate(fits):
            lack[i, j], ends[i, j], rest = fit.to(true, fitted)
            power += prior[i] * np.sum(rest.reshape(-1, power.size) ** 2, axis=0)
    # what a fit of the true rival leaves because it sticks is no evidence against the others
    lack = np.maximum(lack - np.diag(lack)[:, np.newaxis], 0.0)
    parts = power / max(float(power.sum()), _LEAST)
    return Separation(prior, lack, dict(zip(channels, parts.tolist(), strict=True)), ends)


def _planned(machine: Machine, point: Point) -> LeastSquares:
    """Return planned tests with the readings at a point, and with a model's usual error."""
    experiments = [replace(e, measured=machine.predict(point, k))
                   for k, e in enumerate(machine.experiments)]
    return LeastSquares(machine.with_experiments(with_model_error(experiments, DEFAULT.noise)))


class _Fit:
    """A rival that is fitted, from its own numbers and with what is known of them."""

    def __init__(self, problem: LeastSquares, rival: Rival, inflated: float) -> None:
        self._problem, self._inflated = problem, inflated
        self.numbers = numbers_of(problem.machine, rival)
        own = known_to(problem.machine, rival)
        low, high = (np.array([getattr(p, side) for p in self.numbers])
                     for side in ('low', 'high'))
        self._start = np.clip([own.get(p.name, 0.0) for p in self.numbers], low, high)
        self._low, self._high = low - self._start, high - self._start
        self.known = [j for j, p in enumerate(self.numbers) if p.name in rival.names]
        self._precision = np.diag(proper_precision(self.numbers))
        self._zero = np.zeros(self._start.size)
        self._away = self._zero.copy()
        self._residual = problem.residuals(self._point(self._zero))
        if not self.known:
            return
        covariance = rival.covariance_of([self.numbers[j].name for j in self.known])
        scale = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
        unit = np.outer(scale, scale)
        # the digits of a file leave eigenvalues near zero of either sign: well known, not unknown
        values, vectors = linalg.eigh(covariance / unit)
        values = np.maximum(values, ROUNDING * values[-1])
        # the costs are divided by the inflation in the end, which the covariance holds already
        self._precision[np.ix_(self.known, self.known)] = inflated * (
            vectors / values @ vectors.T / unit)
        # a standard deviation along each direction, to one side or the other
        signs = np.random.default_rng(0).choice([-1.0, 1.0], len(self.known))
        self._away[self.known] = scale * (vectors @ (np.sqrt(values) * signs))

    @cached_property
    def first(self) -> tuple[Jacobian, FloatArray]:
        """Return the derivatives at its own numbers, see `_derivatives`."""
        return self._derivatives(self._zero, self._residual)

    def to(self, true: '_Fit', fitted: bool) -> tuple[float, Point, FloatArray]:
        """
        Return what its fit to the true rival leaves [half chi-square], where it ends, the rest.

        If that is itself, it begins a little way off.
        """
        x, here, truth = self._zero, self._residual, true._residual
        if true is self and fitted:
            x = np.clip(self._away, self._low, self._high)
            here = self._problem.residuals(self._point(x))
        rest = here - truth
        cost = self._cost(x, rest)
        for k in range(_PASSES if fitted else 0):
            jacobian, hessian = self._derivatives(x, rest + truth) if k else self.first
            length = 1.0
            for _ in range(_STEPS):
                slope = (rest.astype(np.float32) @ jacobian).astype(float) - self._precision @ x
                step = box_constrained_step(hessian, slope, self._low - x, self._high - x)
                ahead = np.clip(x + length * step, self._low, self._high)
                left = self._problem.residuals(self._point(ahead)) - truth
                gain = cost - self._cost(ahead, left)
                length = 1.0 if gain > 0.0 else _SHORTER * length
                if gain > 0.0:
                    x, rest, cost = ahead, left, cost - gain
                if abs(gain) < _SETTLED:
                    break
        return cost, self._point(x), rest

    def _derivatives(self, x: FloatArray, residual: FloatArray) -> tuple[Jacobian, FloatArray]:
        """Return the Jacobian at a point, and the Hessian with what is known."""
        jacobian = self._problem.jacobian(self._point(x), self.numbers, residual, central=False)
        return jacobian, np.asarray((jacobian.T @ jacobian).astype(float) + self._precision)

    def _point(self, x: FloatArray) -> dict[str, float]:
        return dict(zip((p.name for p in self.numbers), (self._start + x).tolist(), strict=True))

    def _cost(self, x: FloatArray, rest: FloatArray) -> float:
        return 0.5 * float(rest @ rest + x @ self._precision @ x) / self._inflated
