# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Page's cumulative sums over many charts at once, with a stated rate of false alarms.

The increments are standardised: mean 0 and variance 1 in the quiet record. A chart adds up what
exceeds the reference value k, for each direction, and alarms at the limit h (E. S. Page,
Biometrika 41 (1954) 100). The mean time between false alarms follows from k and h by Siegmund's
approximation (D. Siegmund, Sequential Analysis, 1985, section 2.6). The chart also tells when the
change began: at the last zero of its sum.
"""

import math

from antenna_drive.emulator.unit import FloatArray
import numpy as np
from numpy.typing import NDArray

# Siegmund's correction for what a normal increment overshoots the limit by.
_OVERSHOOT = 1.166
DAY_S = 86400.0


def run_length(reference: float, limit: float) -> float:
    """
    Return the mean number of increments to a false alarm of a one-sided chart.

    reference : k, above 0, in standard deviations of an increment
    limit : h, in the same unit
    """
    exponent = 2.0 * reference * (limit + _OVERSHOOT)
    return (math.exp(exponent) - exponent - 1.0) / (2.0 * reference**2)


def limit_for(reference: float, increments: float) -> float:
    """
    Return the limit h at which a one-sided chart alarms once in so many increments.

    reference : k, above 0
    increments : mean number of increments to a false alarm, above 1
    """
    low, high = -_OVERSHOOT, 1.0
    while run_length(reference, high) < increments:
        high *= 2.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if run_length(reference, middle) < increments else (low, middle)
    return max(high, 0.0)


def limit_of_rate(reference: float, alarms_per_day: float, sides: int, block_s: float) -> float:
    """
    Return the limit h at which all charts together alarm so often by mistake.

    Rates of false alarms add up at most (Bonferroni), whatever the charts have in common.

    reference : k, above 0
    alarms_per_day : of all charts together
    sides : number of one-sided charts
    block_s : time between two increments [s]
    """
    return limit_for(reference, max(sides * DAY_S / block_s / alarms_per_day, 2.0))


class Charts:
    """
    Charts that go on together.

    two_sided : which of the charts look for a decrease too, shape (n,)
    reference : k of each chart, shape (n,)
    limit : h
    clip : the greatest size of an increment: so no single block can alarm if h is larger
    """

    def __init__(self, two_sided: NDArray[np.bool_], reference: FloatArray, limit: float,
                 clip: float) -> None:
        self._signs = np.array([1.0, -1.0])[:, np.newaxis]
        self._off = np.stack([np.zeros_like(two_sided), ~two_sided])
        self._reference, self._limit, self._clip = reference, limit, clip
        self.restart()

    def restart(self) -> None:
        """Forget everything."""
        shape = (2, self._reference.size)
        self._sums = np.zeros(shape)
        self._began = np.full(shape, -1)
        self._moments = np.zeros(shape)
        self._count = np.zeros(shape, np.int64)

    def add(self, z: FloatArray, number: int) -> None:
        """
        Take one increment of each chart.

        z : shape (n,); NaN where there is none, which leaves the chart as it was
        number : of the block, kept as the beginning of a change
        """
        there = np.isfinite(z)
        step = self._signs * np.clip(np.nan_to_num(z), -self._clip, self._clip) - self._reference
        raised = np.where(there & ~self._off, self._sums + step, self._sums)
        # far above its limit a sum would take as long to come down again
        self._sums = np.clip(raised, 0.0, 2.0 * self._limit)
        running = self._sums > 0.0
        fresh = running & (self._began < 0)
        self._began = np.where(running, np.where(fresh, number, self._began), -1)
        self._moments = np.where(running, np.where(fresh, 0.0, self._moments)
                                 + np.where(there, np.nan_to_num(z), 0.0), 0.0)
        self._count = np.where(running, np.where(fresh, 0, self._count) + there, 0)

    @property
    def alarmed(self) -> NDArray[np.bool_]:
        """Return which charts are above their limit, shape (n,)."""
        return np.asarray((self._sums > self._limit).any(axis=0))

    @property
    def calm(self) -> bool:
        """Return whether no chart is above half its limit."""
        return not bool((self._sums > 0.5 * self._limit).any())

    def began(self, chart: int) -> int:
        """Return the block in which the change of an alarmed chart began."""
        return int(self._began[self._side(chart), chart])

    def size(self, chart: int) -> float:
        """Return the mean increment since then, in standard deviations."""
        side = self._side(chart)
        return float(self._moments[side, chart] / max(self._count[side, chart], 1))

    def _side(self, chart: int) -> int:
        return int(np.argmax(self._sums[:, chart]))
