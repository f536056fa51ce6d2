# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A corrected configuration moves as the fitted model does, and says what it cannot hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from antenna_drive.cli import main
from antenna_drive.diagnosis.corrected import correct, Corrected
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import BUILT_IN, planned
from antenna_drive.diagnosis.prediction import predict, recorder_errors
from antenna_drive.diagnosis.sheet_settings import nearest_circuit
from antenna_drive.diagnosis.waves import Wave
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.recording.csv_format import read_csv, write_csv
from antenna_drive.recording.recording import Recording
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.fit.state import FitState
from simgap.machine.by_label import Labels
from simgap.machine.contract import Form
from simgap.search.hypothesis import Hypothesis

OFFSETS = {
    'offset:motor_1.motor.torque_constant': 0.012, 'offset:motor_2.amplifier.rate_gain': -0.009,
    'offset:plant.axis.inertia_hub': 0.008, 'offset:plant.axis.mode_frequencies.1': -0.013,
    'offset:torque_share.filter_1.gain': 0.01, 'offset:torque_share.circuit.bias_pot': -0.011,
    'offset:motor_1.armature.resistance_change': 0.004,
}
NONE = np.zeros(0)


@pytest.fixture(scope='module')
def tests() -> dict[str, Recording]:
    """Return a planned square wave and a triangle."""
    return {name: planned(BUILT_IN[name], 6.0, 100.0) for name in ('square', 'triangle')}


@pytest.fixture(scope='module')
def machine(tests: dict[str, Recording]) -> AntennaMachine:
    """Return the reference drive in these tests."""
    return AntennaMachine(tests, load(), threads=1)


def hypothesis(machine: AntennaMachine, point: dict[str, float]) -> Hypothesis:
    """Return the fitted effects and nuisances that have these values."""
    forms: dict[str, Form] = {}
    for effect in (*machine.catalogue.values(), *(law.effect for law in machine.learnable)):
        for form in effect.forms:
            at = machine.catalogue.wave_at(form, 12.0) if isinstance(form, Wave) else form
            if effect.id not in forms and any(p.name in point for p in at.sizes):
                forms[effect.id] = at
    parameters = (*machine.nuisances, *(p for form in forms.values() for p in form.parameters))
    start = {p.name: p.start for p in parameters}
    assert point.keys() <= start.keys()
    x = np.array([{**start, **point}[p.name] for p in parameters])
    return Hypothesis(tuple(forms), tuple(forms.values()), FitState(
        parameters, x, NONE, np.zeros((0, x.size), np.float32), NONE, 0.0))


def loaded(made: Corrected, folder: Path) -> Drive:
    """Return the drive of a corrected configuration, from its file."""
    path = folder / 'corrected.yaml'
    path.write_text(made.text)
    return load(path)


@pytest.mark.parametrize('effect', [
    {'motor_1.torque_constant.change': -0.15}, {'gearbox_2.gap.change': -0.6},
    {'axis.viscous_friction.torque_per_rate': 8e7, 'axis.viscous_friction.flow_index': 0.8},
    {'torque_share.bias_pot.change': 0.2}, {'loop.delay.time': 0.02},
    {'motor_2.torque_ripple.sine@12': 0.3, 'motor_2.torque_ripple.cosine@12': -0.2},
    {'axis.extra_mode.inertia': 5e5, 'axis.extra_mode.frequency': 0.65},
    {'current_1.gain.change': 0.1, 'current_2.offset.offset': 0.2},
    {'encoder.cyclic_error.sine@12': 1e-4, 'encoder.cyclic_error.second_cosine@12': 4e-5},
    {'axis.stribeck_friction.torque': 5e4, 'tach_1.offset.offset': 0.3},
    {'axis.friction_by_rate.6': 2e4, 'axis.friction_by_rate.8': 3e4},
    {'motors.friction_by_load.6': 0.2, 'motors.friction_by_load.3': 0.1},
    {'motor_2.torque_by_current.9': 0.3, 'axis.torque_by_angle.2': 2e4},
], ids=lambda effect: next(iter(effect)))
def test_the_file_moves_as_the_fitted_model(
        effect: dict[str, float], machine: AntennaMachine, tests: dict[str, Recording],
        tmp_path: Path) -> None:
    found = hypothesis(machine, {**OFFSETS, **effect})
    made = correct(load(), machine.records, found)
    assert all(f'# fitted effect {name}' in made.text for name in found.effects
               if name != 'torque_share.bias_pot')
    assert '# within tolerance, as fitted' in made.text
    assert not made.recorder and not made.unwritten
    again = AntennaMachine(tests, loaded(made, tmp_path), threads=1)
    for k in range(2):
        before, wanted = machine.predict({}, k), machine.predict(found.state.point(), k)
        error = np.abs(again.predict({}, k) - wanted).max(axis=0)
        # a rounding in a number is seen a thousand times enlarged at a contact of teeth
        np.testing.assert_array_less(error, 1e-6 * np.ptp(wanted - before, axis=0) + 1e-9)


def test_what_the_recorder_does_is_kept_beside_the_file(
        machine: AntennaMachine, tests: dict[str, Recording], tmp_path: Path) -> None:
    point = {**OFFSETS, 'zero:current_1:square': 0.01, 'zero:current_1:triangle': 0.03,
             'start:square.motor_1': 0.4, 'clock:triangle': 0.002}
    made = correct(load(), machine.records, hypothesis(machine, point))
    assert [(item['name'], item['unit']) for item in made.recorder] == [
        ('clock', 's'), ('zero:current_1', 'article A')]
    assert made.recorder[1]['value'] == pytest.approx(0.02)
    assert made.unwritten == ('start of each test',)
    drive, recording = loaded(made, tmp_path), tests['square']
    plain, read = (predict('square', recording, drive, recorder).predicted
                   for recorder in (None, recorder_errors(made.recorder)))
    ideal = predict('square', recording, drive, recorder_errors([])).predicted
    np.testing.assert_array_equal(plain, ideal)
    # the encoder is read later, and a straight line between samples errs by an eighth of the
    # second difference
    time = recording['test_signal/rate_command'].time_s
    error = 1.2 * float(np.abs(np.diff(plain[:, 4], 2)).max()) / 8.0
    np.testing.assert_allclose(read[:-1, 4], np.interp(time[:-1] + 0.002, time, plain[:, 4]),
                               atol=error, rtol=0.0)
    assert np.ptp(read[:, 4]) > 1000.0 * error
    current = np.interp(time + 0.002, time, plain[:, 0])
    assert np.median(read[:, 0] - current) == pytest.approx(0.02, abs=1e-4)


def test_an_effect_that_differs_between_labels_has_no_place_in_a_file(
        machine: AntennaMachine) -> None:
    name = 'motor_1.torque_constant.change'
    point = hypothesis(machine, {name: -0.1})
    [form] = point.forms
    own = Labels({'load': ('A', 'B')}, ()).split(form, 'load')
    state = point.state
    parameters = (*(p for p in state.parameters if p.name != name), *own.parameters)
    values = [*(x for p, x in zip(state.parameters, state.x, strict=True) if p.name != name),
              -0.1, -0.2]
    both = replace(point, forms=(own,), state=replace(
        state, parameters=parameters, x=np.array(values)))
    made = correct(load(), machine.records, both)
    assert made.unwritten == ('motor_1.torque_constant',)
    assert 'torque_constant:' not in made.text


def test_a_value_beyond_the_range_of_its_entry_is_told(
        machine: AntennaMachine, tmp_path: Path) -> None:
    made = correct(load(), machine.records,
                   hypothesis(machine, {'motor_1.friction_asymmetry.share': 3.0}))
    assert made.unwritten == ('motor_1.motor.friction_asymmetry beyond 0.9',)
    assert loaded(made, tmp_path).motor_1.motor.friction_asymmetry == 0.9


def test_a_configuration_of_ones_own_stays_in_the_file(
        tests: dict[str, Recording], tmp_path: Path) -> None:
    own = changed(load(), {'plant.axis.inertia_hub': 2.1e7})
    machine = AntennaMachine(tests, own, threads=1)
    made = correct(own, machine.records, hypothesis(machine, {}))
    assert loaded(made, tmp_path).plant.axis.inertia_hub == 2.1e7
    assert 'as configured' in made.text and 'within tolerance' not in made.text


def test_a_sheet_does_not_replace_the_measured_numbers_of_its_circuit() -> None:
    drive = load('new_circuit')
    assert nearest_circuit(drive, 'circuit') == 'new'
    measured = changed(drive, {'torque_share.circuit.k_2': -2.3, 'torque_share.circuit.k_3': 5.0})
    assert nearest_circuit(measured, 'circuit') == 'new'
    assert nearest_circuit(load(), 'circuit') == nearest_circuit(load(), 'filter_1') == 'old'


@pytest.mark.parametrize(('entries', 'told'), [
    ([{'name': 'gain:nothing', 'value': 1.0}], 'gain:nothing: no such error'),
    ([{'name': 'clock'}], 'allowed is name and value'),
    ([{'name': 'clock', 'value': float('inf')}], 'allowed is a number')])
def test_a_wrong_recorder_is_refused(entries: list[dict[str, Any]], told: str) -> None:
    with pytest.raises(UserError, match=told):
        recorder_errors(entries)


def test_predict_compares_two_configurations(
        machine: AntennaMachine, tests: dict[str, Recording], tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    found = hypothesis(machine, {'motor_1.torque_constant.change': -0.15})
    (tmp_path / 'corrected.yaml').write_text(correct(load(), machine.records, found).text)
    test = tests['triangle']
    truth = predict('field', test, load(tmp_path / 'corrected.yaml')).predicted
    measured = Recording.from_arrays(test['test_signal/rate_command'].time_s, {
        'test_signal/rate_command': test['test_signal/rate_command'].values,
        'motor_1/ammeter': truth[:, 0] + 0.01, 'motor_1/tach_rate': truth[:, 2]},
        sheet=test.sheet)
    write_csv(measured, tmp_path / 'field.csv')
    words = ['predict', str(tmp_path / 'field.csv'), '--config', str(tmp_path / 'corrected.yaml')]
    out = tmp_path / 'predicted.csv'
    assert main([*words, '--against', 'reference', '--out', str(out)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:4] == ['current_1', '0.01', 'article', 'A'] and '% less' in lines[0]
    assert out.read_text().startswith(
        'time_s,rate_command_rad_s,current_1_A,tach_rate_1_rad_s\n')
    read = read_csv(out)
    assert list(read) == ['test_signal/rate_command', 'motor_1/ammeter', 'motor_1/tach_rate']
    np.testing.assert_array_equal(read['motor_1/ammeter'].time_s,
                                  measured['motor_1/ammeter'].time_s)
    # the other way round, the answer is no
    assert main(['predict', str(tmp_path / 'field.csv'), '--config', 'reference',
                 '--against', str(tmp_path / 'corrected.yaml')]) == 1
    assert main([*words, '--out', str(out)]) == 2
    assert 'exists already' in capsys.readouterr().err
    assert main([*words, '--recorder', str(out)]) == 2
    assert 'not JSON' in capsys.readouterr().err
