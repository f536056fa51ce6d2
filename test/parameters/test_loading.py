# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Configuration files: what is right is read to the last digit, what is wrong is told."""

from pathlib import Path
import re
from typing import Any

from antenna_drive.cli.options import parse_settings
from antenna_drive.parameters import load, ParameterError
from antenna_drive.parameters.loading import find
from antenna_drive.parameters.records import place_of, record_of
from antenna_drive.parameters.sets import values
from antenna_drive.yaml_text import dump_yaml
from hypothesis import given, HealthCheck, settings, strategies as st
import numpy as np
import pytest
from simgap.inputs.plain_yaml import parse_yaml
import yaml


def _file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / 'drive.yaml'
    path.write_text(text)
    return path


def test_the_reference_is_number_for_number_what_its_file_says() -> None:
    content = yaml.safe_load(find('reference').read_text())
    drive = load()
    homes = {'axis': (drive.plant.axis,), 'torque_share': (drive.torque_share.circuit,),
             'filter_1': (drive.torque_share.filter_1,)}
    checked = 0
    for section, entries in content.items():
        sets = homes.get(section) or (getattr(drive.motor_1, section),
                                      getattr(drive.motor_2, section))
        for key, entry in entries.items():
            expected = entry['value']
            for parameters in sets:
                found = getattr(parameters, key)
                assert found == (tuple(expected) if isinstance(expected, list) else expected)
                checked += 1
    assert checked > 50


def test_every_reference_entry_says_unit_range_and_source() -> None:
    for section, entries in yaml.safe_load(find('reference').read_text()).items():
        for key, entry in entries.items():
            assert set(entry) == {'value', 'unit', 'range', 'source'}, f'{section}.{key}'


@pytest.mark.parametrize(('name', 'k_2', 's_2', 'k_3', 'g_4', 'gain', 'pole'), [
    ('old_circuit', -3.502, 1.093, 2.0, 2.8, 3.31 / 0.73, 1.0 / 0.73),
    ('new_circuit', -2.114, 0.8895, 3.831, 1.617, 48.67 / 0.73, 1.0 / 0.1125)])
def test_the_circuits_are_table_1(name: str, k_2: float, s_2: float, k_3: float, g_4: float,
                                  gain: float, pole: float) -> None:
    share, filter_1 = load(name).torque_share.circuit, load(name).torque_share.filter_1
    assert (share.k_2, share.s_2, share.k_3, share.g_4) == (k_2, s_2, k_3, g_4)
    assert filter_1.gain == pytest.approx(gain, rel=2e-3)
    assert filter_1.pole == pytest.approx(pole, rel=2e-3)


def test_a_file_lies_over_the_reference_and_a_motor_may_differ(tmp_path: Path) -> None:
    path = _file(tmp_path, 'gearbox: {stiffness: 30.0}\nmotor_2: {gearbox: {half_gap: 0.2}}\n')
    drive = load(path)
    assert drive.motor_1.gearbox.stiffness == drive.motor_2.gearbox.stiffness == 30.0
    assert drive.motor_1.gearbox.half_gap == 0.148
    assert drive.motor_2.gearbox.half_gap == 0.2
    assert load('new_circuit', path).torque_share.filter_1.gain == 66.67


@pytest.mark.parametrize('text', ['2e1', '200E-1', '.2e2', '2.e1', '+0.2e+02', '20'])
def test_a_number_is_written_as_in_python(tmp_path: Path, text: str) -> None:
    path = _file(tmp_path, f'gearbox: {{stiffness: {text}}}\n'
                           'axis: {mode_inertias: [1e0, 20e-1, 3.0]}\n')
    drive = load(path)
    assert drive.motor_1.gearbox.stiffness == float(text)
    assert drive.plant.axis.mode_inertias == (1.0, 2.0, 3.0)
    assert parse_settings([f'torque_share.bias_pot={text}']) == {
        'torque_share': {'bias_pot': float(text)}}


@pytest.mark.parametrize('text', ['e1', '1e', '1e1.5', '1 e1', '0x1e', '1e1m'])
def test_a_text_or_register_remains_what_it_was(text: str) -> None:
    assert parse_yaml(text) == yaml.safe_load(text)


@pytest.mark.parametrize('text', ['8.74e6', '1e3', '.5E-4', '2', 'on', 'A'])
def test_a_text_that_looks_like_a_number_is_read_back_as_a_text(text: str) -> None:
    assert parse_yaml(dump_yaml({'batch': text})) == {'batch': text}


@pytest.mark.parametrize(('text', 'said'), [
    ('gearbox: {stifness: 30.0}', r'gearbox\.stifness: no such entry, did you mean stiffness\?'),
    ('gear_box: {stiffness: 30.0}', r'gear_box: no such entry, did you mean gearbox\?'),
    ('gearbox: {stiffness: -1.0}', r'gearbox\.stiffness: -1\.0 given, allowed is a number from '),
    ('gearbox: {stiffness: stiff}', r"gearbox\.stiffness: 'stiff' given, allowed is a number"),
    ('gearbox: {stiffness: .nan}', r'gearbox\.stiffness: nan given, allowed'),
    ('gearbox: {stiffness: .inf}', r'gearbox\.stiffness: inf given, allowed'),
    (f'gearbox: {{stiffness: {10**400}}}', r'gearbox\.stiffness: 10+\.\.\. given, allowed'),
    (f'gearbox: {{stiffness: {"x" * 100_000}}}', r"gearbox\.stiffness: 'x{50,80}\.\.\. given, al"),
    ('gearbox: {stiffness: {value: 1.0, range: [1, %s]}}' % ('x' * 99_999), r'range .*x\.\.\. gi'),
    ('gearbox: {stiffness: true}', r'gearbox\.stiffness: True given, allowed'),
    ('gearbox: {stiffness: }', r'gearbox\.stiffness: None given, allowed'),
    ('gearbox: {stiffness: {value: 30.0, unit: Nm/deg}}', r"unit 'Nm/deg' given, allowed is"),
    ('gearbox: {stiffness: {value: 30.0, range: [40, 50]}}', r'30\.0 given, allowed .* 40 to 50'),
    ('gearbox: {stiffness: {value: 30.0, range: [-4, 50]}}', r'range \[-4, 50\] given'),
    ('gearbox: {stiffness: {vaule: 30.0}}', r'vaule: no such entry, did you mean val'),
    ('gearbox: {stiffness: {unit: N m/rad}}', r'value is missing'),
    ('gearbox: {stiffness: 1.0, stiffness: 2.0}', 'column 27: the key stiffness is given twice'),
    ('gearbox: [1, 2]', r'gearbox: \[1, 2\] given, allowed is a mapping'),
    ('- 1', r'\[1\] given, allowed is a mapping'),
    ('gearbox: {stiffness: 30.0', r'line \d+, column \d+: '),
    ('axis: {mode_inertias: [1.0, 2.0]}', r'mode_frequencies: 3 numbers given, allowed is 2'),
    ('axis: {mode_inertias: []}', r'axis\.mode_inertias: \[\] given, allowed is a list of 1 to 6'),
    ('axis: {mode_inertias: [1.0, x, 2.0]}', r"axis\.mode_inertias\[1\]: 'x' given"),
    ('motor_1: {gearbox: {gap: 1.0}}', r'motor_1\.gearbox\.gap: no such entry'),
    ('motor_1: {axis: {}}', r'motor_1\.axis: no such entry'),
    ('torque_share: {bias_source: batery}', r"'batery' given, allowed is one of circuit, fixed"),
    ('torque_share: {saturation_low: 14.0}', r'saturation_low: 14 given, allowed is at most'),
    ('test_signal: {rate: {waveform: saw}}', r"'saw' given, allowed is one of zero, square"),
    ('test_signal: {rate: {frequencies: [1.0]}}', r'rate\.weights: 3 numbers given, allowed is 1'),
    ('base: none\ngearbox: {stiffness: 30.0}', r'axis\.gear_ratio: is missing, allowed is'),
    ('base: refrence', r"base: 'refrence' given, allowed is reference or none"),
])
def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = _file(tmp_path, text)
    with pytest.raises(ParameterError) as caught:
        load(path)
    message = str(caught.value)
    assert '\n' not in message
    assert re.search(said, message), message
    assert str(path) in message


def test_a_file_that_is_not_there_or_not_text(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match='new_circit: no such file.*did you mean new_circuit'):
        load('new_circit')
    path = tmp_path / 'binary.yaml'
    path.write_bytes(b'\xff\xfe\x00\x01')
    with pytest.raises(ParameterError, match='not UTF-8'):
        load(path)


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(('gearbox', 'stiffness', 'value', 'unit', 'axis', 'motor_1', 'base',
                         'range', 'torque_share')) | st.text(max_size=6), inner, max_size=3),
    max_leaves=12))
def test_any_yaml_is_read_or_refused_in_one_line(tmp_path: Path, content: object) -> None:
    path = _file(tmp_path, yaml.safe_dump(content))
    try:
        load(path)
    except ParameterError as error:
        assert '\n' not in str(error)


def test_the_record_holds_what_the_set_holds() -> None:
    drive = load()
    record = record_of(drive.plant)[0]
    for name, entry, value in values(drive.plant):
        field = record
        for part in name.split('.'):
            field = field[part]
        if entry.lengths is not None:
            assert isinstance(value, tuple)
            assert tuple(field[:len(value)]) == value
        else:
            assert field == value
    assert record['axis']['mode_inertias_count'] == 3


@pytest.mark.parametrize('path', [
    'motor_1.amplifier.rate_gain', 'motor_2.gearbox.half_gap', 'plant.axis.inertia_hub',
    'torque_share.filter_1.pole', 'plant.encoder.step', 'plant.axis.mode_frequencies.2'])
def test_place_of_a_number_is_where_numpy_keeps_it(path: str) -> None:
    record = record_of(load())
    record.view(np.float64)[place_of(record.dtype, path)] = 123.456
    part: Any = record
    *names, last = path.split('.')
    for name in names:
        part = part[name]
    assert (part[0, int(last)] if last.isdigit() else part[last][0]) == 123.456
