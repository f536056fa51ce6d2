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
"""Which cycles per revolution a residual repeats with: where a fit of a wave has to begin."""

from __future__ import annotations

from antenna_drive.gap.catalogue import Wave
from antenna_drive.gap.field_test import CURRENT_1, CURRENT_2, ENCODER, TACH_1
from antenna_drive.gap.model import Experiment, FloatArray
import numpy as np

# Within so much time the angle, summed up from the tachometer, does not drift [s].
_WINDOW_S = 1.5


def order_scores(form: Wave, experiment: Experiment, residual: FloatArray,
                 orders: FloatArray) -> FloatArray:
    """
    Return how much of a residual varies with each number of cycles per revolution.

    Parameters
    ----------
    form
        of the wave: which angle it follows, and where it shows
    experiment
        the test
    residual
        in the readings' own units, shape (n, c)
    orders
        cycles per revolution to look for, shape (m,)

    Returns
    -------
    array of shape (m,), in squared standard deviations

    """
    clean = np.nan_to_num(residual / experiment.noise)
    time = experiment.time
    if form.angle == 'axis':
        angle = np.nan_to_num(experiment.measured[:, ENCODER])
        rate = np.gradient(angle, time)
        if form.stem == 'cyclic_error':
            signals = clean[:, ENCODER][np.newaxis]
        else:
            moving = np.abs(rate) > 0.1 * np.abs(rate).max()
            signals = (clean[:, CURRENT_1] + clean[:, CURRENT_2])[np.newaxis] * (
                np.sign(rate) * moving)
        windows = np.zeros(time.size, int)
    else:
        m = int(form.angle[-1]) - 1
        rate = np.nan_to_num(experiment.measured[:, TACH_1 + m])
        angle = np.r_[0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))]
        signals = clean[:, [CURRENT_1 + m, TACH_1 + m]].T
        windows = (time / _WINDOW_S).astype(int)
    score = np.zeros(orders.size)
    for signal in signals:
        for w in range(windows[-1] + 1):
            inside = windows == w
            if np.count_nonzero(inside) < 10:
                continue
            part = signal[inside] - signal[inside].mean()
            wave = np.exp(-1j * np.outer(orders, angle[inside]))
            wave -= wave.mean(axis=1, keepdims=True)
            power = np.sum(np.abs(wave) ** 2, axis=1) + 1e-3
            score += np.abs(wave @ part) ** 2 / power
    return score
