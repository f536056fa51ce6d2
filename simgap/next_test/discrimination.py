# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How well a planned test would tell rivals apart."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg
from simgap.fit.cholesky import factored, ROUNDING, solved, solver
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_model_error
from simgap.fit.state import proper_precision
from simgap.machine.contract import FloatArray, Machine, Parameter, Point
from simgap.machine.process import with_process
from simgap.next_test.rivals import known_to, numbers_of
from simgap.next_test.separation import LEAST, prior_of, Separation
from simgap.search.rival import Rival
from simgap.settings import DEFAULT


def separation(machine: Machine, rivals: Sequence[Rival], inflated: float,
               follow: bool = True) -> Separation:
    """
    Return how well the planned tests of a machine would tell rivals apart, to first order.

    `inflated` divides differences of the cost. Without `follow` the numbers stay as they are,
    which is an upper bound without derivatives (Hunter and Reiner). Raises KeyError if the
    catalogue lacks an effect or a form.
    """
    points = [known_to(machine, rival) for rival in rivals]
    problem = planned(with_process(machine) if follow else machine, rivals, points)
    residuals = np.array([problem.residuals(point) for point in points])
    prior, lack = prior_of(rivals), np.zeros((len(rivals), len(rivals)))
    channels = problem.experiments[0].channels
    power = np.zeros(len(channels))
    for j, rival in enumerate(rivals):
        off = residuals[j] - residuals
        price = np.zeros(len(rivals))
        rest = off
        if follow:
            price, rest = _followed(problem, rival, points[j], off, inflated)
        lack[:, j] = 0.5 * (np.sum(rest ** 2, axis=1) + price) / inflated
        power += prior @ np.sum(rest.reshape(len(rivals), -1, power.size) ** 2, axis=1)
    parts = power / max(float(power.sum()), LEAST)
    return Separation(prior, lack, dict(zip(channels, parts.tolist(), strict=True)))


def deviations(machine: Machine, rival: Rival, inflated: float,
               ) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Return a rival's m names, and their covariances before and after tests, shape (m, m)."""
    point = known_to(machine, rival)
    problem = planned(with_process(machine), [rival], [point])
    numbers = numbers_of(machine, rival)
    jacobian = problem.jacobian(point, numbers, None, central=False)
    known = (jacobian.T @ jacobian).astype(float) + _precision(rival, numbers, inflated)
    names = [p.name for p in numbers if p.name in rival.names]
    places = [j for j, p in enumerate(numbers) if p.name in rival.names]
    scale = np.sqrt(np.diag(known))
    unit = np.outer(scale, scale)
    inverse = solved(factored(known / unit, ROUNDING), np.eye(scale.size)) / unit
    return (tuple(names), rival.covariance_of(names),
            np.asarray(inflated * inverse[np.ix_(places, places)]))


def planned(machine: Machine, rivals: Sequence[Rival], points: Sequence[Point]) -> LeastSquares:
    """Return the planned tests as the likeliest rival makes them, with a model's usual error."""
    likeliest = int(np.argmax([rival.probability for rival in rivals]))
    [readings] = machine.simulate([points[likeliest]])
    experiments = [replace(e, measured=values) for e, values in zip(
        machine.experiments, readings, strict=True) if values is not None]
    return LeastSquares(machine.with_experiments(with_model_error(experiments, DEFAULT.noise)))


def _followed(problem: LeastSquares, rival: Rival, point: dict[str, float], off: FloatArray,
              inflated: float) -> tuple[FloatArray, FloatArray]:
    """Return what remains of differences after a rival's numbers have followed them."""
    # The differences `off` are in standard deviations, shape (r, n). What is returned: what the
    # steps away from what is known add to each chi-square, shape (r,), and the differences that
    # are left.
    numbers = numbers_of(problem.machine, rival)
    if not numbers:
        return np.zeros(len(off)), off
    jacobian = problem.jacobian(point, numbers, None, central=False)
    precision = _precision(rival, numbers, inflated)
    known = (jacobian.T @ jacobian).astype(float) + precision
    slopes = (off.astype(np.float32) @ jacobian).astype(float)
    steps = solver(known)(slopes.T).T
    # summed directly: the difference of two large sums in single precision cannot resolve it
    return (np.asarray(np.sum((steps @ precision) * steps, axis=1)),
            np.asarray(off - steps @ jacobian.T))


def _precision(rival: Rival, numbers: Sequence[Parameter], inflated: float) -> FloatArray:
    """Return what is known of a planned test's numbers, from tests so far or from priors."""
    precision = np.diag(proper_precision(numbers))
    places = [j for j, p in enumerate(numbers) if p.name in rival.names]
    if not places:
        return precision
    known = rival.covariance_of([numbers[j].name for j in places])
    scale = np.sqrt(np.maximum(np.diag(known), 1e-30))
    unit = np.outer(scale, scale)
    # the digits of a file leave eigenvalues near zero of either sign: well known, not unknown
    values, vectors = linalg.eigh(known / unit)
    inverse = vectors / np.maximum(values, ROUNDING * values[-1]) @ vectors.T / unit
    # the costs are divided by the inflation in the end, which the covariance holds already
    precision[np.ix_(places, places)] = inverse * inflated
    return precision
