# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What an expression may do with all samples of a column, which a single row does not tell."""

from collections.abc import Callable

import numpy as np
from simgap.logs.channel import FloatArray


def derivative(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the derivative by the time [s]: that of the parabola through three samples."""
    if values.size < 2:
        raise ValueError('a derivative needs two samples')
    return np.gradient(values, time, edge_order=2 if values.size > 2 else 1)


def smooth(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    """
    Return the means over a time [s] about each sample, of the straight lines between samples.

    Towards the ends it gets shorter, on both sides alike, so a straight line stays one.
    """
    half = np.minimum(0.5 * seconds, np.minimum(time - time[0], time[-1] - time))
    if not half.any():
        return values
    steps = np.diff(time)
    slopes = np.diff(values) / steps
    areas = np.r_[0.0, np.cumsum(0.5 * steps * (values[1:] + values[:-1]))]

    def area_until(moments: FloatArray) -> FloatArray:
        k = np.clip(np.searchsorted(time, moments, side='right') - 1, 0, steps.size - 1)
        past = moments - time[k]
        return areas[k] + past * (values[k] + 0.5 * past * slopes[k])

    area = area_until(time + half) - area_until(time - half)
    return np.divide(area, 2.0 * half, out=values.copy(), where=half > 0.0)


def previous(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the sample before each; the first one repeats itself."""
    return np.r_[values[:1], values[:-1]]


# Function and number of arguments: a column, then numbers.
WHOLE: dict[str, tuple[Callable[..., FloatArray], int]] = {
    'derivative': (derivative, 1), 'smooth': (smooth, 2), 'previous': (previous, 1)}
