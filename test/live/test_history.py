# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The strip charts' history against all samples, in any portions."""

from __future__ import annotations

import struct
from typing import Any

from antenna_drive.live import history
from antenna_drive.live.history import History, KEPT
from hypothesis import given, strategies as st
import numpy as np

SIGNALS = {'test_signal': 1, 'plant': 2}
RUN = 1795262948317196


def frames(unit: str, steps: Any, run: int = RUN, step_s: float = 1e-3) -> Any:
    """Return frames whose values tell their step and signal."""
    steps = np.asarray(steps)
    rows = np.zeros((len(steps), 4 + 2 * SIGNALS[unit]))
    rows[:, 0], rows[:, 1], rows[:, 2] = run, steps, step_s
    for signal in range(SIGNALS[unit]):
        rows[:, 4 + 2 * signal] = value(unit, signal, steps)
    return rows


def value(unit: str, signal: int, steps: Any) -> Any:
    return np.sin(0.7 * steps + signal) + (unit == 'plant')


@given(st.integers(1, 9000), st.lists(st.integers(1, 700), min_size=1, max_size=9),
       st.sampled_from([1e-3, 2e-3, 0.05]))
def test_every_interval_has_the_least_and_the_greatest_sample(
        last: int, portions: list[int], step_s: float) -> None:
    kept = History(SIGNALS, 'test_signal')
    step, turn = 0, 0
    while step <= last:
        size = portions[turn % len(portions)]
        for unit in SIGNALS:
            kept.take(unit, frames(unit, np.arange(step, min(step + size, last + 1)),
                                   step_s=step_s))
        step, turn = step + size, turn + 1
    piece = kept.since(0, 0)
    per = max(1, round(0.01 / step_s))
    assert (piece.run, kept.lost) == (RUN, 0)
    assert piece.time_s == last * step_s
    assert piece.interval_s == per * step_s
    assert piece.first == max(0, last // per - KEPT + 1)
    assert piece.resume == max(piece.first, (last + 1) // per)
    assert len(piece.lows) == last // per + 1 - piece.first
    for number in range(piece.first, last // per + 1):
        steps = np.arange(number * per, min((number + 1) * per, last + 1))
        column = 0
        for unit, count in SIGNALS.items():
            for signal in range(count):
                samples = value(unit, signal, steps)
                assert piece.lows[number - piece.first, column] == samples.min()
                assert piece.highs[number - piece.first, column] == samples.max()
                end = piece.ends[number - piece.first, column]
                assert end == samples[-1] if len(steps) == per else np.isnan(end)
                column += 1
    assert piece.now[0] == value('test_signal', 0, last)


def test_pieces_that_follow_each_other_are_the_whole() -> None:
    kept, got = History(SIGNALS, 'test_signal'), {}
    at = 0
    for step in range(0, 500, 7):
        for unit in SIGNALS:
            kept.take(unit, frames(unit, np.arange(step, step + 7)))
        piece = kept.since(RUN, at)
        assert piece.first == at
        got.update({piece.first + n: row for n, row in enumerate(piece.lows.tolist())})
        at = piece.resume
    assert [got[n] for n in sorted(got)] == kept.since(RUN, 0).lows.tolist()


def test_steps_that_never_came_are_counted_and_left_empty() -> None:
    kept = History(SIGNALS, 'test_signal')
    for unit in SIGNALS:
        kept.take(unit, frames(unit, [*range(10, 30), *range(60, 80)]))
    assert kept.lost == 2 * 30, 'nothing before the first that came was lost'
    lows = kept.since(0, 0).lows
    assert np.isnan(lows[[0, 3, 4, 5]]).all()
    assert np.isfinite(lows[[1, 2, 6, 7]]).all()
    kept = History(SIGNALS, 'test_signal')
    for unit in SIGNALS:
        kept.take(unit, frames(unit, [*range(19), *range(20, 30)]))
    ends = kept.since(0, 0).ends[:, 0]
    assert np.isnan(ends[1]), 'step 19 never came'
    assert ends[[0, 2]].tolist() == [value('test_signal', 0, 9), value('test_signal', 0, 29)]


def test_another_run_begins_when_the_conductor_says_so() -> None:
    kept = History(SIGNALS, 'test_signal')
    for unit in SIGNALS:
        kept.take(unit, frames(unit, range(50)))
    # the plant is ahead of what was read of the conductor
    kept.take('test_signal', frames('test_signal', range(50, 55)))
    kept.take('plant', np.concatenate([frames('plant', range(50, 55)),
                                       frames('plant', range(5), RUN + 9)]))
    assert kept.since(RUN, 0).run == RUN
    kept.take('test_signal', frames('test_signal', range(8), RUN + 9))
    kept.take('plant', frames('plant', range(5, 8), RUN + 9))
    piece = kept.since(RUN, 5)
    assert (piece.run, piece.first, kept.lost) == (RUN + 9, 0, 0)
    assert piece.lows[0, 1] == value('plant', 0, np.arange(8)).min()


def test_what_the_drive_did_not_send_is_left_out() -> None:
    kept = History(SIGNALS, 'test_signal')
    kept.take('test_signal', frames('test_signal', range(20)))
    kept.take('plant', frames('plant', range(20)))
    before = kept.since(0, 0)
    bad = frames('plant', [19, 3, 10**15, 10**7])
    odd = frames('plant', [20, 21, 22], run=RUN + 3)
    nan = frames('plant', [20])
    nan[0, 5] = np.nan
    kept.take('plant', np.concatenate([bad, odd, nan]))
    kept.take('test_signal', frames('test_signal', [5], run=0))
    after = kept.since(0, 0)
    assert after.run == before.run
    assert after.highs.tolist() == before.highs.tolist()


def test_two_nodes_of_one_name_are_not_mixed_in_one_curve() -> None:
    kept, alone = History(SIGNALS, 'test_signal'), History(SIGNALS, 'test_signal')
    other = frames('plant', range(40))
    other[:, 3], other[:, 4:] = 8.0, 5.0
    kept.take('test_signal', frames('test_signal', range(40)))
    kept.take('plant', np.concatenate([frames('plant', range(20)), other]))
    kept.take('plant', np.concatenate([other, frames('plant', range(20, 40))]))
    for unit in SIGNALS:
        alone.take(unit, frames(unit, range(40)))
    assert kept.since(0, 0).highs.tolist() == alone.since(0, 0).highs.tolist()
    assert kept.lost == 0


def test_the_page_reads_what_was_packed() -> None:
    kept = History(SIGNALS, 'test_signal')
    for unit in SIGNALS:
        kept.take(unit, frames(unit, range(25)))
    piece = kept.since(0, 0)
    packed = piece.packed()
    assert struct.unpack_from('<4I5d', packed) == (
        history.SAMPLES, 3, 3, 0, float(RUN), 0.0, 0.01, 0.024, 1e-3)
    numbers = np.frombuffer(packed, '<f4', offset=56)
    wanted = np.concatenate([piece.lows.ravel(), piece.highs.ravel(), piece.now])
    np.testing.assert_array_equal(numbers, wanted.astype(np.float32))


def test_memory_does_not_grow_with_time() -> None:
    kept = History(SIGNALS, 'test_signal')
    for unit in SIGNALS:
        kept.take(unit, frames(unit, range(1000)))
    before = kept._lows.nbytes
    for start in range(1000, 200_000, 1000):
        for unit in SIGNALS:
            kept.take(unit, frames(unit, range(start, start + 1000)))
    piece = kept.since(RUN, 0)
    assert kept._lows.nbytes == before
    assert len(piece.lows) == KEPT
    assert np.isfinite(piece.lows).all()
