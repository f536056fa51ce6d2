# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The times of samples, from stamps of a sender whose true times the test knows."""

from __future__ import annotations

from collections.abc import Iterable

from antenna_drive.twin.regular_stamps import LEARNED, RegularSamples, RegularStamps
from hypothesis import given, strategies as st
import numpy as np
from numpy.typing import NDArray
import pytest

MS = 1_000_000
Times = NDArray[np.int64]


def settled(stamps: Iterable[int]) -> Times:
    """Return the times that come of stamps; the last ones wait for others."""
    regular = RegularStamps()
    return np.array([time for stamp in stamps for time in regular.put(stamp)], np.int64)


def sent(true: Times, delays: NDArray[np.float64]) -> list[int]:
    """Return when samples are sent that are ready late by so much [ns], in order."""
    ready = true + delays
    stamps: list[int] = []
    for moment in ready:
        stamps.append(max(round(moment), stamps[-1] + 20_000 if stamps else 0))
    return stamps


@pytest.mark.parametrize('period', [1 * MS, 10 * MS, 16_666_667])
def test_even_stamps_stay_as_they_are(period: int) -> None:
    true = 5 * 10**18 // 3 + period * np.arange(3000)
    assert settled(true.tolist()) == pytest.approx(true[:settled(true.tolist()).size], abs=1000)


def test_late_samples_come_at_their_own_times() -> None:
    random = np.random.default_rng(4)
    true = 10 * MS * np.arange(8000)
    delays = 0.2 * MS + random.exponential(0.4 * MS, true.size)
    # a sender that had no processor for up to 45 ms, and then sends all that waits
    delays[random.random(true.size) < 0.004] += 45 * MS * random.random()
    stamps = sent(true, delays)
    found = settled(stamps)
    off = (found - true[:found.size])[3000:]
    raw = (np.array(stamps) - true)[3000:found.size]
    assert off.max() - off.min() < 0.4 * MS
    assert off.std() < raw.std() / 20.0


def test_a_sender_that_begins_late_is_put_right_at_once() -> None:
    true = 10 * MS * np.arange(600)
    delays = np.zeros(true.size)
    delays[0] = 44 * MS
    found = settled(sent(true, delays))
    assert np.abs(found - true[:found.size]).max() < 1.0 * MS


def test_missing_samples_leave_a_gap() -> None:
    random = np.random.default_rng(5)
    true = 10 * MS * np.arange(6000)
    true = true[random.random(true.size) > 0.02]
    found = settled(sent(true, random.exponential(0.3 * MS, true.size)))
    assert np.abs(found - true[:found.size]).max() < 1.0 * MS


def test_drift_of_the_clock_is_followed() -> None:
    # A second-order loop of 0.05 Hz lags by the change of drift a second, over (2 pi 0.05 Hz)^2.
    # Behind a clock that loses, whose stamps look late, it lags by 1 / 0.3 of that, and its
    # damping, sqrt(0.5 * 0.3), makes it overshoot at first.
    time_s = 0.01 * np.arange(60_000)
    true = np.round(10 * MS * (1.0 + 1e-4 * (1.0 + np.sin(time_s / 300.0))).cumsum())
    found = settled(true.astype(np.int64).tolist())
    lag_ns = 1e9 * 1e-4 / 300.0 / (2.0 * np.pi * 0.05) ** 2
    off = found - true[:found.size]
    assert off.max() < 1.1 * lag_ns
    damping = np.sqrt(0.5 * 0.3)
    overshoot = np.exp(-np.pi * damping / np.sqrt(1.0 - damping**2))
    assert off.min() > -(1.0 + overshoot) * lag_ns / 0.3


def test_another_rhythm_is_learned() -> None:
    true = np.concatenate([10 * MS * np.arange(1000), 10**10 + 4 * MS * np.arange(1, 4000)])
    found = settled(true.tolist())
    assert np.abs(found - true[:found.size])[-1000:].max() < 0.1 * MS


def test_an_irregular_sender_is_believed() -> None:
    stamps = np.cumsum(np.random.default_rng(6).exponential(10.0 * MS, 500)).astype(int).tolist()
    assert settled(stamps).tolist() == stamps


def test_a_pause_begins_anew_and_loses_nothing() -> None:
    samples = RegularSamples()
    stamps = [10 * MS * k for k in range(300)] + [20_000 * MS + 10 * MS * k for k in range(300)]
    found = [item for k, stamp in enumerate(stamps) for item in samples.put('a', stamp, float(k))]
    assert [value for _, _, value in found] == list(range(len(found)))
    assert [time for _, time, _ in found] == pytest.approx(stamps[:len(found)], abs=1000)
    assert len(found) > 550


def test_late_or_repeated_stamps_are_left_to_be_told() -> None:
    samples = RegularSamples()
    for k in range(LEARNED + 50):
        samples.put('a', 10 * MS * k, 0.0)
    last = 10 * MS * (LEARNED + 49)
    assert samples.put('a', last, 1.0) == [('a', last, 1.0)]
    assert samples.put('a', last - 30 * MS, 2.0) == [('a', last - 30 * MS, 2.0)]


@given(st.lists(st.integers(1, 10**9), min_size=1, max_size=400), st.integers(0, 2**60))
def test_no_sample_is_lost_or_reordered(steps: list[int], begin: int) -> None:
    samples = RegularSamples()
    stamps = [begin + int(moment) for moment in np.cumsum(steps)]
    found = [item for k, stamp in enumerate(stamps) for item in samples.put('a', stamp, float(k))]
    # an hour's pause gives out what waits
    found += samples.put('a', stamps[-1] + 3600 * 10**9, -1.0)
    assert [value for _, _, value in found] == list(range(len(steps)))
