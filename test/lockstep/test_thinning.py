# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Which steps come out of frames that are taken in bulk, in any portions."""

from __future__ import annotations

from typing import Any

from antenna_drive.lockstep.following import Thinned, Thinning
from hypothesis import given, strategies as st
import numpy as np

UNITS = ('plant', 'motor_1')
RUN = 1795262948317196


def frames(unit: str, steps: Any, run: int = RUN, step_s: float = 1e-3) -> Any:
    """Return frames of one signal, which tells its step and unit."""
    steps = np.asarray(list(steps), float)
    rows = np.zeros((len(steps), 6))
    rows[:, 0], rows[:, 1], rows[:, 2] = run, steps, step_s
    rows[:, 4] = steps + 0.5 * UNITS.index(unit)
    return rows


@given(st.lists(st.tuples(st.sampled_from(UNITS), st.integers(1, 90)), max_size=30),
       st.sampled_from([(1e-3, 50.0, 20), (1e-3, 1e4, 1), (2e-3, 300.0, 2), (0.05, 0.5, 40)]))
def test_every_nth_step_comes_once_and_in_order(
        portions: list[tuple[str, int]], rate: tuple[float, float, int]) -> None:
    step_s, rate_hz, every = rate
    thinning = Thinning(UNITS, rate_hz)
    sent, found = dict.fromkeys(UNITS, 0), list[Thinned]()
    for unit, count in portions:
        thinning.take(unit, frames(unit, range(sent[unit], sent[unit] + count), step_s=step_s))
        sent[unit] += count
        found += thinning.complete()
    assert [(step.run, step.step, step.step_s) for step in found] == [
        (RUN, step, step_s) for step in range(0, min(sent.values()), every)]
    assert all(step.values['motor_1'].tolist() == [step.step + 0.5] for step in found)


def test_what_was_not_sent_is_left_out_and_another_run_begins_at_0() -> None:
    thinning = Thinning(UNITS, 100.0)
    thinning.take('plant', frames('plant', [0, 10, 20, 30]))
    thinning.take('motor_1', frames('motor_1', [0, 20, 30]))
    bad = frames('motor_1', [40] * 5)
    bad[0, 5], bad[1, 0], bad[2, 2], bad[3, 1], bad[4, 0] = np.nan, 0.0, 0.0, -10.0, np.inf
    thinning.take('motor_1', bad)
    thinning.take('plant', frames('plant', [40]))
    assert [step.step for step in thinning.complete()] == [0, 20, 30]
    for unit in UNITS:
        thinning.take(unit, frames(unit, range(12), RUN + 9))
        thinning.take(unit, frames(unit, [50]))
    assert [(step.run - RUN, step.step) for step in thinning.complete()] == [
        (0, 50), (9, 0), (9, 10)]
    assert not thinning.complete()


def test_a_second_node_of_one_name_is_left_out() -> None:
    thinning = Thinning(UNITS, 1000.0)
    thinning.take('plant', frames('plant', range(3)))
    other = frames('motor_1', range(6))
    other[:, 3], other[:, 4] = 8.0, -1.0
    thinning.take('motor_1', np.concatenate([frames('motor_1', range(1)), other]))
    assert [step.step for step in thinning.complete()] == [0]
    thinning.take('motor_1', frames('motor_1', range(1, 3)))
    assert [step.values['motor_1'].tolist() for step in thinning.complete()] == [[1.5], [2.5]]


def test_what_never_becomes_complete_is_forgotten() -> None:
    thinning = Thinning(UNITS, 1000.0)
    for first in range(0, 20_000, 1000):
        thinning.take('plant', frames('plant', range(first, first + 1000)))
    thinning.take('motor_1', frames('motor_1', range(20_000)))
    assert len(thinning.complete()) == 4096
