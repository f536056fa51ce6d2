# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The robust loss of a residual r: half its square up to a bound k, its logarithm beyond."""

import numpy as np
from numpy.typing import NDArray
from simgap.machine.contract import FloatArray


def robust_weight(residual: FloatArray, valid: NDArray[np.bool_], outlier: float) -> FloatArray:
    """Return the derivative of the robust loss by half the squared residual; 0 if not valid."""
    size = np.maximum(np.abs(residual), outlier)
    return np.asarray(np.where(valid, (outlier / size) ** 2, 0.0))


def robust_level(residual: FloatArray, outlier: float) -> float:
    """Return the rms of residuals that are clipped at so many times itself."""
    z, level = np.abs(residual), np.inf
    for _ in range(11):
        level = float(np.sqrt(np.mean(np.minimum(z, outlier * level) ** 2)))
    return level


def robust_loss(residual: FloatArray, outlier: float) -> float:
    """Return the sum of losses: half the square of small residuals, logarithmic in large ones."""
    return float(robust_losses(residual, outlier).sum())


def robust_losses(residual: FloatArray, outlier: float) -> FloatArray:
    """Return the loss of each residual."""
    # after a contact that is made too late everything differs for a while
    size = np.abs(residual)
    large = np.maximum(size, outlier)
    return np.where(size < outlier, 0.5 * size ** 2,
                    outlier ** 2 * (0.5 + np.log(large / outlier)))
