# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The figures of a recording against numbers worked out by hand."""

from __future__ import annotations

import math

from antenna_drive.recording.figures import crossings, share_of_time, statistics
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import Sensors, TestSheet
from hypothesis import given, strategies as st
import numpy as np
import pytest
from simgap.logs.channel import Channel


def test_shares_of_time_count_the_time_and_not_the_samples() -> None:
    # true from 0 to 1 s and from 8 to 10 s, sampled unevenly
    stamps = np.array([0, 1, 2, 8, 9, 10]) * 10**9
    channel = Channel('V', stamps, np.array([0.0, 5.0, 6.0, 0.0, 0.0, 7.0]))
    assert share_of_time(channel, channel.values <= 0.0) == pytest.approx(0.3)


@pytest.mark.parametrize(('torque', 'count'), [
    ([1.0, 1.0, 2.0], 0), ([1.0, 0.0, 0.0, 1.0], 0), ([1.0, 0.0, 0.0, -1.0], 1),
    ([1.0, -1.0, 1.0, -1.0], 3), ([0.0, 0.0], 0), ([], 0), ([0.0, -2.0, 0.0, 3.0, 0.0], 1)])
def test_crossings_leave_the_time_inside_the_gap_out(torque: list[float], count: int) -> None:
    assert crossings(np.array(torque)) == count


@given(st.integers(1, 40))
def test_a_sine_crosses_twice_a_period(periods: int) -> None:
    time = (np.arange(100 * periods) + 0.5) / 100
    assert crossings(np.sin(2 * math.pi * time)) == 2 * periods - 1


def made_up(sheet: TestSheet) -> Recording:
    time = np.arange(1000) * 1e-3
    half = time < 0.5
    return Recording.from_arrays(time, {
        'torque_share/bias_voltage': np.where(half, 0.02, 9.0),
        'motor_1/current': np.where(time == 0.25, -4.5, 2.0),
        'motor_1/tach_rate': np.where(half, 0.01, 3.0),
        'motor_1/gear_torque': np.where(half, 5.0, -5.0),
        'motor_2/ammeter': 3.0 * np.sqrt(2.0) * np.sin(2 * np.pi * time),
        'plant/axis_rate': np.where(half, 0.0, 1e-4)}, sheet=sheet)


def test_what_counts_as_zero_is_what_the_sensors_cannot_tell_from_it() -> None:
    exact = statistics(made_up(TestSheet()))
    assert exact.bias is not None
    assert (exact.bias.at_zero, exact.bias.zero_V) == (0.0, 0.0)
    assert exact.motors['motor_1'].stick == 0.0
    noisy = statistics(made_up(TestSheet(sensors=Sensors(
        bias_noise_V=0.01, bias_step_V=0.02, tach_noise_rad_s=0.003, tach_step_rad_s=0.02))))
    assert noisy.bias is not None
    assert noisy.bias.zero_V == pytest.approx(0.03)
    assert noisy.bias.at_zero == pytest.approx(0.5, abs=0.002)
    assert noisy.motors['motor_1'].still_rad_s == pytest.approx(0.02)
    assert noisy.motors['motor_1'].stick == pytest.approx(0.5, abs=0.002)


def test_every_figure_of_a_made_up_recording() -> None:
    figures = statistics(made_up(TestSheet()))
    motor = figures.motors['motor_1']
    assert (figures.start_s, figures.end_s) == (0.0, 0.999)
    assert (figures.bias and (figures.bias.minimum_V, figures.bias.maximum_V)) == (0.02, 9.0)
    assert (motor.current_peak_A, motor.current_peak_s) == (-4.5, 0.25)
    assert motor.backlash_crossings == 1
    assert figures.axis_stick == pytest.approx(0.5, abs=0.002)
    other = figures.motors['motor_2']  # the ammeter stands in for the current
    assert other.current_rms_A == pytest.approx(3.0, rel=1e-3)
    assert other.stick is None
    assert other.backlash_crossings is None


def test_nothing_recorded_gives_no_figures() -> None:
    figures = statistics(Recording({}))
    assert figures.bias is None
    assert figures.axis_stick is None
    assert all(motor.current_peak_A is None for motor in figures.motors.values())
