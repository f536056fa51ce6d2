# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Regimes and covariates of a machine that moves to and fro, from its rate, load and angle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

import numpy as np
from simgap.machine.contract import FloatArray, Regimes

_NAMES = ('reversal', 'stick', 'saturation', 'high load', 'constant rate')
# Below this share of the greatest rate the machine stands still.
_STILL = 0.02
# The greatest loads count as high, those close to the limit as saturated.
_HIGH_LOAD_QUANTILE, _SATURATED = 0.85, 0.97


@dataclass(frozen=True)
class Motion:
    """
    How a machine moves in an experiment.

    Attributes
    ----------
    time : shape (n,) [s]
    rate, load, angle : shape (n,), in any unit
    load_limit : load at which the drive saturates
    reversal_s : time after a reversal that still belongs to it [s]

    """

    time: FloatArray
    rate: FloatArray
    load: FloatArray
    angle: FloatArray
    load_limit: float = math.inf
    reversal_s: float = 0.4

    def regimes(self) -> Regimes:
        """Return the regime of each sample; a later test overrides an earlier one."""
        moving = self._moving()
        direction = np.where(moving, np.sign(self.rate), 0.0)
        last = np.arange(self.time.size)
        last[direction == 0.0] = 0
        held = direction[np.maximum.accumulate(last)]
        reversals = self.time[np.flatnonzero(np.diff(held) != 0.0) + 1]
        since = np.full(self.time.size, np.inf)
        if reversals.size:
            k = np.searchsorted(reversals, self.time, side='right') - 1
            since = np.where(k >= 0, self.time - reversals[np.maximum(k, 0)], np.inf)
        size = np.abs(self.load)
        labels = np.full(self.time.size, _NAMES.index('constant rate'))
        labels[size > np.quantile(size, _HIGH_LOAD_QUANTILE)] = _NAMES.index('high load')
        labels[size > _SATURATED * self.load_limit] = _NAMES.index('saturation')
        labels[since < self.reversal_s] = _NAMES.index('reversal')
        labels[~moving] = _NAMES.index('stick')
        return Regimes(_NAMES, labels)

    def covariates(self) -> Mapping[str, FloatArray]:
        """Return what a residual may depend on."""
        return {'rate': self.rate, 'direction': np.sign(self.rate) * self._moving(),
                'load': self.load, 'angle': self.angle, 'time': self.time,
                'acceleration': np.gradient(self.rate, self.time)}

    def _moving(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        rate = np.abs(self.rate)
        return np.asarray(rate > _STILL * (rate.max() + 1e-30))
