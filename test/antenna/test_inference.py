# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What recordings tell of an entry that their sheets lack, on runs of the emulator."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from antenna_drive.diagnosis.field_recording import FieldRecording
from antenna_drive.diagnosis.inference import completed
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import CircuitBias, FixedBias, FixedStepBias, TestSheet
from field_runs import FAST_TRIANGLE, field_run, SLOW_SQUARE
import pytest

CONFIGURED = load()


def inferred(*recordings: Recording) -> tuple[list[TestSheet], list[str]]:
    """Return the completed sheets, and what was noted."""
    notes: list[str] = []
    found = completed([FieldRecording.of(f'rec_{k}', recording, lambda note: None)
                       for k, recording in enumerate(recordings)], CONFIGURED, notes.append)
    return [recording.sheet for recording in found], notes


def drive_of(circuit: str, filter_1: str, start: str = 'steady', pot: float = 0.8) -> Drive:
    """Return a drive with the circuits of either column of Table 1."""
    drive = load(f'{circuit}_circuit')
    other = load(f'{filter_1}_circuit').torque_share.filter_1
    return changed(drive, {'torque_share.filter_1': other, 'torque_share.circuit.start': start,
                           'torque_share.circuit.bias_pot': pot})


@pytest.mark.parametrize('circuit', ['old', 'new'])
@pytest.mark.parametrize('filter_1', ['old', 'new'])
@pytest.mark.parametrize('start', ['steady', 'zero'])
def test_a_fast_triangle_tells_the_circuits(circuit: str, filter_1: str, start: str) -> None:
    run = field_run(drive_of(circuit, filter_1, start), 25.0, start_after=1.0, **FAST_TRIANGLE)
    (sheet,), notes = inferred(run)
    assert (sheet.circuit, sheet.filter_1) == (circuit, filter_1)
    assert isinstance(sheet.bias, CircuitBias)
    assert sheet.bias.start == start
    assert sheet.bias.bias_pot == pytest.approx(0.8, rel=0.01)
    assert any(note.startswith(f'circuit {circuit}: inferred') for note in notes)
    assert any(note.startswith(f'filter_1 {filter_1}: inferred') for note in notes)
    assert not any('as configured' in note for note in notes)


@pytest.mark.parametrize('voltage', [4.5, 8.0])
def test_a_fixed_source_is_told_from_the_circuit_at_its_limit(voltage: float) -> None:
    """Both give a constant voltage; the other recordings have the circuit's pot."""
    drive = drive_of('new', 'new')
    fixed = changed(drive, {'torque_share.circuit.bias_source': 'fixed',
                            'torque_share.circuit.fixed_voltage': voltage})
    sheets, _ = inferred(field_run(fixed, 25.0, **SLOW_SQUARE),
                         field_run(drive, 25.0, **SLOW_SQUARE),
                         field_run(drive, 25.0, **FAST_TRIANGLE))
    assert isinstance(sheets[0].bias, FixedBias)
    assert sheets[0].bias.voltage_V == pytest.approx(voltage, abs=0.01)
    for sheet in sheets[1:]:
        assert isinstance(sheet.bias, CircuitBias)
        assert sheet.bias.bias_pot == pytest.approx(0.8, rel=0.01)
        assert sheet.bias.start == 'steady'


def test_a_source_that_is_switched_on_is_found_with_its_time() -> None:
    drive = changed(drive_of('new', 'old'), {'torque_share.circuit.bias_source': 'fixed'})
    run = field_run(drive, 40.0, changes={20_003: {'torque_share': {'fixed_voltage': 5.5}}},
                    **SLOW_SQUARE)
    (sheet,), notes = inferred(run)
    assert isinstance(sheet.bias, FixedStepBias)
    assert sheet.bias.voltage_V == pytest.approx(5.5, abs=0.01)
    assert sheet.bias.at_s == pytest.approx(20.003, abs=0.005)
    assert sheet.filter_1 == 'old'
    assert 'rec_0: bias from a source that steps to 5.50 V at 20.00 s: inferred from its ' \
           'voltage' in notes


def test_a_fade_out_that_is_set_otherwise_does_not_pass_for_the_other_circuit() -> None:
    for factor in (0.6, 0.75):
        drive = drive_of('old', 'old')
        volts = factor * drive.torque_share.circuit.fade_out_voltage
        (sheet,), _ = inferred(field_run(changed(
            drive, {'torque_share.circuit.fade_out_voltage': volts}), 40.0, **FAST_TRIANGLE))
        assert sheet.circuit == 'old'


@pytest.mark.parametrize('wrong, words', [
    ({'circuit': 'old'}, 'the sheets give circuit old, the recorded bias voltage looks like new'),
    ({'filter_1': 'old'}, 'the sheets give filter_1 old, the currents look like new'),
    ({'bias': CircuitBias(0.4, 'zero')},
     'rec_0: the sheet gives bias_pot 0.4, the bias voltage looks like 0.80'),
    ({'bias': FixedBias(6.0)},
     'rec_0: the sheet gives a bias of type fixed, the recorded voltage looks like circuit'),
])
def test_a_sheet_is_believed_and_doubted_in_a_note(wrong: dict[str, Any], words: str) -> None:
    given = replace(TestSheet(circuit='new', filter_1='new', bias=CircuitBias(0.8, 'zero')),
                    **wrong)
    (sheet,), notes = inferred(field_run(drive_of('new', 'new', 'zero'), 25.0, given,
                                         **FAST_TRIANGLE))
    assert sheet == given
    assert any(note.startswith(words) and 'believed' in note for note in notes)


def test_a_whole_sheet_that_is_right_is_not_mentioned() -> None:
    right = TestSheet(circuit='new', filter_1='new', bias=CircuitBias(0.8, 'steady'))
    (sheet,), notes = inferred(field_run(drive_of('new', 'new'), 25.0, right, **FAST_TRIANGLE))
    assert sheet == right
    assert not notes


def test_without_a_bias_voltage_the_bias_is_as_configured() -> None:
    run = field_run(drive_of('new', 'new'), 25.0, **FAST_TRIANGLE)
    (sheet,), notes = inferred(replace(run, channels={
        name: run[name] for name in run if name != 'torque_share/bias_voltage'}))
    assert sheet.bias is None
    assert 'rec_0: the sheet does not give bias: as configured' in notes


def test_what_two_recordings_agree_on_holds_for_both() -> None:
    """A slow square leaves the circuit at its limit; the triangle tells which it is."""
    drive = drive_of('old', 'old')
    sheets, _ = inferred(field_run(drive, 25.0, **SLOW_SQUARE),
                         field_run(drive, 25.0, **FAST_TRIANGLE))
    assert [sheet.circuit for sheet in sheets] == ['old', 'old']


@pytest.mark.parametrize('setting', [0.8, 0.78, 0.4])
@pytest.mark.parametrize('scale', [0.98, 1.02, 1.2])
def test_a_sheet_beside_others_without_tells_what_the_pot_does(
        setting: float, scale: float) -> None:
    """A pot does a little more or less than its setting says, in each recording."""
    drive = drive_of('new', 'new', pot=0.8 * scale)
    told = TestSheet(circuit='new', filter_1='new', bias=CircuitBias(setting, 'steady'))
    sheets, notes = inferred(
        field_run(drive, 25.0, **SLOW_SQUARE), field_run(drive, 25.0, **FAST_TRIANGLE),
        field_run(drive_of('new', 'new', pot=setting * scale), 25.0, told, **FAST_TRIANGLE))
    assert sheets[2] == told
    for sheet in sheets[:2]:
        assert isinstance(sheet.bias, CircuitBias)
        assert sheet.bias.bias_pot == pytest.approx(0.8, rel=0.003)
        assert sheet.circuit == 'new'
    # the same setting is the same number
    assert setting != 0.8 or sheets[0].bias == CircuitBias(0.8, 'steady')
    assert not any('believed' in note for note in notes)


def test_constant_voltages_stay_the_circuit_s_beside_a_test_with_another_pot() -> None:
    drive = drive_of('new', 'new')
    told = TestSheet(circuit='new', filter_1='new', bias=CircuitBias(0.4, 'steady'))
    sheets, _ = inferred(
        field_run(drive, 25.0, **SLOW_SQUARE), field_run(drive, 25.0, **SLOW_SQUARE),
        field_run(drive_of('new', 'new', pot=0.4), 25.0, told, **FAST_TRIANGLE))
    for sheet in sheets[:2]:
        assert isinstance(sheet.bias, CircuitBias)
        assert sheet.bias.bias_pot == pytest.approx(0.8, rel=0.003)


def test_a_circuit_of_its_own_in_the_configuration_is_kept() -> None:
    """Constants of neither column of Table 1."""
    own = changed(drive_of('new', 'new', 'zero'), {
        'torque_share.circuit.k_2': -2.6, 'torque_share.circuit.s_2': 1.1,
        'torque_share.circuit.g_4': 2.2, 'torque_share.circuit.k_3': 2.9,
        'torque_share.filter_1.gain': 20.0, 'torque_share.filter_1.pole': 3.5})
    notes: list[str] = []
    run = FieldRecording.of('rec', field_run(own, 25.0, **FAST_TRIANGLE), notes.append)
    found, = completed([run], own, notes.append)
    assert found.sheet.circuit is None
    assert found.sheet.filter_1 is None
    assert isinstance(found.sheet.bias, CircuitBias)
    assert found.sheet.bias.start == 'zero'
    assert {'circuit: the configured constants fit as well: as configured',
            'filter_1: the configured constants fit as well: as configured'} <= set(notes)
    # constants of its own are given up where a column of the table fits clearly better
    run = FieldRecording.of('rec', field_run(
        drive_of('old', 'old', 'zero'), 25.0, **FAST_TRIANGLE), notes.append)
    found, = completed([run], own, notes.append)
    assert (found.sheet.circuit, found.sheet.filter_1) == ('old', 'old')
