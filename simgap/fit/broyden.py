# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The linear model of a prediction about a fit, corrected by each step that the fit takes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas
from simgap.machine.contract import FloatArray
from simgap.settings import FitSettings

# In single precision, because it is large and gives a direction only.
Jacobian = NDArray[np.float32]


class BroydenModel:
    """The linear model of the residuals about a fit, with Broyden's updates."""

    def __init__(self, jacobian: Jacobian, hessian: FloatArray, weight: FloatArray,
                 residual: FloatArray, settings: FitSettings) -> None:
        self.jacobian, self.hessian = jacobian, hessian.copy()
        # the Jacobian is the given one plus a few outer products of these
        self.errors: list[FloatArray] = []
        self.directions: list[FloatArray] = []
        self._settings = settings
        self._hessian_weight = weight
        self._slope = transposed_product(jacobian, weight * residual)

    def gradient(self, weighted_residual: FloatArray, prior_slope: FloatArray) -> FloatArray:
        """Return the gradient of the gain, shape (m,)."""
        gradient = self._slope - prior_slope
        for error, direction in zip(self.errors, self.directions, strict=True):
            gradient += direction * float(error @ weighted_residual)
        return gradient

    def update(self, step: FloatArray, diagonal: FloatArray, change: FloatArray,
               weight: FloatArray) -> None:
        """Correct the Jacobian along a step by Broyden's rule, in the metric of the Hessian."""
        # a step whose prediction was all wrong, past a contact made or lost, is not used
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
        """Take new weights and residuals; recompute the Hessian if the weights moved much."""
        if float(np.mean(np.abs(weight - self._hessian_weight))) > self._settings.stale_weights:
            self.hessian = updated_product(self.jacobian, self.errors, self.directions, weight)
            self._hessian_weight = weight
        self._slope = transposed_product(self.jacobian, weighted_residual)


def updated(jacobian: Jacobian, errors: Sequence[FloatArray],
            directions: Sequence[FloatArray]) -> Jacobian:
    """Return a Jacobian with Broyden's rank-one updates."""
    if not errors:
        return jacobian
    return np.asarray(jacobian + np.array(errors, np.float32).T @ np.array(directions, np.float32))


def transposed_product(jacobian: Jacobian, vector: FloatArray) -> FloatArray:
    """Return the product of the transposed Jacobian and a vector, shape (m,)."""
    return np.asarray(jacobian.T @ vector.astype(np.float32), np.float64)


def updated_product(jacobian: Jacobian, errors: Sequence[FloatArray],
                    directions: Sequence[FloatArray], weight: FloatArray) -> FloatArray:
    """Return the `weighted_product` of a Jacobian with Broyden's updates, without making it."""
    product = weighted_product(jacobian, weight)
    if errors:
        added, along = np.array(errors, np.float32).T, np.array(directions, np.float64)
        cross = weighted_product(jacobian, weight, added) @ along
        product += cross + cross.T + along.T @ weighted_product(added, weight) @ along
    return product


def weighted_product(jacobian: Jacobian, weight: FloatArray,
                     other: Jacobian | None = None) -> FloatArray:
    """Return jacobian^T weight jacobian, or other in place of the second, shape (m, m)."""
    if other is not None:
        weighted = weight.astype(np.float32)[:, np.newaxis] * other
        return np.asarray(jacobian.T @ weighted, np.float64)
    if not jacobian.size:
        return np.zeros((jacobian.shape[1],) * 2)
    # half of a symmetric product is enough
    root = np.ascontiguousarray(np.sqrt(weight).astype(np.float32)[:, np.newaxis] * jacobian)
    half = np.asarray(blas.ssyrk(1.0, root.T), np.float64)
    return half + np.triu(half, 1).T
