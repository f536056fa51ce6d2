# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Which parts of a recording are compared, and whether they can be simulated on their own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from antenna_drive.diagnosis.excitation import Bias
from antenna_drive.diagnosis.field_recording import FieldRecording, LATER_S, looked_at, SOUGHT_S
from antenna_drive.diagnosis.field_test import FieldTest, prepared, window_of
from antenna_drive.diagnosis.machine import AntennaMachine, TRUNCATED_S
from antenna_drive.diagnosis.sheet_settings import as_the_sheet_says
from antenna_drive.diagnosis.windows import first_window, Window
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
from antenna_drive.readings import AT, RATE_COMMAND
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import CircuitBias, FixedStepBias, TestSheet, Triangle
from field_runs import FAST_TRIANGLE, field_run, NOISE, SLOW_SQUARE
import numpy as np
import pytest
from simgap.logs.channel import Channel, NANOSECONDS
from simgap.machine.contract import Excerpt, FloatArray

# No jumps, whose times a recording tells to half a macro-step only.
SLOW_SINE: dict[str, Any] = {'waveform': 'sine', 'amplitude': 8.7e-4, 'period': 6.3}
SHEET = TestSheet(circuit='new', filter_1='new', bias=CircuitBias(start='zero'))
DRIVE = load('new_circuit')


def compared(**recordings: Recording) -> list[FieldTest]:
    return prepared(recordings, DRIVE, lambda note: None)


def misfit(test: FieldTest) -> FloatArray:
    """
    Return the misfit of each channel in standard deviations of its noise, by its median.

    The emulator's macro-steps delay an impact of teeth by a part of a millisecond, in which a
    tachometer changes by many standard deviations; such samples are few.
    """
    off = (test.measured - test.simulated(2.5e-3)) / NOISE
    off[:, AT['encoder']] -= np.median(off[:, AT['encoder']])
    return np.asarray(1.4826 * np.nanmedian(np.abs(off), axis=0))


def test_a_brief_recording_stays_whole() -> None:
    test, = compared(rec=field_run(DRIVE, 34.0, SHEET, start_after=1.9, **FAST_TRIANGLE))
    assert test.name == 'rec'
    assert test.time[0] == 0.0
    assert test.time[-1] == pytest.approx(34.0, abs=0.02)
    assert test.known_start


@pytest.mark.parametrize('signal', [SLOW_SINE, FAST_TRIANGLE])
@pytest.mark.parametrize('rest', [4.002, 9.002, 30.002])
@pytest.mark.slow
def test_after_a_rest_the_window_agrees_with_the_recording(signal: dict[str, Any],
                                                           rest: float) -> None:
    recording = field_run(DRIVE, rest + 40.0, SHEET, start_after=rest, **signal)
    window = first_window(FieldRecording.of('rec', recording, lambda note: None))
    assert window.compared == pytest.approx(rest - 1.0, abs=0.02)
    assert window.begin == (0.0 if rest < 12.0 else pytest.approx(rest - 6.0, abs=0.02))
    test = compared(a=recording, b=recording, c=recording)[0]
    assert test.known_start
    assert misfit(test).max() < 1.5


def test_of_a_day_the_first_minutes_of_the_motion_are_looked_at() -> None:
    """However late it begins; a command of nearly nothing before is none."""
    time = np.arange(0, 4000 * NANOSECONDS, NANOSECONDS // 10)
    rates = np.where(time < 1500 * NANOSECONDS, 1e-9, 1e-3 * np.sin(1e-9 * time))
    whole = Recording({name: Channel('rad/s', time, rates)
                       for name in (RATE_COMMAND, 'motor_1/tach_rate')})
    notes: list[str] = []
    part = looked_at('rec', whole, notes.append)
    assert part.end_ns / NANOSECONDS == pytest.approx(1500 + SOUGHT_S + LATER_S, abs=0.2)
    assert notes == ['rec: of 4000 s, what comes after 2760 s was not looked at']
    assert looked_at('rec', part, notes.append) is part and len(notes) == 1
    found = FieldRecording.of('rec', whole, notes.append)
    assert found.end < 3000.0
    assert found.end + found.later_s == pytest.approx(whole.duration_s, abs=0.2)


def test_an_offset_of_the_encoder_stays_after_a_long_rest() -> None:
    """The drive has not moved: the reading belongs to the angle at which it started."""
    off = changed(DRIVE, {'plant.encoder.offset': 3e-4})
    test, = compared(rec=field_run(off, 50.0, SHEET, start_after=20.0, **SLOW_SINE))
    shift = test.measured[:, AT['encoder']] - test.simulated(2.5e-3)[:, AT['encoder']]
    assert np.median(shift) == pytest.approx(3e-4, abs=1e-6)


def test_without_an_encoder_the_angle_follows_from_the_command() -> None:
    run = field_run(DRIVE, 20.0, SHEET, waveform='step', amplitude=1e-3, start_after=5.0)
    bare = replace(run, channels={name: run[name] for name in run if name != 'plant/encoder'})
    test = window_of(FieldRecording.of('rec', bare, lambda note: None),
                     Window(12.0, 15.0, 18.0, known_start=False), DRIVE, Bias())
    elevation = test.record['plant']['axis']['start_elevation'][0]
    assert elevation - DRIVE.plant.axis.start_elevation == pytest.approx(7e-3, abs=1e-5)


def test_a_window_in_the_middle_of_a_motion_agrees_once_it_has_settled() -> None:
    drive = DRIVE
    recording = field_run(drive, 140.0, SHEET, **FAST_TRIANGLE)
    whole = FieldRecording.of('rec', recording, lambda note: None)
    test = window_of(whole, Window(75.0, 90.0, 120.0, known_start=False),
                     *as_the_sheet_says(SHEET, drive))
    assert test.name == 'rec 90-120 s'
    assert test.time[0] == pytest.approx(15.0, abs=0.01)
    assert test.time[-1] == pytest.approx(45.0, abs=0.02)
    assert test.excerpt is not None
    assert test.excerpt == Excerpt('rec', test.excerpt.of_s, 75.0)
    assert test.excerpt.of_s == pytest.approx(140.0, abs=0.01)
    assert misfit(test).max() < 2.0
    # the elevation goes on from the angle that was reached
    angle = recording['plant/encoder'].values[75 * 200]
    elevation = test.record['plant']['axis']['start_elevation'][0]
    assert elevation - drive.plant.axis.start_elevation == pytest.approx(angle, abs=2e-5)
    # and the waves from the angle at which the simulation follows the recording
    recorded = np.interp(test.time + 75.0, recording['plant/encoder'].time_s,
                         recording['plant/encoder'].values)
    off = recorded - test.simulated(2.5e-3)[:, AT['encoder']]
    assert test.start_angle == pytest.approx(np.median(off), abs=1e-6)


def stepped(at: float, duration: float) -> Recording:
    """Return a run in which a source of bias is switched on."""
    drive = changed(DRIVE, {'torque_share.circuit.bias_source': 'fixed'})
    return field_run(drive, duration, changes={
        round(at / 1e-3): {'torque_share': {'fixed_voltage': 6.0}}}, **SLOW_SQUARE)


def test_a_step_of_the_bias_is_looked_at() -> None:
    recordings = {name: stepped(70.0, 150.0) for name in 'abc'}
    for test in prepared(recordings, DRIVE, lambda note: None):
        voltage = test.measured[:, AT['bias_voltage']]
        assert np.count_nonzero(voltage > 5.0) > 0.5 * voltage.size
        assert test.bias.after == pytest.approx(6.0, abs=0.01)
        shown = test.simulated(2.5e-3)[:, AT['bias_voltage']]
        assert np.abs(shown - voltage).max() < 0.1


def test_few_recordings_give_two_windows_each_and_many_one() -> None:
    recording = stepped(50.0, 150.0)
    few, many = (compared(**{name: recording for name in names}) for names in ('ab', 'abc'))
    assert len(few) <= 4
    assert len(many) == 3
    for test in (*few, *many):
        assert test.time[-1] - test.time[0] < 30.1


def test_a_search_sees_motion_after_a_rest() -> None:
    machine = AntennaMachine({'rec': field_run(DRIVE, 60.0, SHEET, start_after=29.0,
                                               **FAST_TRIANGLE)}, DRIVE, threads=1)
    brief = machine.truncated().experiments[0]
    assert brief.time[-1] - brief.time[0] <= TRUNCATED_S
    moving = np.abs(brief.measured[:, 2]) > 5.0
    assert np.mean(moving) > 0.7


def test_the_note_says_which_window() -> None:
    notes: list[str] = []
    prepared({'rec': field_run(DRIVE, 60.0, SHEET, start_after=20.0, **SLOW_SQUARE)}, DRIVE,
             notes.append)
    assert 'rec: of 60 s, 19 to 49 s are compared' in notes


def test_a_step_in_the_sheet_is_shifted_with_the_window() -> None:
    sheet = TestSheet(circuit='new', filter_1='new', bias=FixedStepBias(6.0, 70.0))
    recording = stepped(70.0, 150.0)
    test = compared(**{name: Recording(recording.channels, sheet=sheet) for name in 'abc'})[0]
    seen = test.measured[:, AT['bias_voltage']] > 3.0
    assert np.array_equal(seen, test.simulated(2.5e-3)[:, AT['bias_voltage']] > 3.0)


@pytest.mark.parametrize('signal, repeats', [
    ({'waveform': 'chirp', 'amplitude': 1e-3, 'sweep_from': 0.1, 'sweep_to': 4.0,
      'sweep_time': 28.0}, False),
    (FAST_TRIANGLE, True), (SLOW_SQUARE, True),
])
def test_a_recorded_sweep_is_searched_whole(signal: dict[str, Any], repeats: bool) -> None:
    test, = compared(rec=field_run(DRIVE, 30.0, SHEET, start_after=1.0, **signal))
    assert test.repeats == repeats


def test_a_late_window_keeps_the_time_of_the_recorder() -> None:
    """A sheet's waveform is 6 ms off after a minute if the recorder's clock is off by 1e-4."""
    late = changed(DRIVE, {'torque_share.circuit.bias_source': 'fixed'})
    run = field_run(late, 150.0, changes={70_000: {'torque_share': {'fixed_voltage': 6.0}}},
                    **FAST_TRIANGLE)
    fast = Recording.from_arrays(run['plant/encoder'].time_s * (1.0 + 1e-4), {
        name: run[name].values for name in run}, sheet=TestSheet(
            circuit='new', filter_1='new', waveform=Triangle(np.degrees(8e-3), 6.0, 0.0)))
    test = compared(a=fast, b=fast, c=fast)[0]
    begin = round(float(test.name.split()[1].split('-')[0]) - float(test.time[0]))
    at = (test.time + begin) / (1.0 + 1e-4)
    expected = np.interp(at, run['plant/encoder'].time_s, run['test_signal/rate_command'].values)
    assert np.abs(test.command(test.time) - expected).max() < 8e-3 * 1e-3
