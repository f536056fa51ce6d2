# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The strip charts' history against all samples."""

from __future__ import annotations

from collections.abc import Iterable
import struct
from typing import Any

from antenna_drive.live import history
from antenna_drive.live.history import History, KEPT
from hypothesis import given, strategies as st
import numpy as np

SIGNALS = 3
RUN = 1795262948317196


def values(steps: Any) -> Any:
    """Return values that tell their step and signal, shape (SIGNALS,) or (n, SIGNALS)."""
    return np.sin(0.7 * np.asarray(steps)[..., np.newaxis] + np.arange(SIGNALS))


def seen(steps: Iterable[int], step_s: float = 1e-3) -> History:
    """Return a history that has taken some steps of a run."""
    kept = History(SIGNALS)
    kept.begin(RUN, step_s)
    for step in steps:
        kept.take(step, values(step))
    return kept


@given(st.integers(1, 9000), st.sampled_from([1e-3, 2e-3, 0.05]), st.integers(0, 9000))
def test_every_interval_has_the_least_and_the_greatest_sample(
        last: int, step_s: float, first: int) -> None:
    first = min(first, last)
    kept = seen(range(first, last + 1), step_s)
    piece = kept.since(0, 0)
    per = max(1, round(0.01 / step_s))
    assert piece.run == RUN
    assert piece.time_s == last * step_s
    assert piece.interval_s == per * step_s
    assert piece.first == max(0, last // per - KEPT + 1)
    assert piece.resume == max(piece.first, (last + 1) // per)
    assert len(piece.lows) == last // per + 1 - piece.first
    for number in range(piece.first, last // per + 1):
        steps = np.arange(max(first, number * per), min((number + 1) * per, last + 1))
        row = number - piece.first
        if not len(steps):
            assert np.isnan(piece.lows[row]).all() and np.isnan(piece.highs[row]).all()
            continue
        samples = values(steps)
        assert piece.lows[row].tolist() == samples.min(axis=0).tolist()
        assert piece.highs[row].tolist() == samples.max(axis=0).tolist()
        if steps[-1] % per == per - 1:
            assert piece.ends[row].tolist() == samples[-1].tolist()
        else:
            assert np.isnan(piece.ends[row]).all()
    assert piece.now.tolist() == values(last).tolist()


def test_pieces_that_follow_each_other_are_the_whole() -> None:
    kept, got, at = seen([]), {}, 0
    for step in range(0, 500, 7):
        for k in range(step, step + 7):
            kept.take(k, values(k))
        piece = kept.since(RUN, at)
        assert piece.first == at
        got.update({piece.first + n: row for n, row in enumerate(piece.lows.tolist())})
        at = piece.resume
    assert [got[n] for n in sorted(got)] == kept.since(RUN, 0).lows.tolist()


def test_steps_that_never_came_are_left_empty() -> None:
    lows = seen([*range(10, 30), *range(60, 80)]).since(0, 0).lows
    assert np.isnan(lows[[0, 3, 4, 5]]).all()
    assert np.isfinite(lows[[1, 2, 6, 7]]).all()
    ends = seen([*range(19), *range(20, 30)]).since(0, 0).ends
    assert np.isnan(ends[1]).all(), 'step 19 never came'
    assert ends[[0, 2]].tolist() == values([9, 29]).tolist()


def test_nothing_is_left_of_the_run_before() -> None:
    kept = seen(range(50))
    kept.begin(RUN + 9, 1e-3)
    piece = kept.since(RUN, 5)
    assert (piece.run, piece.first, piece.time_s, len(piece.lows)) == (RUN + 9, 0, 0.0, 0)
    for k in range(8):
        kept.take(k, values(k))
    piece = kept.since(RUN, 5)
    assert (piece.run, piece.first) == (RUN + 9, 0)
    assert piece.lows.tolist() == [values(np.arange(8)).min(axis=0).tolist()]


def test_the_page_reads_what_was_packed() -> None:
    piece = seen(range(25)).since(0, 0)
    packed = piece.packed()
    assert struct.unpack_from('<4I5d', packed) == (
        history.SAMPLES, 3, SIGNALS, 0, float(RUN), 0.0, 0.01, 0.024, 1e-3)
    numbers = np.frombuffer(packed, '<f4', offset=56)
    wanted = np.concatenate([piece.lows.ravel(), piece.highs.ravel(), piece.now])
    np.testing.assert_array_equal(numbers, wanted.astype(np.float32))


def test_memory_does_not_grow_with_time() -> None:
    kept = seen(range(1000))
    before = kept._lows.nbytes
    for k in range(1000, 10 * KEPT + 5000):
        kept.take(k, values(k))
    piece = kept.since(RUN, 0)
    assert kept._lows.nbytes == before
    assert len(piece.lows) == KEPT
    assert np.isfinite(piece.lows).all()
    assert piece.lows[-1].tolist() == values(np.arange(k - 9, k + 1)).min(axis=0).tolist()
