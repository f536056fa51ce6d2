# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The Recording type against closed forms."""

from __future__ import annotations

import copy
import dataclasses
import doctest
import math
import pickle
from typing import Any

from antenna_drive.emulator.wiring import DRIVE, OUTPUTS
from antenna_drive.recording import recording as module
from antenna_drive.recording.recording import Change, Recording, unit_of
from antenna_drive.recording.sheet import parse_sheet
from hypothesis import given, strategies as st
import numpy as np
import pytest
from simgap.inputs.plain import PlainDataError
from simgap.logs.channel import Channel, nanoseconds, RecordingError

CURRENT, COMMAND = 'motor_1/current', 'test_signal/rate_command'


def ramp(rate_hz: float, seconds: float, slope: float = 2.0) -> Recording:
    time = np.arange(round(rate_hz * seconds)) / rate_hz
    return Recording.from_arrays(time, {CURRENT: slope * time, COMMAND: np.sin(time)})


def test_examples_in_the_documentation() -> None:
    assert doctest.testmod(module).failed == 0


@pytest.mark.parametrize('sent', [lambda item: pickle.loads(pickle.dumps(item)), copy.deepcopy],
                         ids=['to another process', 'copied'])
def test_what_arrives_is_the_same_and_cannot_be_changed_either(sent: Any) -> None:
    recording = Recording.from_arrays(
        [0.0, 1.0], {CURRENT: [1.0, -0.0]}, configuration={'axis': {'modes': [1.0, 2.0]}},
        changes=(Change(3, 'torque_share', {'bias_pot': 0.5}),),
        sheet=parse_sheet({'circuit': 'new', 'labels': {'oil': 'cold'}}), notes={'why': ['x']})
    found = sent(recording)
    assert found == recording and found is not recording
    with pytest.raises(ValueError, match='read-only'):
        found[CURRENT].values[0] = 3.0
    with pytest.raises(TypeError):
        found.configuration['axis']['modes'] = ()


def test_every_signal_of_the_drive_gets_its_unit_from_the_wiring() -> None:
    units = {f'{unit}/{s.name}': s.unit for unit, signals in OUTPUTS.items() for s in signals}
    assert {name: unit_of(name) for name in DRIVE.signals} == units
    assert unit_of('wind/speed') == unit_of('motor_1/nothing') == ''


def test_nothing_can_be_changed() -> None:
    values = np.array([1.0, 2.0])
    recording = Recording.from_arrays([0.0, 1.0], {CURRENT: values},
                                      configuration={'axis': {'modes': [1.0, 2.0]}})
    values[0] = 9.0
    assert recording[CURRENT].values.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match='read-only'):
        recording[CURRENT].values[0] = 3.0
    with pytest.raises(ValueError, match='read-only'):
        recording[CURRENT].time_ns[0] = 3
    with pytest.raises(dataclasses.FrozenInstanceError):
        recording.changes = ()  # type: ignore[misc]
    with pytest.raises(TypeError):
        recording.channels[CURRENT] = recording[CURRENT]  # type: ignore[index]
    with pytest.raises(TypeError):
        recording.configuration['axis']['modes'] = ()  # type: ignore[index]


@pytest.mark.parametrize(('time', 'values', 'words'), [
    ([0.0, 1.0, 1.0], [1.0, 2.0, 3.0], 'sample 2 at 1.000000000 s is not later'),
    ([0.0, 1.0], [1.0, math.nan], 'sample 1 at 1.000000000 s is nan'),
    ([0.0, 1.0], [math.inf, 1.0], 'sample 0 at 0.000000000 s is inf'),
    ([0.0, 1.0], [1.0], 'shape'),
    ([0.0, math.nan], [1.0, 2.0], 'not finite'),
    ([0.0, 1e10], [1.0, 2.0], 'beyond'),
])
def test_samples_that_are_none_are_refused(time: list[float], values: list[float],
                                           words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.from_arrays(time, {CURRENT: values})


@pytest.mark.parametrize('name', ['', '/', 'motor_1/', '/current', 'motor 1/current', '1/a',
                                  'motor_1/cur-rent', 'mötor/current'])
def test_names_that_can_be_no_topic_are_refused(name: str) -> None:
    with pytest.raises(RecordingError, match='no name of a signal'):
        Recording.from_arrays([0.0], {name: [1.0]})


def test_what_is_no_plain_data_is_refused_with_its_place() -> None:
    with pytest.raises(RecordingError, match=r'axis\.modes\[1\]: nan'):
        Recording({}, configuration={'axis': {'modes': [1.0, math.nan]}})
    with pytest.raises(RecordingError, match='bytes'):
        Recording({}, notes={'a': b'x'})
    assert issubclass(PlainDataError, ValueError)


@given(st.integers(-9_200_000_000, 9_200_000_000), st.integers(0, 999_999_999))
def test_seconds_to_nanoseconds_are_nearest(whole: int, rest: int) -> None:
    stamp = whole * 10**9 + rest
    seconds = stamp / 10**9  # Python divides integers correctly rounded
    spacing = math.ulp(seconds) * 10**9
    if abs(stamp) <= 9.2e18:
        assert abs(nanoseconds(seconds) - stamp) <= max(0.5, spacing)
        if spacing < 0.25:
            assert nanoseconds(seconds) == stamp


@given(st.integers(0, 10**9), st.sampled_from([1e-3, 2.5e-5, 2e-3]))
def test_times_of_steps_are_whole_nanoseconds(k: int, step_s: float) -> None:
    assert nanoseconds(k * step_s) == k * round(step_s * 1e9)


def test_equality_is_to_the_last_bit() -> None:
    one = Recording.from_arrays([0.0], {CURRENT: [0.0]})
    other = Recording.from_arrays([0.0], {CURRENT: [-0.0]})
    assert one == Recording.from_arrays([0.0], {CURRENT: [0.0]})
    assert one != other
    assert one != dataclasses.replace(one, notes={'a': 1})


def test_a_signal_that_is_not_there_is_named_with_its_nearest() -> None:
    with pytest.raises(RecordingError, match='did you mean motor_1/current'):
        ramp(10, 1)['motor_1/curent']


def test_between_is_half_open_and_keeps_time_stamps() -> None:
    cut = ramp(10, 1).between(0.2, 0.5)
    assert cut[CURRENT].time_ns.tolist() == [200_000_000, 300_000_000, 400_000_000]
    assert cut[CURRENT].values == pytest.approx([0.4, 0.6, 0.8])
    assert ramp(10, 1).between() == ramp(10, 1)


def test_shift_moves_every_signal() -> None:
    moved = ramp(10, 1).shift_ns(250_000_000)
    assert moved[CURRENT].time_ns[0] == moved[COMMAND].time_ns[0] == 250_000_000
    assert ramp(10, 1).shift_ns(250_000_000).shift_ns(-250_000_000) == ramp(10, 1)


def repeated(count: int) -> Recording:
    """Return a ramp of a second again and again, as arrays."""
    values = {name: np.tile(channel.values, count)
              for name, channel in ramp(100, 1).channels.items()}
    return Recording.from_arrays(np.arange(100 * count) / 100, values)


def test_stamps_of_a_wall_clock_lose_no_nanosecond() -> None:
    start = 1_768_472_890_123_456_789  # a double knows such a time to 256 ns
    whole = repeated(3).shift_ns(start)
    assert whole[CURRENT].time_ns[1] == start + 10_000_000
    assert whole.shift_ns(-start) == repeated(3)
    assert np.all(np.diff(whole[CURRENT].time_ns) == 10_000_000)
    assert len(whole.between(1_768_472_891.0, 1_768_472_892.0)[CURRENT]) == 100


@given(st.lists(st.integers(1, 10**9), min_size=2, max_size=30), st.data())
def test_between_the_samples_of_a_ramp_lies_the_ramp(steps: list[int],
                                                     data: st.DataObject) -> None:
    stamps = np.cumsum(steps)
    channel = Channel('A', stamps, 3.0 * (stamps / 1e9) + 1.0)
    wanted = np.array(data.draw(st.lists(
        st.integers(int(stamps[0]), int(stamps[-1])), min_size=1, max_size=20)))
    assert channel.at(wanted) == pytest.approx(3.0 * (wanted / 1e9) + 1.0, rel=1e-12)


def test_values_at_its_own_times_are_the_samples() -> None:
    channel = ramp(70, 1)[COMMAND]
    assert channel.at(channel.time_ns).tobytes() == channel.values.tobytes()


def test_nothing_is_extrapolated() -> None:
    channel = Channel('A', np.array([0, 10]), np.array([1.0, 2.0]))
    for outside in (-1, 11):
        with pytest.raises(RecordingError, match='nothing is extrapolated'):
            channel.at(np.array([outside]))


def test_live_changes_are_kept_and_frozen() -> None:
    change = Change(7, 'torque_share', {'bias_pot': 0.8})
    recording = dataclasses.replace(ramp(10, 1), changes=(change,))
    assert recording.changes == (change,)
    with pytest.raises(TypeError):
        recording.changes[0].values['bias_pot'] = 1.0  # type: ignore[index]


def test_a_recording_shows_itself_in_two_lines() -> None:
    time = np.arange(20_000) * 1e-3
    recording = Recording.from_arrays(
        time, {name: np.sin(time) for name in DRIVE.signals},
        configuration={'plant': {'modes': [1.0] * 1000}},
        changes=[Change(k, 'motor_1', {'pot': 0.5}) for k in range(500)])
    for text in (repr(recording), str(recording)):
        assert len(text.splitlines()) == 2
        assert max(map(len, text.splitlines())) < 100
        assert f'{len(DRIVE.signals)} signals, {20_000 * len(DRIVE.signals)} samples' in text
        assert '0 to 19.999 s' in text and 'live changes: 500' in text
        assert 'test_signal/rate_command, ' in text
    assert repr(recording['motor_1/current']) == (
        'Channel [article A]: 20000 samples from 0 to 19.999 s, -1 to 1')
    assert repr(Recording({})) == 'Recording: 0 signals, 0 samples\n  '
    assert repr(Channel('', np.empty(0, np.int64), np.empty(0))) == 'Channel: no sample'
