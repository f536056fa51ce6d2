# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where an unknown input acts: the part of the machine that a gap sits in, whatever its cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

import numpy as np
from scipy import linalg
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import prior_precision
from simgap.machine.contract import DisturbanceInput, FloatArray
from simgap.machine.pulses import pulse_responses, root

# Variances of the input over that of the noise that are tried, and times within which it changes,
# in pulses.
_RATIOS = np.logspace(-4.0, 4.0, 25)
_SMOOTH = (0.0, 5.0)
# Lags by which a reading may predict itself, whatever it is that repeats.
_LAGS = 20
# Pulses of a reading in one test.
_MOST_PULSES = 300
_FIRST = np.eye(1, _LAGS)[0]


@dataclass(frozen=True)
class Place:
    """A place where an unknown input may act."""

    name: str  # for people
    component: str  # the part of the machine
    evidence: float  # natural logarithm of how much likelier an input makes the gap
    explained: float  # share of the gap's energy that it explains, net of what its freedom costs


def places(problem: LeastSquares, point: Mapping[str, float]) -> list[Place]:
    """Return where an unknown input may act, the likeliest first; `point` is of the nuisances."""
    evidence, channels = _Evidence.at(problem, point), problem.experiments[0].channels
    # name, part, evidence and share of the energy
    found = [(place.name, place.component, *evidence.weighed(
        _columns(problem, point, place)[0], _SMOOTH)[:2])
        for place in problem.machine.disturbance_inputs]
    found += [(f'reading of {channel}', channel, *evidence.weighed(
        [_of_reading(problem, k, c) for k in range(len(problem.experiments))])[:2])
        for c, channel in enumerate(channels)]
    # what repeats itself too fast for a pulse, such as a hum, lies in its reading
    most = 2.0 * max(share for *_, share in found)
    repeated = [(f'reading of {channel}', channel, *evidence.repeated(c, problem))
                for c, channel in enumerate(channels)]
    found += [place for place in repeated if place[-1] > most]
    return sorted((Place(name, component, weighed, evidence.net(weighed))
                   for name, component, weighed, _ in found), key=lambda place: -place.evidence)


def courses(problem: LeastSquares, point: Mapping[str, float],
            place: DisturbanceInput) -> list[tuple[FloatArray, FloatArray]]:
    """Return what would have to enter at a place, by test: times [s] and values, (m,) each."""
    evidence = _Evidence.at(problem, point)
    responses, times = _columns(problem, point, place)
    _, _, heights = evidence.weighed(responses, _SMOOTH)
    found, first = [], 0
    for moments in times:
        found.append((moments, heights[first:first + moments.size]))
        first += moments.size
    return found


def _columns(problem: LeastSquares, point: Mapping[str, float],
             place: DisturbanceInput) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the response to each pulse at a place, and when each pulse has its peak [s]."""
    # Both are for each experiment; responses have the shape (n c, pulses), peaks (pulses,).
    responses, peaks = pulse_responses(problem.machine, dict(point), place)
    return [problem.whitened(k, item) for k, item in enumerate(responses)], peaks


def components(found: Sequence[Place], caution: float) -> dict[str, float]:
    """Return how likely each part is, by its best place; all sum to 1."""
    # the share `caution` of the evidence counts, because residuals are not white
    best: dict[str, float] = {}
    for place in found:
        best[place.component] = max(best.get(place.component, 0.0), place.evidence)
    top = max(best.values(), default=0.0)
    weight = {name: float(np.exp(caution * (value - top))) for name, value in best.items()}
    total = sum(weight.values())
    return {name: value / total for name, value in weight.items()}


def _of_reading(problem: LeastSquares, k: int, channel: int) -> FloatArray:
    """Return pulses of a reading itself, one in each column, shape (n c, pulses)."""
    experiment, scales = problem.experiments[k], problem.machine.time_scales
    # the cost grows with the third power of their number
    first, last = float(experiment.time[0]), float(experiment.time[-1])
    rise = max(scales.pulse_s, (last - first) / _MOST_PULSES)
    starts = np.arange(first, last - 2.0 * rise, rise)
    pulses = np.zeros((*experiment.measured.shape, starts.size))
    pulses[:, channel] = experiment.noise[:, channel, np.newaxis] * np.maximum(
        0.0, 1.0 - np.abs(experiment.time[:, np.newaxis] - starts - rise) / rise)
    return problem.whitened(k, pulses)


class _Evidence:
    """The residual that is to be explained, with the nuisances projected out."""

    @classmethod
    def at(cls, problem: LeastSquares, point: Mapping[str, float]) -> _Evidence:
        """Return that of a problem whose nuisances have been fitted."""
        here = dict(point)
        residual = problem.residuals(here)
        level = max(problem.noise_level(residual), 1e-9)
        bound = problem.settings.noise.clip * level
        weight = np.where(problem.valid, np.minimum(
            1.0, bound / np.maximum(np.abs(residual), 1e-12)), 0.0) / level ** 2
        nuisances = problem.machine.nuisances
        jacobian = problem.jacobian(here, nuisances, residual, central=False).astype(float)
        # what is quieter than the noise that is stated is no gap
        stated = np.concatenate([np.tile([colour.level for colour in e.colours]
                                         or np.ones(len(e.channels)), e.time.size)
                                 for e in problem.experiments])
        loud = min(1.0, float(np.mean((stated * residual)[problem.valid] ** 2)))
        return cls(residual, loud, weight, jacobian, prior_precision(nuisances))

    def __init__(self, residual: FloatArray, loud: float, weight: FloatArray,
                 nuisances: FloatArray, prior: FloatArray) -> None:
        self.residual, self._weight = residual, weight
        self._loud = loud
        weighted = nuisances * weight[:, np.newaxis]
        square = nuisances.T @ weighted + np.diag(prior)
        self._inverse = np.linalg.pinv(square, hermitian=True)
        self._slope = weighted.T @ residual
        self._weighted = weighted
        self._energy = float(residual @ (weight * residual)
                             - self._slope @ self._inverse @ self._slope)
        self._count = float(np.count_nonzero(weight))

    def weighed(self, responses: Sequence[FloatArray], smooth: Sequence[float] = (0.0,),
                ) -> tuple[float, float, FloatArray]:
        """Return the evidence for an input, the explained share of the energy, and its factors."""
        # `smooth` has times of change, in pulses
        squares, slopes, crosses, end = [], [], [], 0
        for columns in responses:
            rows = slice(end, end := end + len(columns))
            weighted = columns * self._weight[rows, np.newaxis]
            squares.append(columns.T @ weighted)
            slopes.append(weighted.T @ self.residual[rows])
            crosses.append(self._weighted[rows].T @ columns)
        cross = np.concatenate(crosses, axis=1)
        projected = cross.T @ self._inverse
        square = linalg.block_diag(*squares) - projected @ cross
        slope = np.concatenate(slopes) - projected @ self._slope
        size = float(np.trace(square)) / len(square)
        best, share, heights = 0.0, 0.0, np.zeros(len(square))
        if size <= 0.0:
            return best, share, heights
        for pulses in smooth:
            roots = [root(columns.shape[1], pulses) for columns in responses]
            own = _rows(roots, _rows(roots, square / size).T)
            values, vectors = np.linalg.eigh(0.5 * (own + own.T))
            values = np.maximum(values, 0.0)
            turned = vectors.T @ _rows(roots, slope)
            along = turned ** 2 / size
            for ratio in _RATIOS:
                left = self._energy - float(np.sum(along / (values + 1.0 / ratio)))
                left = max(left / self._energy, 1e-9)
                evidence = -0.5 * (self._count * np.log(left)
                                   + float(np.sum(np.log1p(ratio * values))))
                if evidence > best:
                    best, share = float(evidence), 1.0 - left
                    heights = _rows([root.T for root in roots], vectors @ (
                        turned / (values + 1.0 / ratio))) / size
        return best, share, heights

    def net(self, evidence: float) -> float:
        """Return the share of the energy whose loss alone would be worth this evidence."""
        return self._loud * (1.0 - math.exp(-2.0 * evidence / max(self._count, 1.0)))

    def repeated(self, channel: int, problem: LeastSquares) -> tuple[float, float]:
        """Return the evidence that a reading repeats itself within a pulse, and its share."""
        products, count = np.zeros(_LAGS + 1), 0
        for k, experiment in enumerate(problem.experiments):
            rows = problem.rows(k)
            if experiment.channels[channel] in experiment.quantised:
                continue
            shape = experiment.measured.shape
            z = (self.residual[rows] * np.sqrt(self._weight[rows])).reshape(shape)[:, channel]
            products += [float(z[lag:] @ z[:z.size - lag]) for lag in range(_LAGS + 1)]
            count += int(np.count_nonzero(z))
        if count < 10 * _LAGS:
            return 0.0, 0.0
        factors = linalg.solve_toeplitz(products[:-1] + 1e-9 * products[0] * _FIRST, products[1:])
        left = float(np.clip(1.0 - factors @ products[1:] / products[0], 1e-9, 1.0))
        evidence = -0.5 * (count * math.log(left) + _LAGS * math.log(count))
        return max(evidence, 0.0), 1.0 - left


def _rows(roots: Sequence[FloatArray], matrix: FloatArray) -> FloatArray:
    """Return each test's part of a matrix or vector times the transposed root of that test."""
    ends = np.cumsum([len(root) for root in roots])
    return np.concatenate([root.T @ part for root, part in zip(
        roots, np.split(matrix, ends[:-1]), strict=True)])
