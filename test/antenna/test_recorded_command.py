# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A command that is known from its samples, against the closed form that was sampled."""

from __future__ import annotations

from collections.abc import Callable

from antenna_drive.diagnosis.recorded_command import RecordedCommand, regular_times
from hypothesis import given, strategies as st
import numpy as np
import pytest
from simgap.machine.contract import FloatArray

PERIOD = 0.02


def sampled(waveform: Callable[[FloatArray], FloatArray], end: float = 30.0) -> RecordedCommand:
    time = np.arange(0.0, end, PERIOD)
    return RecordedCommand.of(time, waveform(time))


def square(time: FloatArray, start: float, half: float) -> FloatArray:
    """Return a square wave that begins after a rest."""
    turns = np.floor((time - start) / half)
    return np.where(time < start, 0.0, np.where(turns % 2.0 == 0.0, 1e-3, -1e-3))


@given(half=st.floats(1.0, 4.0), start=st.floats(0.1, 3.0))
def test_jumps_stay_between_their_samples(half: float, start: float) -> None:
    time = np.arange(0.0, 40.0, PERIOD)
    command = RecordedCommand.of(time, square(time, start, half))
    np.testing.assert_allclose(command(time), square(time, start, half), rtol=0.0, atol=1e-15)
    count = np.count_nonzero(np.diff(square(time, start, half)))
    assert command.jumps.size == count


def test_many_jumps_tell_their_times_better_than_each_its_own() -> None:
    """Over squares of any period, the usual error is a fraction of that of halfway."""
    random = np.random.default_rng(5)
    regular, halfway = [], []
    for half, start in random.uniform([2.5, 0.0], [3.75, 3.0], (60, 2)):
        true = start + half * np.arange(int(30.0 / half))
        after = PERIOD * np.floor(true / PERIOD)
        regular.append(np.mean(np.abs(regular_times(after, after + PERIOD) - true)))
        halfway.append(np.mean(np.abs(after + 0.5 * PERIOD - true)))
    assert np.median(regular) < 0.4 * np.median(halfway)


def test_jumps_that_alternate_between_two_pauses_are_regular() -> None:
    """No time is off by more than the slow beat of the period and the samples leaves open."""
    true = np.cumsum(np.tile([4.7743, 1.5011], 12))
    after = PERIOD * np.floor(true / PERIOD)
    found = regular_times(after, after + PERIOD)
    assert np.ptp(np.diff(found)[::2]) < 1e-9
    assert np.abs(found - true).max() < 0.3 * PERIOD


def test_irregular_jumps_are_taken_halfway() -> None:
    after = np.array([1.0, 2.3, 2.9, 5.1, 5.6, 9.0, 9.2, 12.0])
    found = regular_times(after, after + PERIOD)
    np.testing.assert_allclose(found, after + 0.5 * PERIOD)


def test_jumps_on_a_grid_are_regular_though_some_of_its_times_have_none() -> None:
    """Levels that are drawn at even times repeat now and then: there is no jump to see."""
    number = np.array([1, 2, 3, 5, 6, 8, 11, 12, 13])
    true = 0.3713 + 2.0531 * number
    after = PERIOD * np.floor(true / PERIOD)
    before = after + PERIOD
    before[4] += 0.15  # rows are missing here
    after[4] -= 0.05
    found = regular_times(after, before)
    assert np.abs(found - true).max() < 0.5 * PERIOD


def test_a_jump_among_missing_rows_may_come_at_any_time_between() -> None:
    time = np.arange(0.0, 12.0, PERIOD)
    true = np.array([1.0, 2.3, 2.9, 5.13, 5.6, 9.0])
    value = np.where(np.searchsorted(true, time, side='right') % 2, 1e-3, 0.0)
    there = (time < 5.05) | (time > 5.25)
    command = RecordedCommand.of(time[there], value[there])
    off = true - command.jumps
    # one of them jumps on a sample
    assert (command.slack[:, 0] < off).all() and (off < command.slack[:, 1] + 1e-8).all()
    np.testing.assert_array_equal(np.ptp(command.slack, axis=1) > 2.0 * PERIOD,
                                  [0, 0, 0, 1, 0, 0])
    moved = command.with_jump(3, float(true[3] - command.jumps[3]))
    places = np.linspace(0.5, 11.9, 4999)
    beside = np.abs(places[:, np.newaxis] - true).min(axis=1) > PERIOD
    beside |= np.abs(places - true[3]) < PERIOD
    wanted = np.where(np.searchsorted(true, places, side='right') % 2, 1e-3, 0.0)
    np.testing.assert_allclose(moved(places)[beside], wanted[beside], rtol=0.0, atol=1e-12)


def test_a_jump_into_a_motion_comes_later_and_the_motion_does_not() -> None:
    true, size = 3.1234, 1e-3

    def multisine(time: FloatArray) -> FloatArray:
        return np.where(time < true, 0.0, size * (
            1.0 + 0.5 * np.sin(2.0 * np.pi * 0.7 * (time - true))
            + 0.2 * np.sin(2.0 * np.pi * 2.3 * (time - true))))

    time = np.arange(0.0, 12.0, PERIOD)
    command = RecordedCommand.of(time, multisine(time))
    assert command.jumps.size == 1
    off = float(true - command.jumps[0])
    assert command.slack[0, 0] < off < command.slack[0, 1]
    assert np.ptp(command.slack[0]) == pytest.approx(PERIOD, rel=1e-4)
    moved = command.with_jump(0, off)
    places = np.linspace(0.5, 11.9, 9999)
    # from the jump to the next sample it is taken as level
    steepest = size * 2.0 * np.pi * (0.5 * 0.7 + 0.2 * 2.3)
    np.testing.assert_allclose(moved(places), multisine(places), rtol=0.0,
                               atol=steepest * PERIOD)
    assert np.abs(command(places) - multisine(places)).max() > 0.9 * size


def lacking(command: Callable[[FloatArray], FloatArray], begin: float,
            end: float) -> RecordedCommand:
    """Return a recorded command without the rows between two times."""
    time = np.arange(0.0, 12.0, PERIOD)
    time = time[(time < begin) | (time > end)]
    return RecordedCommand.of(time, command(time))


def test_straight_lines_go_on_where_rows_are_missing() -> None:
    """A ramp is no jump, however far it gets among them; nor is a corner that both sides tell."""
    def triangle(time: FloatArray) -> FloatArray:
        return np.asarray(np.interp(time, [0.0, 3.0, 6.0, 9.0, 12.0], [0.0, 1.0, 0.0, 1.0, 0.0]))

    for begin, end in ((4.0, 4.5), (5.85, 6.2)):
        command = lacking(triangle, begin, end)
        assert command.jumps.size == command.holes.size == 0
        places = np.linspace(0.1, 11.9, 4999)
        np.testing.assert_allclose(command(places), triangle(places), rtol=0.0, atol=1e-9)


def test_what_nobody_recorded_is_open_within_a_hole() -> None:
    """A slow sine is told by what is around the hole, a fast one is not; its mean may be found."""
    omega = 2.0 * np.pi * 3.0
    assert lacking(lambda t: np.asarray(np.sin(t)), 4.0, 4.1).holes.size == 0
    command = lacking(lambda t: np.asarray(np.sin(omega * t)), 4.0, 4.27)
    (begin, end), = command.holes
    assert 4.0 - PERIOD <= begin <= 4.0 and 4.27 <= end <= 4.27 + PERIOD
    assert command.jumps.size == 0 and command.uncertainty[0] > 0.1
    places = np.linspace(begin, end, 20001)
    changed = command.with_mean(0, 0.25)
    assert np.mean(changed(places) - command(places)) == pytest.approx(0.25, rel=1e-3)
    outside = np.r_[np.linspace(1.0, begin, 999), np.linspace(end, 11.0, 999)]
    np.testing.assert_array_equal(changed(outside), command(outside))
    np.testing.assert_allclose(command.part(2.0, 10.0).holes, command.holes - 2.0)
    assert command.part(5.0, 10.0).holes.size == 0


@pytest.mark.parametrize('hertz', [0.3, 2.0, 5.0])
def test_a_sine_is_smooth_between_its_samples(hertz: float) -> None:
    omega = 2.0 * np.pi * hertz
    command = sampled(lambda t: np.asarray(np.sin(omega * t)))
    places = np.linspace(1.0, 29.0, 20011)
    # a straight line is off by (omega h)^2 / 8; slopes from neighbours by (omega h)^3 / 24
    assert np.abs(command(places) - np.sin(omega * places)).max() < (omega * PERIOD) ** 3 / 20.0


@given(start=st.floats(1.0, 2.0), phase=st.floats(0.25, 0.35) | st.floats(0.75, 0.85),
       hertz=st.floats(3.0, 5.0), last=st.floats(0.15, 0.25) | st.floats(0.65, 0.75))
def test_a_fast_motion_that_is_cut_off_jumps(start: float, phase: float, hertz: float,
                                             last: float) -> None:
    """A sine begins and ends far from zero, and would not have been at rest a sample away."""
    end, turn = start + (40.0 + last - phase) / hertz, 2.0 * np.pi

    def burst(time: FloatArray) -> FloatArray:
        return np.where((time >= start) & (time < end),
                        np.sin(turn * (hertz * (time - start) + phase)), 0.0)

    command = sampled(burst, end + 1.0)
    assert command.jumps.size == 2
    late = np.array([start, end]) - command.jumps
    assert np.abs(late).max() <= 0.5 * PERIOD + 1e-9
    places = np.linspace(0.0, end + 0.9, 9973)
    apart = (abs(places - start) > PERIOD) & (abs(places - end) > PERIOD)
    tolerance = (turn * hertz * PERIOD) ** 3 / 10.0
    np.testing.assert_allclose(command(places[apart]), burst(places[apart]), rtol=0.0,
                               atol=tolerance)
    # a motion goes on up to its jump
    exact = command.with_jump(0, late[0]).with_jump(1, late[1])
    inside = (places > start + 1e-6) & (places < end - 1e-6)
    np.testing.assert_allclose(exact(places[inside]), burst(places[inside]), rtol=0.0,
                               atol=(turn * hertz * PERIOD) ** 3)


@pytest.mark.parametrize('ending', [
    lambda t: np.interp(t, [1.0, 1.307, 1.613, 1.931], [0.0, 1.0, -1.0, 0.0]),
    lambda t: np.where(abs(t - 2.003) < 0.5, 1.0 + np.cos(2.0 * np.pi * (t - 2.003)), 0.0),
    lambda t: np.where(t < 3.007, 0.0, 1.0 - np.exp(-3.0 * (t - 3.007))),
], ids=['lines', 'cosine', 'filtered step'])
def test_a_motion_that_comes_to_rest_does_not_jump(
        ending: Callable[[FloatArray], FloatArray]) -> None:
    assert sampled(ending, 6.0).jumps.size == 0


def test_straight_lines_and_corners_on_samples_are_exact() -> None:
    def triangle(time: FloatArray) -> FloatArray:
        return np.asarray(np.interp(time, np.arange(0.0, 31.0), np.tile([0.0, 1.0], 16)[:31]))

    places = np.linspace(0.0, 29.9, 9973)
    assert np.abs(sampled(triangle)(places) - triangle(places)).max() < 1e-9


def test_a_part_is_the_whole_in_another_time() -> None:
    command = sampled(lambda t: np.asarray(np.sin(t) + np.sign(np.sin(0.7 * t))))
    part = command.part(7.013, 19.4)
    times = np.linspace(0.0, 12.3, 997)
    np.testing.assert_allclose(part(times), command(times + 7.013), rtol=0.0, atol=1e-6)
    inside = command.jumps[(command.jumps > 7.013) & (command.jumps < 19.4)]
    np.testing.assert_allclose(part.jumps, inside - 7.013)


def test_before_its_first_sample_nothing_is_commanded() -> None:
    assert not sampled(lambda t: np.asarray(np.cos(t)))(np.array([-1.0, -1e-6])).any()
