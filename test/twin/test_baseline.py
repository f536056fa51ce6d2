# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is learned from a quiet record, on records that are made by hand."""

from __future__ import annotations

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.readings import SIGNALS
from antenna_drive.twin.baseline import (
    Baseline, regressors, SCORES, shift_of, SignalBaseline, SignalBlock,
)
from antenna_drive.twin.quiet_record import learn, Track
import numpy as np
import pytest

BIAS = 'torque_share/bias_voltage'


def quiet_record(course: FloatArray, seed: int = 5) -> Baseline:
    """Return what is learned from readings with white noise beside a course of 110 s at 200 Hz."""
    random = np.random.default_rng(seed)
    time = np.arange(len(course)) / 200.0
    samples = {name: (time, course[:, k] + 0.01 * random.standard_normal(time.size))
               for k, name in enumerate(SIGNALS)}
    return learn(Track(time, course, course, np.sin(time), 0.01, samples), 5.0)


def sines(count: int = 22000) -> FloatArray:
    """Return a course in which every signal moves."""
    time = np.arange(count) / 200.0
    return np.stack([np.sin((k + 1.3) * time) for k in range(len(SIGNALS))], axis=1)


def test_jumps_between_samples_are_no_gap() -> None:
    """Each second the drive is ahead of the twin by another time, up to a sample."""
    course, random = sines(), np.random.default_rng(3)
    time = np.arange(len(course)) / 200.0
    ahead = random.uniform(-0.008, 0.008, 120)
    samples = {name: (time, np.sin((k + 1.3) * (time + ahead[time.astype(int)]))
                      + 0.01 * random.standard_normal(time.size))
               for k, name in enumerate(SIGNALS)}

    def learned(spacing: float) -> Baseline:
        return learn(Track(time, course, course, np.sin(time), spacing, samples), 5.0)

    names = ['motor_1/tach_rate', 'motor_2/tach_rate']  # the fastest but for encoder and bias
    assert all(learned(0.0).signals[name].sigma > 0.013 for name in names)
    assert all(learned(0.01).signals[name].sigma < 0.0105 for name in names)


def test_clocks_that_drift_apart_are_followed() -> None:
    """The readings' clock is 300 ppm fast: 33 ms at the end of the record."""
    course, random = sines(), np.random.default_rng(6)
    time = np.arange(len(course)) / 200.0
    samples = {name: (time, np.sin((k + 1.3) * time * (1.0 + 3e-4))
                      + 0.01 * random.standard_normal(time.size))
               for k, name in enumerate(SIGNALS)}
    learned = learn(Track(time, course, course, np.sin(time), 0.01, samples), 5.0)
    for name in ('motor_1/tach_rate', 'motor_2/tach_rate'):
        item = learned.signals[name]
        assert item.sigma < 0.0105, name
        # to what ten seconds of drift make
        assert item.lag == pytest.approx(-3e-4 * time[-1], abs=3e-3)


def test_shift_is_that_of_all_signals() -> None:
    course, random = sines(200), np.random.default_rng(4)
    time = np.arange(len(course)) / 200.0
    rows = regressors(time, course)
    item = SignalBaseline(0.0, rows.mean(axis=0), rows.std(axis=0), np.zeros(rows.shape[1]), 0.01,
                          *np.zeros((3, len(SCORES))))

    def found(shift: float) -> float:
        parts = []
        for k in range(4):
            late = np.sin((k + 1.3) * (time + shift)) - course[:, k]
            late += 0.01 * random.standard_normal(time.size)
            late[17] += 5.0  # a spike
            parts.append((item, SignalBlock(k, late, rows)))
        return shift_of(parts)[0]

    assert found(0.004) == pytest.approx(0.004, abs=4e-4)
    assert found(-0.007) == pytest.approx(-0.007, abs=4e-4)


def test_record_without_enough_samples_judges_nothing() -> None:
    course = sines()
    time = np.arange(len(course)) / 200.0
    few = {'motor_1/ammeter': (time[::2000], time[::2000])}
    assert not learn(Track(time, course, course, np.sin(time), 0.01, few), 5.0).signals
    assert not learn(Track(time, course, course, np.sin(time), 0.01, {}), 5.0).signals


def test_rounding_of_a_constant_signal_has_nothing_to_say() -> None:
    course = sines()
    # a source of constant voltage: the last digit flickers, and so does the slope
    course[:, SIGNALS.index(BIAS)] = 7.5 + 1e-15 * (np.arange(len(course)) % 7)
    baseline = quiet_record(course)
    slope = 1 + len(SIGNALS) + SIGNALS.index(BIAS)
    for name, item in baseline.signals.items():
        assert item.coefficients[slope] == 0.0, name
        assert np.count_nonzero(item.coefficients) > 10
    assert baseline.signals[BIAS].deviation[SCORES.index('with its slope')] == 0.0
    assert baseline.signals[BIAS].deviation[SCORES.index('mean')] > 0.0
