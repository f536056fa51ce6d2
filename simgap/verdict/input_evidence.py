# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How much likelier an unknown input makes what a hypothesis leaves, linear about its fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import NamedTuple

import numpy as np
from scipy import linalg
from simgap.fit.broyden import Jacobian
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import prior_precision
from simgap.machine.contract import FloatArray
from simgap.machine.pulses import root

# Variances of the input over that of the noise that are tried.
_RATIOS = np.logspace(-4.0, 4.0, 25)
# Waves of a turn that an input may be a sum of.
_MOST_WAVES = 24
# Lags by which a reading may predict itself, whatever it is that repeats.
_LAGS = 20
_FIRST = np.eye(1, _LAGS)[0]


class Weighed(NamedTuple):
    """Independent inputs of some factors, as likely as they can be."""

    evidence: float  # natural logarithm of how much likelier they make the residual
    share: float  # of its energy that they explain
    factors: FloatArray  # shape (m,)
    deviations: FloatArray  # of the factors, shape (m,)
    spread: float = 0.0  # standard deviation of their prior, as likely as it can be


class InputEvidence:
    """The residual that is to be explained, with the nuisances projected out."""

    @classmethod
    def at(cls, problem: LeastSquares, point: Mapping[str, float],
           slopes: Jacobian | None = None) -> InputEvidence:
        """Return that of a problem whose nuisances have been fitted; `slopes` by them if known."""
        residual = problem.residuals(dict(point))
        level = max(problem.noise_level(residual), 1e-9)
        weight = np.where(problem.valid, np.minimum(1.0, problem.settings.noise.clip * level
                          / np.maximum(np.abs(residual), 1e-12)), 0.0) / level ** 2
        nuisances = problem.machine.nuisances
        if slopes is None:
            slopes = problem.jacobian(dict(point), nuisances, residual, central=False)
        # what is quieter than the noise that is stated is no gap
        stated = np.concatenate([np.tile([colour.level for colour in e.colours]
                                         or np.ones(len(e.channels)), e.time.size)
                                 for e in problem.experiments])
        loud = min(1.0, float(np.mean((stated * residual)[problem.valid] ** 2)))
        return cls(residual, loud, weight, slopes.astype(float), prior_precision(nuisances))

    def __init__(self, residual: FloatArray, loud: float, weight: FloatArray,
                 nuisances: FloatArray, prior: FloatArray) -> None:
        self.residual, self._loud, self._weight = residual, loud, weight
        self._nuisances = nuisances
        square = nuisances.T @ (nuisances * weight[:, np.newaxis]) + np.diag(prior)
        self._inverse = np.linalg.pinv(square, hermitian=True)
        self._slope = nuisances.T @ (weight * residual)
        self.energy = float(residual @ (weight * residual)
                            - self._slope @ self._inverse @ self._slope)
        self._count = float(np.count_nonzero(weight))

    def reduced(self, responses: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return the normal equations of inputs without what the nuisances can do."""
        # `responses` are those of each test to its inputs; the shapes returned are (m, m) and (m,)
        squares, slopes, crosses, end = [], [], [], 0
        for columns in responses:
            rows = slice(end, end := end + len(columns))
            weighted = columns * self._weight[rows, np.newaxis]
            squares.append(columns.T @ weighted)
            slopes.append(weighted.T @ self.residual[rows])
            crosses.append(self._nuisances[rows].T @ weighted)
        cross = np.concatenate(crosses, axis=1)
        projected = cross.T @ self._inverse
        return (linalg.block_diag(*squares) - projected @ cross,
                np.concatenate(slopes) - projected @ self._slope)

    def of_course(self, square: FloatArray, slope: FloatArray, counts: Sequence[int],
                  smooth: Sequence[float] = (0.0,)) -> tuple[float, float, FloatArray]:
        """Return the evidence for any course, its share of the energy, and the pulses' heights."""
        # `counts` are the pulses of each test; `smooth` has times of change, in pulses
        best, share, heights = 0.0, 0.0, np.zeros(len(square))
        size = float(np.trace(square)) / len(square)
        for pulses in smooth if size > 0.0 else ():
            roots = [root(count, pulses) if pulses else np.eye(count) for count in counts]
            found = self.weighed(
                _rows(roots, _rows(roots, square).T), _rows(roots, slope), size)
            if found.evidence > best:
                best, share = found.evidence, found.share
                heights = _rows([part.T for part in roots], found.factors)
        return best, share, heights

    def weighed(self, square: FloatArray, slope: FloatArray, size: float) -> Weighed:
        """Return independent inputs, given their normal equations and the size of these."""
        values, vectors = _eigen(0.5 * (square + square.T) / size)
        stiff = np.maximum(values, 0.0)[:, np.newaxis] + 1.0 / _RATIOS
        turned = vectors.T @ slope
        along = np.sum((turned ** 2)[:, np.newaxis] / stiff, axis=0) / size
        left = np.maximum(1.0 - along / self.energy, 1e-9)
        evidence = -0.5 * (self._count * np.log(left) + np.log(_RATIOS * stiff).sum(axis=0))
        best = int(np.argmax(evidence))
        if evidence[best] <= 0.0:
            return Weighed(0.0, 0.0, np.zeros(len(square)), np.zeros(len(square)))
        noise = left[best] * self.energy / max(self._count, 1.0)
        return Weighed(
            float(evidence[best]), float(1.0 - left[best]),
            vectors @ (turned / stiff[:, best]) / size,
            np.sqrt(noise * (vectors ** 2 @ (1.0 / stiff[:, best])) / size),
            math.sqrt(noise * _RATIOS[best] / size))

    def orders(self, square: FloatArray, slope: FloatArray) -> list[int]:
        """Return which waves pay for their two numbers, one after the other, the best first."""
        # of m waves these are the normal equations of the cosines and then of the sines
        kept: list[int] = []
        count, left = len(slope) // 2, self.energy
        price = math.log(max(self._count, 2.0)) + math.log(count)
        while len(kept) < _MOST_WAVES:
            gains = np.zeros(count)
            for wave in set(range(count)) - set(kept):
                both = [*kept, wave, *(item + count for item in (*kept, wave))]
                gains[wave] = slope[both] @ np.linalg.lstsq(
                    square[np.ix_(both, both)], slope[both], rcond=None)[0]
            best = int(np.argmax(gains))
            after = max(self.energy - float(gains[best]), 1e-9 * self.energy)
            if 0.5 * self._count * math.log(left / after) < price:
                break
            kept.append(best)
            left = after
        return kept

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


def _eigen(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return eigenvalues and eigenvectors of a symmetric matrix."""
    try:
        values, vectors = np.linalg.eigh(matrix)
    except np.linalg.LinAlgError:  # the quick method does not always converge
        values, vectors = linalg.eigh(matrix, driver='evr')
    return values, vectors


def _rows(roots: Sequence[FloatArray], matrix: FloatArray) -> FloatArray:
    """Return each test's part of a matrix or vector times the transposed root of that test."""
    ends = np.cumsum([len(root) for root in roots])
    return np.concatenate([root.T @ part for root, part in zip(
        roots, np.split(matrix, ends[:-1]), strict=True)])
