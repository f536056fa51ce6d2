# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The orders (cycles per revolution) that stand out in what a model leaves."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.ndimage import median_filter
from simgap.machine.contract import Experiment, FloatArray

# Orders for which a ripple is judged before a residual tells better ones.
USUAL_ORDERS = (1.0, 2.0, 3.0, 4.0, 6.0)
_GREATEST, _STEP = 64.0, 0.5
_NEIGHBOURS = 9
# Least samples and revolutions of a window, in which a machine answers a wave with a constant
# phase, more or less.
_WINDOW_SAMPLES, _WINDOW_REVOLUTIONS = 64, 2.0


def likely_orders(experiments: Sequence[Experiment], residuals: Sequence[FloatArray],
                  angles: Sequence[FloatArray], count: int) -> list[float]:
    """Return likely orders, half by peak and half by energy, from residuals and angles [rad]."""
    orders = np.arange(_STEP, _GREATEST + _STEP, _STEP)
    energy = np.zeros(orders.size)
    for experiment, residual, angle in zip(experiments, residuals, angles, strict=True):
        clean = np.nan_to_num(residual / experiment.noise)
        for rows in _windows(angle):
            for channel in clean[rows].T:
                energy += _power(channel, angle[rows], orders)
    # a score is a sum of squares, whose scatter is its square root
    usual = median_filter(energy, _NEIGHBOURS, mode='nearest') + 1e-9
    peak = (energy - usual) / np.sqrt(usual)
    found: list[float] = []
    ranks = [list(np.argsort(by)[::-1]) for by in (peak, energy)]
    while len(found) < count:
        order = float(orders[ranks[len(found) % 2].pop(0)])
        if order not in found:
            found.append(order)
    return found


def _windows(angle: FloatArray) -> Iterator[slice]:
    """Yield windows of enough samples and revolutions; the last one may be short."""
    turned = np.r_[0.0, np.cumsum(np.abs(np.diff(angle)))] / (2.0 * np.pi)
    first = 0
    while first + _WINDOW_SAMPLES <= angle.size:
        last = int(np.searchsorted(turned, turned[first] + _WINDOW_REVOLUTIONS))
        last = max(last, first + _WINDOW_SAMPLES)
        yield slice(first, last)
        first = last


def _power(signal: FloatArray, angle: FloatArray, orders: FloatArray) -> FloatArray:
    """Return the power of a signal in waves of an angle, less its mean and slope, shape (m,)."""
    if np.ptp(angle) < 1e-9:
        return np.zeros(orders.size)
    wave = np.exp(-1j * np.outer(orders, angle))
    n = angle.size
    basis = np.linalg.qr(np.column_stack([np.ones(n), np.arange(n)]))[0]
    wave -= (wave @ basis) @ basis.T
    signal = signal - basis @ (basis.T @ signal)
    power = np.sum(np.abs(wave) ** 2, axis=1) + 1.0
    return np.asarray(np.abs(wave @ signal) ** 2 / power)
