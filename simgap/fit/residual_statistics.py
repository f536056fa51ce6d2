# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Statistics of a residual that need no model: its power, its slow part, what it depends on."""

from collections.abc import Mapping, Sequence
from typing import Any

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


def dependence(z: FloatArray, by: FloatArray,
               settings: Settings = DEFAULT) -> float:
    """Return the share of a residual's variance that a covariate explains, chance subtracted."""
    good = np.isfinite(z) & np.isfinite(by)
    z, by = z[good], by[good]
    bins = settings.lack_of_fit.bins
    if z.size < 10 * bins or np.ptp(by) == 0.0:
        return 0.0
    edges = np.unique(np.quantile(by, np.linspace(0.0, 1.0, bins + 1)))
    if edges.size < 3:
        return 0.0
    which = np.clip(np.searchsorted(edges, by, side='right') - 1, 0, edges.size - 2)
    total = float(np.sum((z - z.mean()) ** 2))
    count = np.bincount(which, minlength=edges.size - 1)
    mean = np.bincount(which, z, minlength=edges.size - 1) / np.maximum(count, 1)
    between = float(np.sum(count * (mean - z.mean()) ** 2))
    chance = (edges.size - 2) / z.size
    return max(0.0, between / max(total, 1e-30) - chance)


def dependences(channels: Sequence[str], covariates: Sequence[Mapping[str, FloatArray]],
                residuals: Sequence[FloatArray],
                settings: Settings = DEFAULT) -> list[dict[str, Any]]:
    """Return what residuals, shape (n, c), depend on, of covariates, (n,); the strongest first."""
    found = []
    for c, channel in enumerate(channels):
        z = np.concatenate([r[:, c] for r in residuals])
        for name in covariates[0]:
            share = dependence(z, np.concatenate([each[name] for each in covariates]), settings)
            if share > settings.lack_of_fit.least_dependence:
                found.append({'signal': channel, 'depends_on': name, 'share': share})
    return sorted(found, key=lambda item: -float(str(item['share'])))
