# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Steps put together from frames, whoever comes late, twice or in whatever order."""

from __future__ import annotations

import math
from pathlib import Path
import random
import tracemalloc

from antenna_drive.lockstep.following import Follower
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.recorder import RunRecorder
from antenna_drive.recording.recording import Change
from antenna_drive.recording.sheet import parse_sheet
from hypothesis import given, strategies as st
import pytest
from simgap.logs.channel import RecordingError

UNITS = {'test_signal': 1, 'motor_1': 2, 'plant': 1}
LENGTHS = {unit: 4 + 2 * count for unit, count in UNITS.items()}
RUN = 1_700_000_000_000_000


def frame(unit: str, step: int, run: int = RUN, sender: float = 7.0) -> tuple[float, ...]:
    """Return a frame whose values tell unit, signal and step."""
    base = 1000.0 * list(UNITS).index(unit)
    values: list[float] = []
    for signal in range(UNITS[unit]):
        values += [base + 100.0 * signal + 1e-3 * step, -1.0]
    return (float(run), float(step), 1e-3, sender, *values)


def expected(step: int) -> list[float]:
    return [1000.0 * i + 100.0 * signal + 1e-3 * step
            for i, count in enumerate(UNITS.values()) for signal in range(count)]


@given(st.integers(0, 2**32), st.integers(0, 30), st.integers(1, 60),
       st.lists(st.integers(0, 3), min_size=3, max_size=3))
def test_every_step_once_and_in_order_however_the_units_interleave(
        seed: int, joined: int, count: int, ahead: list[int]) -> None:
    rng = random.Random(seed)
    follower = Follower(LENGTHS, 'test_signal')
    # who comes late finds each unit's memory to begin at another step
    queues = {unit: [frame(unit, k) for k in range(joined + late, joined + late + count + 5)]
              for unit, late in zip(UNITS, ahead, strict=True)}
    steps = []
    while any(queues.values()):
        unit = rng.choice([u for u, queue in queues.items() if queue])
        item = queues[unit].pop(0)
        follower.receive(unit, item)
        if rng.random() < 0.2:
            follower.receive(unit, item)  # a frame may come twice
        steps += list(follower.steps())
    follower.finish()
    steps += list(follower.steps())
    first, last = joined + max(ahead), joined + min(ahead) + count + 4
    assert [step.number for step in steps] == list(range(first, last + 1))
    assert follower.lost == 0
    for step in steps:
        assert step.values == expected(step.number)
        assert (step.run, step.step_s) == (RUN, 1e-3)


def feed(follower: Follower, steps: range, run: int = RUN) -> list[int]:
    found = []
    for k in steps:
        for unit in UNITS:
            follower.receive(unit, frame(unit, k, run))
        found += [step.number for step in follower.steps() if step.run == run]
    return found


def test_memories_with_a_gap_are_followed_from_behind_it() -> None:
    """Under load a unit's memory loses frames on its way; the record then begins later."""
    follower = Follower(LENGTHS, 'test_signal')
    found = []
    for unit in UNITS:
        for k in range(500, 1500):
            if not (unit == 'plant' and 900 <= k < 930):
                follower.receive(unit, frame(unit, k))
            found += [step.number for step in follower.steps()]
    assert found == list(range(930, 1500))
    assert follower.lost == 0
    assert feed(follower, range(1500, 1520)) == list(range(1500, 1520))
    feed(follower, range(1530, 1540))
    assert follower.lost == 10, 'a gap behind the beginning is a loss'


def test_a_drive_that_waits_for_its_follower_is_followed() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    # The units have made step 1; the conductor sends it when the follower has taken step 0.
    for unit, number in (('motor_1', 0), ('motor_1', 1), ('plant', 0), ('plant', 1),
                         ('test_signal', 0)):
        follower.receive(unit, frame(unit, number))
    assert [step.number for step in follower.steps()] == [0]
    follower.receive('test_signal', frame('test_signal', 1))
    assert [step.number for step in follower.steps()] == [1]


def test_memories_of_a_drive_that_has_ended_are_kept() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    for unit in UNITS:
        for k in range(100, 200 + (unit == 'test_signal')):
            follower.receive(unit, frame(unit, k))
    assert not list(follower.steps())
    follower.finish()
    assert [step.number for step in follower.steps()] == list(range(100, 200))


def test_a_new_run_begins_with_the_conductor() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    assert feed(follower, range(5)) == [0, 1, 2, 3, 4]
    # the others may be heard of the new run before its owner, and old frames after it
    follower.receive('plant', frame('plant', 0, RUN + 1))
    follower.receive('motor_1', frame('motor_1', 0, RUN + 1))
    assert list(follower.steps()) == []
    follower.receive('test_signal', frame('test_signal', 0, RUN + 1))
    follower.receive('plant', frame('plant', 5))
    assert [step[:2] for step in follower.steps()] == [(RUN + 1, 0)]
    assert feed(follower, range(1, 3), RUN + 1) == [1, 2]


def test_nobody_but_the_conductor_begins_a_run() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    feed(follower, range(2))
    follower.receive('plant', frame('plant', 0, RUN + 9))
    assert follower.run == RUN


def test_lost_steps_are_counted_and_the_rest_goes_on() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    assert feed(follower, range(3)) == [0, 1, 2]
    for unit in UNITS:
        for k in range(3, 8):
            if not (unit == 'plant' and k in (4, 5)):
                follower.receive(unit, frame(unit, k))
    assert [step.number for step in follower.steps()] == [3, 6, 7]
    assert follower.lost == 2


def test_losses_of_one_run_are_not_forgotten_in_the_next() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    feed(follower, range(3))
    feed(follower, range(7, 9))
    assert follower.lost == 4
    assert feed(follower, range(4), RUN + 1) == [0, 1, 2, 3]
    assert follower.lost == 4
    feed(follower, range(2, 4), RUN + 2)
    assert follower.lost == 6, 'a run that follows another is there from step 0 on'


def test_what_is_complete_of_a_run_comes_before_the_next() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    feed(follower, range(3))
    # the conductor's frames are read first, and the next run stands behind those of this one
    for unit in UNITS:
        for k in range(3, 6):
            follower.receive(unit, frame(unit, k))
        follower.receive(unit, frame(unit, 0, RUN + 1))
    assert [step[:2] for step in follower.steps()] == [
        (RUN, 3), (RUN, 4), (RUN, 5), (RUN + 1, 0)]
    assert follower.lost == 0


def test_steps_that_stay_incomplete_at_the_end_of_a_run_are_lost_if_all_have_made_them() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    feed(follower, range(3))
    for k in range(3, 6):
        follower.receive('test_signal', frame('test_signal', k))
    follower.receive('motor_1', frame('motor_1', 3))
    assert feed(follower, range(2), RUN + 1) == [0, 1]
    assert follower.lost == 2, 'steps 3 and 4: without them the conductor had not made step 5'


@pytest.mark.parametrize('run', [RUN + 1, 2**51, 2**52 - 1])
def test_an_invented_announcement_begins_no_run(run: int) -> None:
    follower = Follower(LENGTHS, 'test_signal')
    feed(follower, range(3))
    follower.receive('test_signal', frame('test_signal', 0, run))
    assert feed(follower, range(3, 6)) == [3, 4, 5]
    assert follower.run == RUN
    assert feed(follower, range(3), RUN + 2) == [0, 1, 2], 'nor does it stand in the way of one'
    assert follower.lost == 0


@given(st.lists(st.tuples(
    st.sampled_from(list(UNITS)), st.sampled_from([RUN - 1, RUN, RUN + 1, 2**52, 1.5, -1.0]),
    st.one_of(st.integers(50, 2**60), st.sampled_from([-1.0, 0.5, 1e300])))))
def test_invented_frames_take_no_step_away(
        invented: list[tuple[str, float, float]]) -> None:
    follower = Follower(LENGTHS, 'test_signal')
    found = feed(follower, range(2))
    for unit, run, step in invented:
        follower.receive(unit, (float(run), float(step), 1e-3, *frame(unit, 0)[3:]))
    found += feed(follower, range(2, 20))
    assert found == list(range(20))
    assert follower.lost == 0


def test_frames_of_a_second_node_of_one_name_are_refused_and_told() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    assert feed(follower, range(3)) == [0, 1, 2]
    for k in range(1, 6):  # it may be late, or the first
        other = (*frame('plant', k, sender=8.0)[:4], -5.0, -5.0)
        follower.receive('plant', other)
    assert (follower.refused, follower.doubled) == (5, {'plant': (7.0, 8.0)})
    for k in range(3, 6):
        for unit in UNITS:
            follower.receive(unit, frame(unit, k))
    assert [step.values for step in follower.steps()] == [expected(k) for k in range(3, 6)]
    follower = Follower(LENGTHS, 'test_signal')
    feed(follower, range(3))
    for unit in UNITS:  # a node that was started again is none: it takes part in younger runs
        follower.receive(unit, frame(unit, 0, RUN + 1, sender=9.0))
    assert [step.number for step in follower.steps()] == [0]
    assert not follower.doubled


def test_a_flood_of_invented_steps_is_not_kept() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    feed(follower, range(2))
    tracemalloc.start()
    try:
        for k in range(100_000, 120_000):
            follower.receive('plant', frame('plant', k))
            follower.receive('plant', frame('plant', k, RUN + k))
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert held < 5e6
    assert feed(follower, range(2, 20)) == list(range(2, 20))


@pytest.mark.parametrize('bad', [
    (), (1.0, 2.0), (float(RUN), 0.0, 1e-3, math.nan, 0.0), (float(RUN), 0.0, 1e-3, math.inf, 0.0),
    (math.nan, 0.0, 1e-3, 0.0, 0.0)])
def test_what_is_no_frame_is_counted_and_changes_nothing(bad: tuple[float, ...]) -> None:
    follower = Follower(LENGTHS, 'test_signal')
    follower.receive('test_signal', bad)
    assert follower.refused == 1
    assert feed(follower, range(2)) == [0, 1]


def test_a_hello_is_no_run() -> None:
    follower = Follower(LENGTHS, 'test_signal')
    for unit in UNITS:
        follower.receive(unit, frame(unit, 0, run=0))
    assert list(follower.steps()) == []


SIGNALS = {'motor_1/current': 'A', 'plant/encoder': 'rad'}
SETTINGS = {'motor_1': {'gearbox.half_gap': 0.148}, 'plant': {'modes': [2.2, 3.7]}}


def test_one_bag_for_each_run_with_its_configuration_and_changes(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path / 'a', SIGNALS, parse_sheet({'circuit': 'new'}), by='test')
    recorder.told('motor_1', {'run': 7, 'step': 0, 'settings': SETTINGS['motor_1']})
    recorder.begin(7, 0.002)
    for k in range(10):
        recorder.step(k, [0.1 * k, math.nan if k < 3 else 1.0])
    assert not recorder.knows_configuration
    recorder.told('plant', {'run': 7, 'step': 0, 'settings': SETTINGS['plant']})
    recorder.told('motor_1', {'run': 7, 'step': 4, 'changes': {'pot': 0.5}})
    recorder.told('motor_1', {'run': 8, 'step': 2, 'changes': {'pot': 0.6}})  # of the next run
    recorder.told('motor_1', {'run': 6, 'step': 2, 'changes': {'pot': 0.7}})  # of one long over
    recorder.idle()
    assert recorder.knows_configuration
    recorder.begin(8, 0.001)
    recorder.step(0, [1.0, 1.0])
    recorder.close()
    first, second = read_bag(tmp_path / 'a'), read_bag(tmp_path / 'a_run_2')
    assert first.configuration == {'motor_1': {'gearbox.half_gap': 0.148},
                                   'plant': {'modes': (2.2, 3.7)}}
    assert first.changes == (Change(4, 'motor_1', {'pot': 0.5}),)
    assert first['motor_1/current'].time_ns.tolist() == list(range(0, 20_000_000, 2_000_000))
    assert len(first['plant/encoder']) == 7
    assert dict(first.notes) == {'by': 'test', 'step_s': 0.002, 'run': 7}
    assert first.sheet == second.sheet == parse_sheet({'circuit': 'new'})
    assert second.changes == (Change(2, 'motor_1', {'pot': 0.6}),)
    with pytest.raises(RecordingError, match='a: exists already'):
        RunRecorder(tmp_path / 'a', SIGNALS)
