# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Tests of a whole diagnosis, on recordings made with the emulator itself, noise added.

That the maker and the judge share their physics makes these tests of the program, not of the
method: `lab trial` judges the method, with a machine that shares nothing.
"""

from __future__ import annotations

from dataclasses import replace
import json
import math
from typing import Any

from antenna_drive.cli import main
from antenna_drive.diagnosis.diagnose import diagnose_recordings
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import BUILT_IN, confusability_of, groups, planned
from antenna_drive.diagnosis.waves import Wave
from antenna_drive.parameters import load
from antenna_drive.readings import SIGNALS
from antenna_drive.recording.csv_format import write_csv
from antenna_drive.recording.recording import Recording
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.report.page import contents
from simgap.report.render import render
from simgap.verdict.record import value_lines, Verdict

NOISE = {'ammeter': 0.01, 'tach_rate': 0.0035, 'encoder': 1e-6, 'bias_voltage': 0.01}
OFFSETS = {
    'offset:motor_1.motor.torque_constant': 0.012, 'offset:motor_2.amplifier.rate_gain': -0.009,
    'offset:plant.axis.inertia_hub': 0.008, 'offset:plant.axis.coulomb_torque': -0.013,
    'offset:torque_share.filter_1.gain': 0.01,
}


def made(point: Any, seconds: float, names: tuple[str, ...] = ('square', 'triangle'),
         keep: tuple[str, ...] = SIGNALS, seed: int = 0) -> dict[str, Recording]:
    """Return recordings of a drive with these parameter values."""
    tests = {name: planned(BUILT_IN[name], seconds, 100.0) for name in names}
    model = AntennaMachine(tests, load(), threads=1)
    for effect in model.catalogue.values():
        for form in effect.forms:
            if isinstance(form, Wave):
                model.catalogue.wave_at(form, 12.0)
    values: Any = model.simulate([point])[0]
    random = np.random.default_rng(seed)
    recordings = {}
    for (name, test), read in zip(tests.items(), values, strict=True):
        signals = {'test_signal/rate_command': test['test_signal/rate_command'].values}
        for c, channel in enumerate(SIGNALS):
            if channel in keep:
                noise = next(v for key, v in NOISE.items() if key in channel)
                signals[channel] = read[:, c] + noise * random.normal(size=len(read))
        recordings[name] = Recording.from_arrays(
            test['test_signal/rate_command'].time_s, signals, sheet=test.sheet)
    return recordings


def page(diagnosis: Verdict) -> str:
    return render('verdict.html', **contents(diagnosis))


def check_schema(result: Any) -> Any:
    """Check what the JSON promises."""
    assert json.loads(json.dumps(result, allow_nan=False)) is not None
    assert result['verdict'] in ('no_gap', 'explained', 'partly_explained', 'unknown_effect')
    named = [tuple(entry['effects']) for entry in result['which']]
    assert ('none',) in named and ('unknown',) in named and len(set(named)) == len(named)
    shares = [entry['probability'] for entry in result['which']]
    assert sum(shares) == pytest.approx(1.0) and shares == sorted(shares, reverse=True)
    assert all(len(group) <= 5 for group in result['confusable'])
    for entry in result['which']:
        for item in entry['parameters'].values():
            assert item['ci95'][0] <= item['value'] <= item['ci95'][1]
    for item in result['where']:
        assert 0.0 <= item['share'] <= 1.0
    far = result['how_far']
    assert far['before'] >= 0.0 and far['noise_floor'] > 0.0
    fraction = far['explained_fraction']
    assert (fraction['value'] is None) == (fraction['reason'] is not None)
    if fraction['value'] is not None:
        assert -1.0 <= fraction['ci95'][0] <= fraction['ci95'][1] <= 1.0 and far['after'] >= 0.0


@pytest.mark.trial
@pytest.mark.parametrize('effect, value', [
    ('motor_1.torque_constant.change', -0.15), ('axis.viscous_friction.torque_per_rate', 8e7),
    ('tach_2.gain.change', 0.04), ('loop.delay.time', 0.02),
])
def test_known_effect_is_named(effect: Any, value: Any) -> None:
    diagnosis = diagnose_recordings(made({**OFFSETS, effect: value}, 12.0), load())
    check_schema(diagnosis.as_data())
    top = diagnosis.as_data()['which'][0]
    assert top['effects'] == [effect.rpartition('.')[0]]
    low, high = top['parameters'][effect]['ci95']
    assert abs(value - 0.5 * (low + high)) < 2.0 * (high - low)
    assert diagnosis.word == 'explained'
    assert diagnosis.how_far['explained_fraction']['value'] > 0.9


@pytest.mark.trial
def test_offsets_within_the_tolerance_are_no_gap() -> None:
    diagnosis = diagnose_recordings(made(OFFSETS, 12.0), load())
    check_schema(diagnosis.as_data())
    assert diagnosis.word == 'no_gap'
    text = page(diagnosis)
    assert text.startswith('<!doctype html>') and 'No gap' in text
    assert 'http' not in text.replace('http-equiv', '')


@pytest.mark.trial
def test_what_no_effect_can_do_is_unknown() -> None:
    recordings = made(OFFSETS, 12.0)
    odd = {}
    for name, recording in recordings.items():
        time = recording['motor_1/tach_rate'].time_s
        signals = {n: recording[n].values for n in recording}
        # two clicks a second in one tachometer are in no catalogue
        signals['motor_1/tach_rate'] = signals['motor_1/tach_rate'] + 1.5 * np.exp(
            -np.mod(time, 0.5) / 0.05)
        odd[name] = Recording.from_arrays(time, signals, sheet=recording.sheet)
    diagnosis = diagnose_recordings(odd, load())
    check_schema(diagnosis.as_data())
    assert diagnosis.word == 'unknown_effect'
    # but where it lies is told
    assert {item['component'] for item in diagnosis.where[:2]} == {'tach_1'}
    assert diagnosis.may_enter_at[0].name == 'reading of tach_1'
    assert 'reading of tach_1' in diagnosis.summary() and 'reading of tach_1' in page(diagnosis)


@pytest.mark.trial
def test_one_current_alone_still_gives_an_answer(tmp_path: Any) -> None:
    recordings = made({'motor_1.torque_constant.change': -0.3}, 8.0, ('square',),
                      ('motor_1/ammeter',))
    write_csv(recordings['square'], tmp_path / 'field.csv')
    out, report, corrected = (tmp_path / name for name in ('out.json', 'out.html', 'out.yaml'))
    assert main(['diagnose', str(tmp_path / 'field.csv'), '--json', str(out),
                 '--report', str(report), '--corrected', str(corrected)]) == 0
    result = json.loads(out.read_text())
    check_schema(result)
    assert all(set(item) == {'name', 'value', 'unit'} for item in result['recorder'])
    # the corrected configuration is much closer to the recording that it was made from
    assert main(['predict', str(tmp_path / 'field.csv'), '--config', str(corrected),
                 '--recorder', str(out), '--against', 'reference']) == 0
    assert any('not recorded' in note for note in result['notes'])
    assert '</html>' in report.read_text()


def test_recording_without_a_command_is_refused() -> None:
    recording = Recording.from_arrays([0.0, 0.01], {'motor_1/current': [0.0, 1.0]})
    with pytest.raises(UserError, match='rate command'):
        AntennaMachine({'field': recording}, load())


def test_recording_of_a_command_alone_is_refused() -> None:
    time = np.arange(100) * 0.01
    recording = Recording.from_arrays(time, {'test_signal/rate_command': np.sin(time)})
    with pytest.raises(UserError, match='at least one current'):
        AntennaMachine({'field': recording}, load())


@pytest.mark.slow
def test_confusability_knows_what_one_elevation_cannot_tell() -> None:
    tests = {name: planned(BUILT_IN['triangle'], 6.0, 100.0) for name in ('a',)}
    found = confusability_of(tests, load(), threads=1)
    at = {effect: i for i, effect in enumerate(found.effects)}
    # a little wind may blow, and what it cannot imitate of them differs by a quarter
    gravity = found.alike[at['axis.gravity_imbalance']].copy()
    gravity[at['axis.gravity_imbalance']] = 0.0
    assert int(np.argmax(gravity)) == at['axis.wind_steady']
    assert gravity[at['axis.wind_steady']] > 0.7
    assert found.alike[at['motor_1.torque_constant'], at['encoder.cyclic_error']] < 0.5
    assert math.isfinite(found.detectable[at['axis.viscous_friction']])
    assert groups(found) == []
    assert ['axis.gravity_imbalance', 'axis.wind_steady'] in groups(replace(found, limit=0.7))


def test_values_are_told_as_people_read_them() -> None:
    item = {'value': 0.25, 'ci95': [0.2, 0.3], 'unit': 'N m'}
    assert value_lines({'motor_1.stribeck_friction.torque': item}) == [
                       'torque = 0.25 N m (0.2 to 0.3)']
    assert value_lines({'axis.inertia.change': {**item, 'unit': '1'}}
                       ) == ['change = 0.25 (0.2 to 0.3)']
    # what has many numbers is summed up
    (line,) = value_lines({f'motor_1.inertia.change[load={i}]': item for i in range(60)})
    assert line.startswith('60 numbers')
