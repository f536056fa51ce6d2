# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Columns that cannot be of this drive are refused with the reason; effects of it never are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from antenna_drive.diagnosis.field_recording import FieldRecording
from antenna_drive.diagnosis.suitability import check
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.recording import Recording
from field_runs import FAST_TRIANGLE, field_run, SLOW_SQUARE
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.machine.contract import FloatArray

DRIVE = load('new_circuit')
RUNS = {'square': field_run(DRIVE, 30.0, start_after=2.0, **SLOW_SQUARE),
        'triangle': field_run(DRIVE, 30.0, **FAST_TRIANGLE)}


def judged(recording: Recording) -> list[str]:
    notes: list[str] = []
    check(FieldRecording.of('rec', recording, lambda note: None), DRIVE, notes.append)
    return notes


def with_column(recording: Recording, name: str, change: Callable[[FloatArray], FloatArray],
                ) -> Recording:
    channel = recording[name]
    return replace(recording, channels={
        **recording.channels, name: replace(channel, values=change(channel.values))})


@pytest.mark.parametrize('run', RUNS.values(), ids=RUNS)
@pytest.mark.parametrize('names, factor, words', [
    ((RATE_COMMAND,), 180.0 / np.pi, r'rate_command_rad_s is 57.* \(degrees for radians\)'),
    (('motor_1/tach_rate', 'motor_2/tach_rate'), 180.0 / np.pi,
     r'tach_rate_1_rad_s, tach_rate_2_rad_s is 57.* \(degrees for radians\)'),
    (('motor_1/tach_rate', 'motor_2/tach_rate'), 1.0 / 14868.0,
     r'tach_rate_1_rad_s, .* \(rates of the axis for rates of the motor\)'),
    (('plant/encoder',), 180.0 / np.pi, r'encoder_rad is 5.* \(degrees for radians\)'),
    (('plant/encoder',), 1e3, r'encoder_rad is .* \(thousandths for units\)'),
    (('motor_2/ammeter',), 1e3, 'current_2_A reaches .*, the limit of this drive is 5.049'),
    (('torque_share/bias_voltage',), 1e3, 'bias_voltage_V reaches .*: give volts'),
])
def test_other_units_are_refused(run: Recording, names: tuple[str, ...], factor: float,
                                 words: str) -> None:
    for name in names:
        run = with_column(run, name, lambda values: factor * values)
    with pytest.raises(UserError, match=words) as error:
        judged(run)
    assert '\n' not in str(error.value)


@pytest.mark.parametrize('run', RUNS.values(), ids=RUNS)
def test_a_position_for_the_rate_command_is_refused(run: Recording) -> None:
    """The integral of the command, by rectangles: the recording is even."""
    with pytest.raises(UserError, match='rate_command_rad_s holds a position'):
        judged(with_column(run, RATE_COMMAND, lambda rate: 0.005 * np.cumsum(rate)))


@pytest.mark.parametrize('rate', [0.0, 1e-3])
def test_a_constant_command_is_noted(rate: float) -> None:
    notes = judged(with_column(RUNS['square'], RATE_COMMAND,
                               lambda values: np.full(values.size, rate)))
    assert notes == [f'rec: the rate command is {rate:g} rad/s all along: without reversals '
                     'little is told; record a test that reverses']


def test_a_sensor_that_is_not_connected_is_noted() -> None:
    notes = judged(with_column(RUNS['triangle'], 'plant/encoder', np.zeros_like))
    assert notes == ['rec: encoder_rad is zero all along, though the axis is commanded to move: '
                     'is it connected?']


@pytest.mark.parametrize('changes', [
    {}, {'motor_1.tachometer.gain': 1.3}, {'motor_2.motor.torque_constant': 3.0},
    {'motor_1.motor.current_limit': 1.5}, {'plant.axis.coulomb_torque': 4.0},
    {'motor_1.amplifier.dead_zone': 0.5}, {'motor_2.amplifier.offset': 0.4},
    {'plant.axis.gravity_torque': 5e5},
], ids=str)
def test_no_effect_of_the_drive_is_refused(changes: dict[str, float]) -> None:
    for signal in (SLOW_SQUARE, FAST_TRIANGLE):
        assert not judged(field_run(changed(DRIVE, changes), 20.0, **signal))


@pytest.mark.parametrize('kept', SIGNALS)
def test_one_reading_is_enough(kept: str) -> None:
    run = RUNS['triangle']
    assert not judged(replace(run, channels={name: run[name] for name in (RATE_COMMAND, kept)}))
