# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The Cholesky factor of a Hessian that was summed in single precision."""

from collections.abc import Callable

import numpy as np
from scipy import linalg
from simgap.machine.contract import FloatArray

# Rounding errors of such a Hessian, as shares of its diagonal.
ROUNDING = 1e-6


def factored(matrix: FloatArray, ridge: float = 0.0) -> FloatArray:
    """
    Return the lower Cholesky factor of a symmetric matrix with a diagonal of ones, shape (m, m).

    `ridge` is added to the diagonal, and more until the matrix is positive definite: a Hessian
    summed in single precision need not be. Along a direction that is flat within its rounding
    nothing is known, and such a ridge goes nowhere. Raises ValueError at NaN or infinity.
    """
    np.asarray_chkfinite(matrix)
    while True:
        raised = matrix + ridge * np.eye(len(matrix)) if ridge else matrix
        factor, failed = linalg.lapack.dpotrf(raised, lower=1)
        if not failed:
            return np.asarray(factor)
        ridge = max(10.0 * ridge, ROUNDING)


def solver(matrix: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """
    Return what solves for such a Hessian with any diagonal, shape (m, m).

    It takes and returns the shape (m,) or (m, k). Rounding errors may have made it indefinite.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    factor = factored(matrix / np.outer(scale, scale), ROUNDING)
    return lambda right: np.asarray((solved(factor, (right.T / scale).T).T / scale).T)


def solved(factor: FloatArray, right: FloatArray) -> FloatArray:
    """Solve for a matrix by its factor; the right-hand side is of shape (m,) or (m, k)."""
    return np.asarray(linalg.lapack.dpotrs(factor, right, lower=1)[0])
