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
"""What is learned from a quiet record, on records that are made by hand."""

from __future__ import annotations

from antenna_drive.emulator.batch import CHANNELS
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.twin.baseline import Baseline, learn, SCORES, Track
import numpy as np

BIAS = 'torque_share/bias_voltage'


def quiet_record(course: FloatArray, seed: int = 5) -> Baseline:
    """Return what is learned from readings with white noise beside a course of 110 s at 200 Hz."""
    random = np.random.default_rng(seed)
    time = np.arange(len(course)) / 200.0
    samples = {name: (time, course[:, k] + 0.01 * random.standard_normal(time.size))
               for k, name in enumerate(CHANNELS)}
    return learn(Track(time, course, course, np.sin(time), samples), 5.0)


def sines(count: int = 22000) -> FloatArray:
    """Return a course in which every signal moves."""
    time = np.arange(count) / 200.0
    return np.stack([np.sin((k + 1.3) * time) for k in range(len(CHANNELS))], axis=1)


def test_rounding_of_a_constant_signal_has_nothing_to_say() -> None:
    course = sines()
    # a source of constant voltage: the last digit flickers, and so does the slope
    course[:, CHANNELS.index(BIAS)] = 7.5 + 1e-15 * (np.arange(len(course)) % 7)
    baseline = quiet_record(course)
    slope = 1 + len(CHANNELS) + CHANNELS.index(BIAS)
    for name, item in baseline.signals.items():
        assert item.coefficients[slope] == 0.0, name
        assert np.count_nonzero(item.coefficients) > 10
    assert baseline.signals[BIAS].deviation[SCORES.index('with its slope')] == 0.0
    assert baseline.signals[BIAS].deviation[SCORES.index('mean')] > 0.0
