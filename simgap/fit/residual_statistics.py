# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Statistics of a residual that need no model: its power, its slow part, its correlation."""

import numpy as np
from simgap.machine.contract import FloatArray
from simgap.settings import DEFAULT, Settings


def _clipped(z: FloatArray, settings: Settings) -> FloatArray:
    # a sample that was read on the other side of an edge is off by any amount
    bound = settings.noise.clip
    return np.asarray(np.clip(z[np.isfinite(z)], -bound, bound))


def power(z: FloatArray, settings: Settings = DEFAULT) -> float:
    """Return the mean square of a residual, shape (n,), clipped."""
    z = _clipped(z, settings)
    return float(np.mean(z ** 2)) if z.size else 0.0


def slow_excess(z: FloatArray, settings: Settings = DEFAULT) -> float:
    """Return the power of the slow part of a residual, shape (n,), over white noise's, less 1."""
    z = _clipped(z, settings)
    length = settings.lack_of_fit.block
    count = z.size // length
    if count < 4 or not np.any(z):
        return 0.0
    blocks = z[:count * length].reshape(count, length).mean(axis=1)
    fast = 0.5 * float(np.mean(np.diff(z) ** 2))  # the variance of its fast part, at even times
    return float(length * np.mean(blocks ** 2) / max(fast, 1e-12) - 1.0)


def autocorrelation(z: FloatArray, settings: Settings = DEFAULT) -> float:
    """Return the greatest autocorrelation of a residual at the first lags."""
    z = z[np.isfinite(z)] - np.nanmean(z)
    power = float(z @ z)
    lags = settings.lack_of_fit.lags
    if z.size < 3 * lags or power == 0.0:
        return 0.0
    return float(max(abs(z[lag:] @ z[:-lag]) / power for lag in range(1, lags)))
