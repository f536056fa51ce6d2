# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The same table in every kind of file is the same recording; what is damaged is refused."""

from __future__ import annotations

from collections.abc import Callable
import csv
import json
from pathlib import Path
from typing import Any
import warnings

from antenna_drive.cli import main
from antenna_drive.recording.files import import_file, parse_map, read_recording
from antenna_drive.recording.recording import Recording
from hypothesis import given, HealthCheck, settings, strategies as st
import numpy as np
import pytest
from scipy.io import savemat
from simgap.errors import UserError
from simgap.inputs.limits import SAMPLES
from simgap.logs.channel import RecordingWarning
from simgap.model import read_log, read_logs

TIME = np.array([0.0, 0.01, 0.02, 0.035])
CURRENT = np.array([0.1, np.nan, -0.3, 1 / 3])
VECTOR = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0], [0.1, 0.2, 0.3]])
MAP = {'time': {'column': 't'}, 'signals': {
    'motor_1/ammeter': {'column': 'i', 'unit': 'mA', 'sign': -1},
    'a/y': {'column': 'v', 'index': 1, 'unit': 'm'},
    'a/z': {'expression': 'v[0] * 2 - v[2]', 'unit': 'mm'}}}


def plain(values: Any) -> list[Any]:
    return [None if value != value else value for value in values.tolist()]


def write(path: Path) -> None:
    """Write the table in the kind of the suffix, with the writers of other libraries."""
    records = [{'t': t, 'i': i, 'v': v} for t, i, v in zip(
        plain(TIME), plain(CURRENT), VECTOR.tolist(), strict=True)]
    columns = {'t': TIME, 'i': CURRENT, 'v': VECTOR}
    if path.suffix == '.npz':
        np.savez_compressed(path, **columns)  # type: ignore[arg-type]
    elif path.suffix == '.mat':
        savemat(path, {**columns, 't': TIME[:, np.newaxis], 'note': 'text', 'mass': 2.0})
    elif path.suffix == '.npy':
        table = np.zeros(4, [('t', float), ('i', float), ('v', float, 3)])
        table['t'], table['i'], table['v'] = TIME, CURRENT, VECTOR
        np.save(path, table)
    elif path.name == 'columns.json':
        path.write_text(json.dumps({'t': plain(TIME), 'i': plain(CURRENT), 'v': VECTOR.tolist(),
                                    'robot': 'arm'}))
    elif path.suffix == '.json':
        path.write_text(json.dumps(records))
    elif path.suffix == '.jsonl':
        path.write_text(''.join(json.dumps(record) + '\n' for record in records))
    elif path.suffix == '.parquet':
        pyarrow = pytest.importorskip('pyarrow')
        from pyarrow import parquet
        parquet.write_table(pyarrow.table({
            't': TIME, 'i': plain(CURRENT), 'v': VECTOR.tolist(), 'who': ['x'] * 4}), path)
    else:
        with path.open('w', newline='') as stream:
            table_of = csv.writer(stream)
            table_of.writerow(['t', 'i', 'v'])
            table_of.writerows([r['t'], '' if r['i'] is None else r['i'], r['v']]
                               for r in records)


KINDS = ('a.csv', 'a.npz', 'a.npy', 'a.mat', 'columns.json', 'records.json', 'a.jsonl',
         'a.parquet')


@pytest.mark.parametrize('name', KINDS)
def test_every_kind_is_the_same_recording(name: str, tmp_path: Path) -> None:
    write(tmp_path / name)
    found = import_file(tmp_path / name, parse_map(MAP))
    there = np.isfinite(CURRENT)
    assert found['motor_1/ammeter'].values.tolist() == [
        1e-3 * (-1.0 * value) for value in CURRENT[there].tolist()]
    assert found['motor_1/ammeter'].time_ns.tolist() == [0, 20_000_000, 35_000_000]
    assert found['a/y'].values.tolist() == VECTOR[:, 1].tolist()
    assert found['a/z'].values == pytest.approx(1e-3 * (2.0 * VECTOR[:, 0] - VECTOR[:, 2]))


@pytest.mark.parametrize('name', [name for name in KINDS if name != 'a.csv'])
def test_without_a_map_the_columns_of_numbers_are_there(name: str, tmp_path: Path) -> None:
    write(tmp_path / name)
    log = read_log(tmp_path / name)
    assert log.time.tolist() == TIME.tolist() and list(log.columns) == ['i']
    assert np.array_equal(log.columns['i'], CURRENT, equal_nan=True)


def test_a_log_of_an_own_machine_is_read_through_the_same_map(tmp_path: Path) -> None:
    write(tmp_path / 'a.npz')
    (tmp_path / 'm.yaml').write_text(json.dumps(MAP))
    [log] = read_logs([tmp_path / 'a.npz'], tmp_path / 'm.yaml')
    assert log['a/y'].tolist() == VECTOR[:, 1].tolist()


def test_import_makes_a_bag_of_a_file_of_any_kind(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / 'a.mat')
    (tmp_path / 'm.yaml').write_text(json.dumps(MAP))
    assert main(['import', 'a.mat', 'bag', '--map', 'm.yaml']) == 0
    assert read_recording(tmp_path / 'bag')['a/y'].values.tolist() == VECTOR[:, 1].tolist()


def test_diagnose_reads_recordings_of_the_drive_through_a_map(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Recording] = {}

    def stand_in(recordings: dict[str, Recording], *arguments: object) -> None:
        given.update(recordings)
        raise UserError('read, and no more')

    monkeypatch.setattr('antenna_drive.diagnosis.diagnose.diagnose_recordings', stand_in)
    write(tmp_path / 'a.npz')
    (tmp_path / 'm.yaml').write_text(json.dumps(MAP))
    assert main(['diagnose', f'{tmp_path}/a.npz', '--map', f'{tmp_path}/m.yaml']) == 2
    assert given['a']['motor_1/ammeter'].values[0] == -1e-4


NUMBERS = st.floats(-1e6, 1e6) | st.none()


@settings(max_examples=60, deadline=None,
          suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=12),
       st.sampled_from([',', ';', '\t']))
def test_a_file_without_a_header_is_read_as_numpy_reads_it(
        tmp_path: Path, rows: list[tuple[float | None, float | None]], delimiter: str) -> None:
    path = tmp_path / 'a.txt'
    path.write_text(''.join(delimiter.join(
        ['' if cell is None else repr(cell) for cell in (0.5 * k, *row)]) + '\n'
        for k, row in enumerate(rows)))
    found = import_file(path, parse_map({
        'header': False, 'delimiter': delimiter, 'time': {'column': 0},
        'signals': {f'a/x{j}': {'column': j, 'unit': '1'} for j in (1, 2)}}))
    told = np.genfromtxt(path, delimiter=delimiter, ndmin=2)
    for j in (1, 2):
        there = np.isfinite(told[:, j])
        assert found[f'a/x{j}'].values.tolist() == told[there, j].tolist()
        assert found[f'a/x{j}'].time_s.tolist() == told[there, 0].tolist()


def test_a_plain_array_has_columns_by_number(tmp_path: Path) -> None:
    table = np.column_stack([TIME, VECTOR])
    np.save(tmp_path / 'a.npy', table)
    found = import_file(tmp_path / 'a.npy', parse_map(
        {'time': {'column': 0}, 'signals': {
            'a/x': {'column': 2, 'unit': '1'},
            'a/y': {'expression': 'column(1) + column(3)', 'unit': '1'}}}))
    assert found['a/x'].values.tolist() == VECTOR[:, 1].tolist()
    assert found['a/y'].values == pytest.approx(VECTOR[:, 0] + VECTOR[:, 2])


@settings(max_examples=100, deadline=None,
          suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(2, 53).flatmap(lambda bits: st.tuples(
    st.just(bits), st.lists(st.integers(1 - 2**(bits - 1), 2**(bits - 1) - 1), min_size=1,
                            max_size=8))))
def test_a_sign_magnitude_register_comes_back(tmp_path: Path,
                                              made: tuple[int, list[int]]) -> None:
    """The register is written bit by bit, as text: the sign, then the size."""
    bits, values = made
    registers = [int(f'{int(v < 0)}{abs(v):0{bits - 1}b}', 2) for v in values]
    found = registers_read(tmp_path, registers, bits)
    assert found['a/x'].values.tolist() == [float(v) for v in values]


def registers_read(tmp_path: Path, registers: list[int], bits: int) -> Recording:
    path = tmp_path / 'a.csv'
    path.write_text('t,x\n' + ''.join(f'{k},{r}\n' for k, r in enumerate(registers)))
    return import_file(path, parse_map({'time': {'column': 't'}, 'signals': {
        'a/x': {'column': 'x', 'unit': '1', 'sign_magnitude_bits': bits}}}))


def test_a_negative_zero_is_zero_and_too_many_bits_are_no_register(tmp_path: Path) -> None:
    assert registers_read(tmp_path, [1024], 11)['a/x'].values.tolist() == [0.0]
    with pytest.raises(UserError, match="line 2, column x: '2048' is no register of 11 bits"):
        registers_read(tmp_path, [2048], 11)


@pytest.mark.parametrize(('text', 'third'), [
    ('"[0.1, 0.2, 0.3]"', 0.3), ('[1 2  3]', 3.0), ('(1; 2; 3)', 3.0), ('"[ 1,2,-3e2 ]"', -300.0)])
def test_vectors_in_a_cell(text: str, third: float, tmp_path: Path) -> None:
    (tmp_path / 'a.csv').write_text(f't,v\n0,{text}\n1,\n')
    found = import_file(tmp_path / 'a.csv', parse_map(
        {'time': {'column': 't'}, 'signals': {'a/x': {'column': 'v', 'index': 2, 'unit': '1'}}}))
    assert found['a/x'].values.tolist() == [third]


def one(**signal: Any) -> dict[str, Any]:
    return {'time': {'column': 't'}, 'signals': {'a/x': {'unit': '1', **signal}}}


@pytest.mark.parametrize(('name', 'content', 'tree', 'message'), [
    ('a.csv', 't,v\n0,"[1, 2]"\n', one(column='v', index=2),
     r'line 2, column v\[2\]: a vector of 2 numbers; index counts from 0'),
    ('a.csv', 't,v\n0,5\n', one(column='v', index=0), "line 2, .*'5' is no vector"),
    ('a.json', '{"t": [0], "v": [[1, 2]]}', one(column='v'),
     'row 1, column v: a vector of 2 numbers; index says which'),
    ('a.json', '{"t": [0, 1], "v": [1]}', one(column='v'),
     't has 2 values and v has 1 values; a signal needs one for each time'),
    ('a.json', '{"t": [0], "v": [NaN]}', one(column='v'), 'NaN is no finite number'),
    ('a.json', '[1, 2]', one(column='v'), 'record 1: no mapping'),
    ('a.json', '3', one(column='v'), 'a single value'),
    ('a.json', '{"t": [0], "v": [{"x": 1}]}', one(column='v'), "'a dict' is no number"),
    ('a.jsonl', '{"t": 0, "v": 1}\n{"t": 1\n', one(column='v'), 'line 2: line 1, column .*JSON'),
    ('a.jsonl', '{"t": 0, "v": 1}\n[1]\n', one(column='v'), 'line 2: no mapping'),
    ('a.csv', 't,v\n0,1\n1,0\n', one(expression='1 / v'), 'line 3, column v: the expression has'),
    ('a.csv', 't,v\n0,1\n', one(expression='1 / w'), "line 1: the column 'w' is not there"),
    ('a.csv', 't,v\n0,1\n', one(column=2), 'line 1: there is no column number 2, counted from 0'),
    ('a.csv', '0,1\n1,2,3\n', {**one(column=1), 'header': False, 'time': {'column': 0}},
     'line 2: 3 cells, but the first row has 2'),
    ('a.csv', '0,1\n', {**one(column='v'), 'header': False}, 'columns have no names'),
    ('a.npy', 'nothing', one(column='v'), r'a\.npy: no \.npy that can be read'),
    ('a.npz', 'nothing', one(column='v'), r'a\.npz: no \.npz that can be read'),
    ('a.mat', 'nothing', one(column='v'), r'a\.mat: no \.mat that can be read'),
])
def test_what_cannot_be_read_is_refused_in_one_line(
        name: str, content: str, tree: dict[str, Any], message: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(UserError, match=message) as refusal, warnings.catch_warnings():
        warnings.simplefilter('ignore', RecordingWarning)
        import_file(tmp_path / name, parse_map(tree))
    assert '\n' not in str(refusal.value) and str(refusal.value).startswith(str(tmp_path))


@pytest.mark.parametrize(('signal', 'message'), [
    ({'expression': 'v', 'column': 'v'}, r'a/x\.column: does not go with expression'),
    ({'expression': 'v', 'sign_magnitude_bits': 8}, 'sign_magnitude_bits: does not go with'),
    ({'expression': '1 + 1'}, 'names no column'),
    ({'expression': 'abs(v'}, r'a/x\.expression: .*is no expression'),
    ({'column': -1}, r'a/x\.column: -1 given'), ({'column': True}, r'a/x\.column: True given'),
    ({'column': 'v', 'index': -1}, r'a/x\.index: -1 given'),
    ({'column': 'v', 'sign_magnitude_bits': 1}, 'sign_magnitude_bits: 1 given'),
])
def test_wrong_entries_are_refused_with_the_key(signal: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        parse_map(one(**signal))
    if 'expression' in signal:
        with pytest.raises(UserError, match='needs the unit of its result|does not go'):
            parse_map({'time': {'column': 't'}, 'signals': {'motor_1/ammeter': signal}})


@pytest.mark.parametrize('name', KINDS)
def test_no_kind_may_hold_more_than_allowed(name: str, tmp_path: Path,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / name)
    monkeypatch.setenv(SAMPLES.variable, '5')
    for read in (lambda path: import_file(path, parse_map(MAP)), read_log):
        with pytest.raises(UserError, match=SAMPLES.variable if name != 'a.csv' else 'a.csv: '):
            read(tmp_path / name)


@pytest.mark.parametrize('suffix', ['.npy', '.npz'])
def test_an_array_that_says_it_is_huge_is_refused_before_it_is_unpacked(
        suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(SAMPLES.variable, '1000')
    path = tmp_path / f'a{suffix}'
    save: Callable[..., None] = np.save if suffix == '.npy' else np.savez_compressed
    save(path, np.zeros(1001))
    with pytest.raises(UserError, match=SAMPLES.variable):
        read_log(path)
