# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Logs from files: plain, mapped, with a sheet; and models from files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from simgap.errors import UserError
from simgap.model import load_model, read_log, read_logs

MAP = """
time: {column: "T (ms)", unit: ms}
delimiter: ";"
signals:
  angle: {column: POS, unit: counts, counts_per_revolution: 360}
  force: {column: F, unit: kN, sign: -1}
"""


def test_a_plain_file_keeps_its_columns_and_its_gaps(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    path.write_text('time_s,x,y\n0,1,2\n0.1,,3\n0.2,5,4\n')
    log = read_log(path)
    assert log.name == 'a' and log.time.tolist() == [0.0, 0.1, 0.2]
    assert np.isnan(log.columns['x'][1])
    assert log['x'].tolist() == [1.0, 1.0, 5.0]  # an input is held
    assert log['y'].tolist() == [2.0, 3.0, 4.0]


def test_maps_and_sheets_take_numbers_as_people_write_them(tmp_path: Path) -> None:
    (tmp_path / 'm.yaml').write_text('time: {column: t, offset_s: 1e0}\n'
                                     'signals: {angle: {column: x, unit: rad, scale: 5E-1}}\n')
    (tmp_path / 'a.csv').write_text('t,x\n0,1\n1,2\n')
    (tmp_path / 'a.yaml').write_text('constants: {mass: 8.74e6}\n')
    [log] = read_logs([tmp_path / 'a.csv'], tmp_path / 'm.yaml')
    assert log.time.tolist() == [1.0, 2.0] and log['angle'].tolist() == [0.5, 1.0]
    assert log.constants == {'mass': 8.74e6}


@pytest.mark.parametrize('suffix', ['.npz', '.mat'])
def test_named_arrays_are_columns(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f'a{suffix}'
    values = {'t': np.arange(5.0), 'x': np.arange(5), 'mass': np.array(2.0),
              'note': np.array('free text')}
    if suffix == '.npz':
        np.savez(path, **values)  # type: ignore[arg-type]
    else:
        savemat(path, values)
    log = read_log(path)
    assert log.time.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert {name: column.tolist() for name, column in log.columns.items()} == {
        'x': [0.0, 1.0, 2.0, 3.0, 4.0]}
    (tmp_path / 'm.yaml').write_text('time: {column: t, unit: ms}\n'
                                     'signals: {angle: {column: x, unit: deg}}\n')
    [log] = read_logs([path], tmp_path / 'm.yaml')
    assert log.time == pytest.approx([0.0, 1e-3, 2e-3, 3e-3, 4e-3])
    assert log['angle'] == pytest.approx(np.radians([0.0, 1.0, 2.0, 3.0, 4.0]))
    path.write_bytes(b'no such file at all')
    with pytest.raises(UserError, match=f'a{suffix}: '):
        read_log(path)


def test_a_map_names_columns_and_turns_units(tmp_path: Path) -> None:
    (tmp_path / 'm.yaml').write_text(MAP)
    (tmp_path / 'b.csv').write_text('T (ms);POS;F\n0;0;1\n10;90;2\n20;;3\n')
    [log] = read_logs([tmp_path / 'b.csv'], tmp_path / 'm.yaml')
    assert log.time == pytest.approx([0.0, 0.01, 0.02])
    assert log['force'] == pytest.approx([-1e3, -2e3, -3e3])
    assert log.columns['angle'][:2] == pytest.approx([0.0, np.pi / 2])
    assert np.isnan(log.columns['angle'][2])


def test_a_sheet_beside_a_log_tells_constants_and_labels(tmp_path: Path) -> None:
    (tmp_path / 'c.csv').write_text('time_s,x\n0,1\n1,2\n')
    (tmp_path / 'c.yaml').write_text('constants: {mass: 2}\nlabels: {load: A}\n')
    log = read_log(tmp_path / 'c.csv')
    assert log.constants == {'mass': 2.0} and log.labels == {'load': 'A'}


@pytest.mark.parametrize(('text', 'sheet', 'message'), [
    ('x,y\n0,1\n1,2\n', '', 'd.csv: no column time_s or time or t; with --map another'),
    ('time_s,x,x\n0,1,1\n', '', 'a column is there twice'),
    ('time_s,x\n0,1\n1\n', '', 'line 3: 1 cells, but the header has 2'),
    ('time_s,x\n0,1\n1,a\n', '', "line 3, column x: 'a' is no number"),
    ('time_s,x\n1,1\n0,2\n', '', 'd.csv: time: two or more increasing times'),
    ('time_s,x\n0,1\n1,2\n', 'constants: {mass: heavy}', 'd.yaml: constants.mass'),
    ('time_s,x\n0,1\n1,2\n', 'weights: {}', 'd.yaml: weights'),
])
def test_a_file_that_cannot_be_read_is_refused_in_a_line(
        tmp_path: Path, text: str, sheet: str, message: str) -> None:
    (tmp_path / 'd.csv').write_text(text)
    if sheet:
        (tmp_path / 'd.yaml').write_text(sheet)
    with pytest.raises(UserError) as error:
        read_log(tmp_path / 'd.csv')
    assert message in str(error.value)


def test_two_files_of_one_name_are_refused(tmp_path: Path) -> None:
    for folder in ('a', 'b'):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / 'x.csv').write_text('time_s,x\n0,1\n1,2\n')
    with pytest.raises(UserError, match='two files of this name'):
        read_logs([tmp_path / 'a' / 'x.csv', tmp_path / 'b' / 'x.csv'])


GOOD = """
from simgap.model import known, machine, reading
drive = machine(lambda n, t: {'x': n.a * t.time}, {'a': known(1.0)}, {'x': reading('m', 0.1)})
"""


@pytest.mark.parametrize(('text', 'name', 'message'), [
    (GOOD, 'driv', 'driv is no machine, did you mean drive?'),
    (GOOD, '', 'machine is no machine'),
    ('x = 1\ny = 1 / 0\n', 'drive', 'line 2: ZeroDivisionError: division by zero'),
    ('x = (\n', 'drive', 'line 1: SyntaxError'),
    ('import not_there_at_all\n', 'drive', "No module named 'not_there_at_all'"),
])
def test_a_model_that_cannot_be_loaded_is_told_with_its_line(
        tmp_path: Path, text: str, name: str, message: str) -> None:
    path = tmp_path / 'model.py'
    path.write_text(text)
    with pytest.raises(UserError) as error:
        load_model(f'{path}:{name}' if name else str(path))
    assert message in str(error.value) and '\n' not in str(error.value)
    with pytest.raises(UserError, match='no such Python file'):
        load_model(str(tmp_path / 'none.py:drive'))


def test_a_model_is_loaded_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / 'model.py'
    path.write_text(GOOD)
    assert load_model(f'{path}:drive').base['a'].value == 1.0


TABLE = [['t', 'x', 'y'], ['0', '1.5', '2'], ['0.5', '2.5', '-3']]


@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'utf-16'])
@pytest.mark.parametrize('delimiter', [',', ';', '\t'])
def test_the_delimiter_and_the_encoding_are_seen(tmp_path: Path, delimiter: str,
                                                 encoding: str) -> None:
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join(map(delimiter.join, TABLE)) + '\n', encoding=encoding)
    log = read_log(path)
    assert log.time.tolist() == [0.0, 0.5]
    assert log['x'].tolist() == [1.5, 2.5] and log['y'].tolist() == [2.0, -3.0]


@pytest.mark.parametrize(('text', 'remedy'), [
    ('t;x\n0;1,5\n1;2,5\n', "decimal: ','"), ('t\tx\n0\t1,5\n', "decimal: ','"),
    ('t,x\n0,5,1,5\n', "delimiter: ';'"), ('t;x,y\n0;1\n', 'map say which is the delimiter'),
    ('t;x\ns;mm\n0;1\n', 'units_row: true'), ('t,x\n0,NaN\n1,2\n', 'missing: [NaN, N/A]'),
    ('t,x\n0,N/A\n1,2\n', 'missing: [NaN, N/A]')])
def test_a_refusal_names_the_remedy(tmp_path: Path, text: str, remedy: str) -> None:
    path = tmp_path / 'a.csv'
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        read_log(path)
    assert remedy in str(caught.value) and '\n' not in str(caught.value)


@pytest.mark.parametrize('delimiter', [';', '\t'])
def test_a_map_reads_decimal_commas_units_and_what_is_missing(tmp_path: Path,
                                                              delimiter: str) -> None:
    (tmp_path / 'm.yaml').write_text(f"""
delimiter: "{delimiter}"
decimal: ','
units_row: true
missing: [NaN, N/A]
time: {{column: t}}
signals:
  x: {{column: x, unit: mm}}
  y: {{column: y, unit: '1'}}
""".replace('\t', '\\t'))
    lines = ['t;x;y', 's;mm;1', '0;1,5;NaN', '0,5;N/A;2', '1;2,5;3']
    (tmp_path / 'a.csv').write_text('\n'.join(lines).replace(';', delimiter) + '\n')
    [log] = read_logs([tmp_path / 'a.csv'], tmp_path / 'm.yaml')
    assert log.time.tolist() == [0.0, 0.5, 1.0]
    assert log.columns['x'] == pytest.approx([1.5e-3, np.nan, 2.5e-3], nan_ok=True)
    assert log.columns['y'] == pytest.approx([np.nan, 2.0, 3.0], nan_ok=True)


@pytest.mark.parametrize('entry', ['missing: NaN', 'missing: [1]', 'units_row: 1'])
def test_a_map_with_a_wrong_entry_is_refused(tmp_path: Path, entry: str) -> None:
    (tmp_path / 'm.yaml').write_text(f'{entry}\n{MAP}')
    with pytest.raises(UserError, match=entry.partition(':')[0]):
        read_logs([], tmp_path / 'm.yaml')


def test_a_vector_with_decimal_commas_is_not_read_as_ten_times_the_value(tmp_path: Path) -> None:
    (tmp_path / 'm.yaml').write_text('delimiter: "|"\ntime: {column: t}\n'
                                     'signals: {x: {column: v, index: 1, unit: rad}}\n')
    (tmp_path / 'a.csv').write_text('t|v\n0|[0,1; 0,2]\n1|[0,1; 0,2]\n')
    with pytest.raises(UserError, match="decimal: ','"):
        read_logs([tmp_path / 'a.csv'], tmp_path / 'm.yaml')
