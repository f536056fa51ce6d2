# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Readings at other times: against scipy's interpolation, and commands that jump later."""

from __future__ import annotations

from dataclasses import replace

from antenna_drive.diagnosis.field_test import Plans
from antenna_drive.diagnosis.late_readings import dense, lagging, parts_of, read_at
from antenna_drive.diagnosis.machine import AntennaMachine, LOW_FIDELITY_STEP
from antenna_drive.diagnosis.prediction import predict, recorder_errors
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
from antenna_drive.readings import AT
from antenna_drive.recording.recording import Recording
from field_runs import FAST_TRIANGLE, field_run
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from simgap.logs.channel import Channel
from simgap.machine.contract import FloatArray

RATE_HZ = 100.0
DEGREE = np.pi / 180.0


def test_between_outputs_it_is_the_cubic_of_values_and_slopes() -> None:
    random = np.random.default_rng(0)
    time = np.cumsum(random.uniform(0.005, 0.02, 300))
    out = random.normal(size=(300, 6, 2))
    wanted = np.linspace(time[3], time[-4], 500)
    late = random.uniform(-0.01, 0.01, 6)
    found = read_at(time, out, wanted, late)
    for c in range(6):
        exact = CubicHermiteSpline(time, out[:, c, 0], out[:, c, 1])(wanted - late[c])
        np.testing.assert_allclose(found[:, c], exact, atol=1e-12)


def test_behind_a_filter_it_is_the_answer_of_a_first_order_low_pass() -> None:
    """A sine that begins at rest, in closed form; a channel without a filter is as it was."""
    time, omega, lag = np.linspace(0.0, 1.0, 401), 6.0, 0.01
    wave = np.stack([np.sin(omega * time), omega * np.cos(omega * time)], axis=-1)
    out = np.stack([wave, wave], axis=1)
    found = lagging(time, out, np.array([lag, 0.0]))
    dying, factor = np.exp(-time / lag), 1.0 + (omega * lag) ** 2
    exact = (wave[:, 0] - omega * lag * (wave[:, 1] / omega - dying)) / factor
    slope = (wave[:, 1] + omega ** 2 * lag * wave[:, 0] - omega * dying) / factor
    np.testing.assert_allclose(found[:, 0, 0], exact, atol=3e-5)
    np.testing.assert_allclose(found[:, 0, 1], slope, atol=3e-3)
    assert np.array_equal(found[:, 1], wave)
    assert lagging(time, out, np.zeros(2)) is out


def test_a_fast_signal_is_read_late_without_loss() -> None:
    """A tenth of a turn between two samples; the first order would be off by a fifth of it."""
    samples = np.arange(0.0, 1.0, 0.01)
    time, omega, late = dense(samples, parts_of(0.01)), 2.0 * np.pi * 10.0, 0.007
    out = np.stack([np.sin(omega * time), omega * np.cos(omega * time)], axis=-1)[:, np.newaxis]
    found = read_at(time, out, samples, np.array([late]))[2:, 0]
    exact = np.sin(omega * (samples - late))[2:]
    first_order = (np.sin(omega * samples) - late * omega * np.cos(omega * samples))[2:]
    # the error of a cubic with right values and slopes at both ends
    bound = (omega * (time[1] - time[0])) ** 4 / 384.0
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=bound)
    assert bound < 5e-5
    assert np.abs(first_order - exact).max() > 0.05


def test_dense_times_hold_the_samples() -> None:
    time = np.array([0.0, 0.1, 0.4])
    assert (dense(time, 3)[::3] == time).all()
    assert np.diff(dense(time, 3)) == pytest.approx([0.1 / 3.0] * 3 + [0.1] * 3)


@pytest.mark.parametrize(('period', 'parts'), [(1e-3, 1), (5e-3, 1), (0.01, 2), (0.02, 4)])
def test_no_two_outputs_are_further_apart_than_one_long_step(period: float, parts: int) -> None:
    assert parts_of(period) == parts
    assert period / parts < LOW_FIDELITY_STEP


def stepping(jump_s: float) -> tuple[AntennaMachine, FloatArray]:
    """Return a drive whose command jumps at a time that its samples do not tell."""
    time = np.arange(0.0, 4.0, 1.0 / RATE_HZ)
    command = np.where(time < jump_s, 0.0, 0.05 * DEGREE)
    zero = np.zeros_like(time)
    stamps = np.round(1e9 * time).astype(np.int64)
    recording = Recording({name: Channel('rad/s', stamps, values) for name, values in (
        ('test_signal/rate_command', command), ('motor_1/tach_rate', zero))})
    return AntennaMachine({'step': recording}, load(), threads=1), time


def test_a_jump_between_two_samples_moves_the_whole_response() -> None:
    """A later jump, simulated, is the earlier one's response read later."""
    machine, time = stepping(2.001)
    test = machine._tests[0]
    assert isinstance(test.command, RecordedCommand)
    [jump] = [item for item in machine.nuisances if item.name.startswith('jump:')]
    assert jump.high == pytest.approx(0.5 / RATE_HZ)
    shift = 0.8 * jump.high
    moved, _ = stepping(2.001)
    moved._tests = [replace(test, command=replace(
        test.command, time=test.command.time + shift, jumps=test.command.jumps + shift))]
    moved._plans = Plans(moved._tests)
    moved._runs.clear()
    exact, found = moved.predict({}, 0), machine.predict({jump.name: shift}, 0)
    plain = machine.predict({}, 0)
    for c in range(exact.shape[1]):
        off, gap = np.abs(found - exact)[:, c].max(), np.abs(plain - exact)[:, c].max()
        assert off <= 0.12 * gap + 1e-9 or c == AT['encoder'], f'{c}: {off} of {gap}'
    assert np.abs(found - exact)[:, AT['encoder']].max() < 1e-7


@pytest.mark.parametrize('late_s', [0.0, 0.0037, 0.0095])
def test_a_ripple_faster_than_the_samples_is_read_late_without_loss(late_s: float) -> None:
    """A prediction of the whole recording is simulated at the late times themselves."""
    drive = changed(load(), {f'motor_1.tachometer.{name}': value for name, value in {
        'gain': 1.1, 'offset': 0.3, 'ripple': 0.1, 'ripple_cycles': 12.0, 'ripple_phase': 0.4,
        'ripple_second': 0.03, 'ripple_third': 0.01, 'ripple_third_phase': 2.0}.items()})
    recording = field_run(drive, 6.0, every=10, **FAST_TRIANGLE)
    errors = [{'name': 'delay:tach_1', 'value': late_s}]
    exact = predict('rec', recording, drive, recorder_errors(errors)).predicted
    found = AntennaMachine({'rec': recording}, drive).predict({'delay:tach_1': late_s}, 0)
    rate = exact[:, AT['tach_2']]
    assert np.abs(np.diff(exact[:, AT['tach_1']])).max() > 0.1 * np.abs(rate).max()
    assert 12.0 * np.abs(rate).max() / (2.0 * np.pi) > RATE_HZ
    off = np.abs(found - exact)[5:, AT['tach_1']]
    assert np.median(off) < 1e-3 * np.abs(rate).max()
    assert np.quantile(off, 0.95) < 0.01 * np.abs(rate).max()


def test_a_verdict_may_say_how_far_a_channel_lags() -> None:
    found = recorder_errors([{'name': 'lag:bias_voltage', 'value': 0.02}])
    assert found.lag[AT['bias_voltage']] == 0.02
