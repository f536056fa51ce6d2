# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A box-constrained quadratic programme by an active-set method: the step of a bounded fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from simgap.fit.cholesky import factored, solved
from simgap.machine.contract import FloatArray

# For this many iterations all wrongly active bounds are released at once; after that one by one,
# because releasing all of them may cycle.
_ALL_AT_ONCE = 12
# A gradient below this, in the metric of the scaled Hessian, gains nothing.
_LEVEL = 1e-6


class BoxQuadratic:
    """
    A positive semidefinite quadratic programme, shape (m, m), within low <= 0 <= high.

    Variables that are far from their bounds are eliminated once; the search for active bounds is
    among the others. One that a step takes beyond its bounds is no longer eliminated.
    """

    def __init__(self, hessian: FloatArray, low: FloatArray, high: FloatArray,
                 bounded: NDArray[np.bool_] | None = None) -> None:
        m = len(hessian)
        if bounded is None:
            reach = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-30))
            bounded = (np.minimum(-low, high) <= reach) | (np.diag(hessian) <= 1e-30)
        self._hessian, self._low, self._high = hessian, low, high
        self._bounded, self._free = np.flatnonzero(bounded), np.flatnonzero(~bounded)
        self._within: BoxQuadratic | None = None
        if self._free.size:
            own = hessian[np.ix_(self._free, self._free)]
            self._unit = 1.0 / np.sqrt(np.diag(own))
            self._factor = factored(own * np.outer(self._unit, self._unit))
            across = hessian[np.ix_(self._free, self._bounded)]
            self._follow = self._of_the_free(across)
            self._rest = BoxQuadratic(
                hessian[np.ix_(self._bounded, self._bounded)] - across.T @ self._follow,
                low[self._bounded], high[self._bounded], np.ones(self._bounded.size, bool))
            return
        diagonal = np.diag(hessian)
        dead = diagonal <= 1e-30  # a variable that changes nothing stays where it is
        self._scale = np.where(dead, 0.0, 1.0 / np.sqrt(np.where(dead, 1.0, diagonal)))
        self._scaled = hessian * np.outer(self._scale, self._scale)
        self._scaled[np.diag_indices(m)] += 1e-12
        self._room = (high > low) & ~dead

    def step(self, gradient: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the step d, shape (m,), that maximises gradient d - d hessian d / 2."""
        if self._within:
            return self._within.step(gradient, near)
        if self._free.size:
            found, slope = np.zeros(gradient.size), gradient[self._free]
            found[self._bounded] = self._rest.step(
                gradient[self._bounded] - self._follow.T @ slope,
                None if near is None else near[self._bounded])
            found[self._free] = (self._of_the_free(slope)
                                 - self._follow @ found[self._bounded])
            beyond = (found < self._low) | (found > self._high)
            if not beyond.any():
                return found
            beyond[self._bounded] = True
            self._within = BoxQuadratic(self._hessian, self._low, self._high, beyond)
            return self._within.step(gradient, near)
        # the search begins with what `near`, the step of a similar gradient, leaves free
        hessian, low, high, scale = self._hessian, self._low, self._high, self._scale
        if near is None:
            step = np.zeros(gradient.size)
            free = self._room & ~((low >= 0.0) & (gradient < 0.0)) & ~(
                (high <= 0.0) & (gradient > 0.0))
        else:
            step, free = near.copy(), self._room & (near > low) & (near < high)
        for iteration in range(4 * gradient.size):
            index = np.flatnonzero(free)
            if index.size:
                rest = gradient - hessian @ np.where(free, 0.0, step)
                step[index] = scale[index] * solved(
                    factored(self._scaled[np.ix_(index, index)]), (scale * rest)[index])
            out = free & ((step < low) | (step > high))
            if out.any():
                np.clip(step, low, high, out=step)
                free &= ~out
                continue
            slope = gradient - hessian @ step
            wrong = ~free & self._room & (
                ((step <= low) & (slope > 0.0)) | ((step >= high) & (slope < 0.0)))
            steepness = np.abs(slope) * scale
            wrong &= steepness > _LEVEL
            if not wrong.any():
                break
            if iteration < _ALL_AT_ONCE:
                free |= wrong
            else:
                free[np.argmax(np.where(wrong, steepness, -1.0))] = True
        return np.asarray(np.clip(step, low, high))

    def _of_the_free(self, right: FloatArray) -> FloatArray:
        """Solve for the variables without bounds, a right-hand side of shape (k,) or (k, j)."""
        unit = self._unit.reshape(-1, *[1] * (right.ndim - 1))
        return np.asarray(unit * solved(self._factor, unit * right))


def box_constrained_step(hessian: FloatArray, gradient: FloatArray, low: FloatArray,
                         high: FloatArray) -> FloatArray:
    """Return the step of one gradient, see `BoxQuadratic`."""
    return BoxQuadratic(hessian, low, high).step(gradient)
