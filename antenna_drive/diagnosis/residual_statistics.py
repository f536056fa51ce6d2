# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
The regimes a drive runs through, and what a residual depends on: a look without any model.

A residual that no effect explains is not nothing: that it grows with the rate, changes sign with
the direction, or repeats with an angle says what kind of effect is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from antenna_drive.diagnosis.machine import Experiment, FloatArray, Motion
import numpy as np
from numpy.typing import NDArray

REGIMES = ('reversal', 'stick', 'saturation', 'high load', 'constant rate')
_AFTER_REVERSAL_S = 0.4
_BINS = 12
_LAGS = 20
_BLOCK = 10
# A sample that is read beside the edge it should be on is off by any amount.
_OUTLIER = 10.0


def regimes(experiment: Experiment, motion: Motion) -> NDArray[np.int64]:
    """Return the regime of each sample, as its number in REGIMES, shape (n,)."""
    time, rate = experiment.time, motion.rate
    large = np.abs(rate).max() + 1e-30
    moving = np.abs(rate) > 0.02 * large
    direction = np.where(moving, np.sign(rate), 0.0)
    last = np.arange(time.size)
    last[direction == 0.0] = 0
    held = direction[np.maximum.accumulate(last)]
    turns = time[np.flatnonzero(np.diff(held) != 0.0) + 1]
    since = np.full(time.size, np.inf)
    if turns.size:
        k = np.searchsorted(turns, time, side='right') - 1
        since = np.where(k >= 0, time - turns[np.maximum(k, 0)], np.inf)
    result = np.full(time.size, 4)
    result[np.abs(motion.load) > np.quantile(np.abs(motion.load), 0.85)] = 3
    result[np.abs(motion.load) > 0.97 * 2.0 * motion.limit] = 2
    result[since < _AFTER_REVERSAL_S] = 0
    result[~moving] = 1
    return result


def _clipped(z: FloatArray) -> FloatArray:
    return np.asarray(np.clip(z[np.isfinite(z)], -_OUTLIER, _OUTLIER))


def fast(z: FloatArray) -> float:
    """Return the variance of the fast part of a residual at even times, shape (n,), clipped."""
    z = _clipped(z)
    return 0.5 * float(np.mean(np.diff(z) ** 2)) if z.size > 1 else 0.0


def power(z: FloatArray) -> float:
    """Return the mean square of a residual, shape (n,), clipped."""
    z = _clipped(z)
    return float(np.mean(z ** 2)) if z.size else 0.0


def structure(z: FloatArray) -> float:
    """
    Return how much louder the slow part of a residual is than white noise would be, less one.

    Parameters
    ----------
    z
        residual at even times, shape (n,)

    """
    z = _clipped(z)
    count = z.size // _BLOCK
    if count < 4 or not np.any(z):
        return 0.0
    blocks = z[:count * _BLOCK].reshape(count, _BLOCK).mean(axis=1)
    return float(_BLOCK * np.mean(blocks ** 2) / max(fast(z), 1e-12) - 1.0)


def correlation(z: FloatArray) -> float:
    """Return the greatest autocorrelation of a residual at the first lags."""
    z = z[np.isfinite(z)] - np.nanmean(z)
    power = float(z @ z)
    if z.size < 3 * _LAGS or power == 0.0:
        return 0.0
    return float(max(abs(z[lag:] @ z[:-lag]) / power for lag in range(1, _LAGS)))


def dependence(z: FloatArray, by: FloatArray) -> float:
    """Return the share of a residual's variance that depends on another quantity."""
    good = np.isfinite(z) & np.isfinite(by)
    z, by = z[good], by[good]
    if z.size < 10 * _BINS or np.ptp(by) == 0.0:
        return 0.0
    edges = np.unique(np.quantile(by, np.linspace(0.0, 1.0, _BINS + 1)))
    if edges.size < 3:
        return 0.0
    which = np.clip(np.searchsorted(edges, by, side='right') - 1, 0, edges.size - 2)
    total = float(np.sum((z - z.mean()) ** 2))
    count = np.bincount(which, minlength=edges.size - 1)
    mean = np.bincount(which, z, minlength=edges.size - 1) / np.maximum(count, 1)
    between = float(np.sum(count * (mean - z.mean()) ** 2))
    chance = (edges.size - 2) / z.size
    return max(0.0, between / max(total, 1e-30) - chance)


def dependences(experiments: Sequence[Experiment], motions: Sequence[Motion],
                residuals: Sequence[FloatArray]) -> list[dict[str, Any]]:
    """
    Return what the residuals depend on, the strongest first.

    Parameters
    ----------
    experiments, motions
        of each test
    residuals
        in standard deviations, shape (n, c) for each test

    """
    found = []
    channels = experiments[0].channels
    looks = {
        'rate': [m.rate for m in motions],
        'direction': [np.sign(m.rate) * (np.abs(m.rate) > 0.02 * np.abs(m.rate).max())
                      for m in motions],
        'load': [m.load for m in motions],
        'angle': [m.angle for m in motions],
        'time': [e.time for e in experiments],
        'acceleration': [np.gradient(m.rate, e.time)
                         for m, e in zip(motions, experiments, strict=True)],
    }
    for c, channel in enumerate(channels):
        z = np.concatenate([r[:, c] for r in residuals])
        for name, values in looks.items():
            share = dependence(z, np.concatenate(values))
            if share > 0.02:
                found.append({'signal': channel, 'depends_on': name, 'share': share})
    return sorted(found, key=lambda item: -float(str(item['share'])))[:8]
