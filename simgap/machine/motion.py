# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How a machine moves: its time scales, and its regimes and covariates to and fro."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import math

import numpy as np
from numpy.typing import NDArray
from simgap.machine.arrays import FloatArray

_NAMES = ('reversal', 'stick', 'saturation', 'high load', 'constant rate')
# Below this share of the greatest rate the machine stands still.
_STILL = 0.02
# The greatest loads count as high, those close to the limit as saturated.
_HIGH_LOAD_QUANTILE, _SATURATED = 0.85, 0.97


@dataclass(frozen=True)
class Regimes:
    """The regime of motion of each sample: `labels`, shape (n,), are indices into `names`."""

    names: tuple[str, ...]
    labels: NDArray[np.int64]


@dataclass(frozen=True)
class TimeScales:
    """How fast the machine is, which the search and the localisation need to know."""

    start_s: float  # time within which the effect of the initial conditions shows [s]
    scan_s: float  # length of the part of a test that a scan of parameter values looks at [s]
    pulse_s: float  # rise time of the pulses of an unknown input [s]
    response_s: float  # time after which the response to such a pulse has ended [s]
    block_s: float  # time beyond which residuals are independent, for the bootstrap [s]

    @classmethod
    def of_duration(cls, duration_s: float) -> TimeScales:
        """Return usual scales for tests of a duration [s]."""
        return cls(start_s=0.05 * duration_s, scan_s=0.27 * duration_s,
                   pulse_s=0.005 * duration_s, response_s=0.05 * duration_s,
                   block_s=0.03 * duration_s)


@dataclass(frozen=True)
class Motion:
    """How a machine moves in an experiment; rate, load and angle in any unit, None if unknown."""

    time: FloatArray  # shape (n,) [s]
    rate: FloatArray | None = None
    load: FloatArray | None = None
    angle: FloatArray | None = None
    load_limit: float = math.inf  # load at which the drive saturates
    reversal_s: float = 0.4  # time after a reversal that still belongs to it [s]
    units: Mapping[str, str] = field(default_factory=dict)  # of rate, load and angle

    def regimes(self) -> Regimes:
        """Return the regime of each sample; a later test overrides an earlier one."""
        if self.rate is None:
            return Regimes(('whole test',), np.zeros(self.time.size, np.int64))
        moving = _moving(self.rate)
        direction = np.where(moving, np.sign(self.rate), 0.0)
        last = np.arange(self.time.size)
        last[direction == 0.0] = 0
        held = direction[np.maximum.accumulate(last)]
        reversals = self.time[np.flatnonzero(np.diff(held) != 0.0) + 1]
        since = np.full(self.time.size, np.inf)
        if reversals.size:
            k = np.searchsorted(reversals, self.time, side='right') - 1
            since = np.where(k >= 0, self.time - reversals[np.maximum(k, 0)], np.inf)
        labels = np.full(self.time.size, _NAMES.index('constant rate'))
        if self.load is not None:
            size = np.abs(self.load)
            labels[size > np.quantile(size, _HIGH_LOAD_QUANTILE)] = _NAMES.index('high load')
            labels[size > _SATURATED * self.load_limit] = _NAMES.index('saturation')
        labels[since < self.reversal_s] = _NAMES.index('reversal')
        labels[~moving] = _NAMES.index('stick')
        return Regimes(_NAMES, labels)

    def covariates(self) -> Mapping[str, FloatArray]:
        """Return what an input may be a function of, shape (n,) each."""
        if self.rate is None:
            return {'time': self.time}
        found = {'rate': self.rate, 'direction': np.sign(self.rate) * _moving(self.rate),
                 'load': self.load, 'angle': self.angle, 'time': self.time,
                 'acceleration': np.gradient(self.rate, self.time)}
        return {name: values for name, values in found.items() if values is not None}

    def unit(self, covariate: str) -> str:
        """Return the unit of what an input may be a function of; '' for one that is not known."""
        if covariate == 'acceleration' and 'rate' in self.units:
            return f'{self.units["rate"]}^2'
        return self.units.get(covariate, 's' if covariate == 'time' else '')


def _moving(rate: FloatArray) -> NDArray[np.bool_]:
    size = np.abs(rate)
    return np.asarray(size > _STILL * (size.max() + 1e-30))
