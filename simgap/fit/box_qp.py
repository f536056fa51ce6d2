# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A box-constrained quadratic programme by an active-set method: the step of a bounded fit."""

import numpy as np
from numpy.typing import NDArray
from simgap.fit.cholesky import factored, solved
from simgap.machine.contract import FloatArray

# For this many iterations all wrongly active bounds are released at once; after that one by one,
# because releasing all of them may cycle.
_ALL_AT_ONCE = 12
# A gradient below this, in the metric of the scaled Hessian, gains nothing.
_LEVEL = 1e-6


def box_constrained_step(hessian: FloatArray, gradient: FloatArray, low: FloatArray,
                         high: FloatArray) -> FloatArray:
    """
    Return the step d, shape (m,), within low <= d <= high that maximises g d - d hessian d / 2.

    The Hessian, shape (m, m), is positive semidefinite, and 0 is within the bounds. Variables far
    from their bounds are eliminated. One that a step takes beyond its bounds is not any more.
    """
    diagonal = np.diag(hessian)
    reach = 1.0 / np.sqrt(np.maximum(diagonal, 1e-30))
    bounded = (np.minimum(-low, high) <= reach) | (diagonal <= 1e-30)
    while True:
        step = _eliminated(hessian, gradient, low, high, bounded)
        beyond = (step < low) | (step > high)
        if not beyond.any():
            return step
        bounded |= beyond


def _eliminated(hessian: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray,
                bounded: NDArray[np.bool_]) -> FloatArray:
    """Return the step in which some variables alone heed their bounds."""
    if bounded.all():
        return _active_set(hessian, gradient, low, high)
    inside, free = np.flatnonzero(bounded), np.flatnonzero(~bounded)
    own = hessian[np.ix_(free, free)]
    unit = 1.0 / np.sqrt(np.diag(own))
    factor = factored(own * np.outer(unit, unit))
    across = hessian[np.ix_(free, inside)]
    follow = unit[:, np.newaxis] * solved(factor, unit[:, np.newaxis] * across)
    step = np.zeros(gradient.size)
    step[inside] = _active_set(hessian[np.ix_(inside, inside)] - across.T @ follow,
                               gradient[inside] - follow.T @ gradient[free],
                               low[inside], high[inside])
    step[free] = unit * solved(factor, unit * gradient[free]) - follow @ step[inside]
    return step


def _active_set(hessian: FloatArray, gradient: FloatArray, low: FloatArray,
                high: FloatArray) -> FloatArray:
    """Return the step in which all variables heed their bounds."""
    diagonal = np.diag(hessian)
    dead = diagonal <= 1e-30  # a variable that changes nothing stays where it is
    scale = np.where(dead, 0.0, 1.0 / np.sqrt(np.where(dead, 1.0, diagonal)))
    scaled = hessian * np.outer(scale, scale)
    scaled[np.diag_indices(len(scaled))] += 1e-12
    room = (high > low) & ~dead
    step = np.zeros(gradient.size)
    free = room & ~((low >= 0.0) & (gradient < 0.0)) & ~((high <= 0.0) & (gradient > 0.0))
    for iteration in range(4 * gradient.size):
        index = np.flatnonzero(free)
        if index.size:
            rest = gradient - hessian @ np.where(free, 0.0, step)
            step[index] = scale[index] * solved(
                factored(scaled[np.ix_(index, index)]), (scale * rest)[index])
        out = free & ((step < low) | (step > high))
        if out.any():
            np.clip(step, low, high, out=step)
            free &= ~out
            continue
        slope = gradient - hessian @ step
        wrong = ~free & room & (
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
