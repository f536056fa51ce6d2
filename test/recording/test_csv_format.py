# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""CSV in and out: exact, and refused with file, line and column."""

from __future__ import annotations

import dataclasses
from decimal import Decimal
from pathlib import Path
import struct
import tempfile
import warnings

from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.csv_format import format_nanoseconds, meta_path, read_csv, write_csv
from antenna_drive.recording.recording import Change, Recording
from antenna_drive.recording.sheet import parse_sheet
from hypothesis import given, strategies as st
import numpy as np
import pytest
from simgap.logs.channel import Channel, RecordingError, RecordingWarning
from simgap.logs.text import Cell, parse_nanoseconds

HEADER = ('time_s,rate_command_rad_s,current_1_A,current_2_A,tach_rate_1_rad_s,'
          'tach_rate_2_rad_s,encoder_rad,bias_voltage_V')
CELL = Cell(Path('x.csv'), 1, 'time_s')


def write(path: Path, *lines: str) -> Path:
    path.write_text('\n'.join(lines) + '\n')
    return path


def test_the_field_columns_are_the_drives_signals(tmp_path: Path) -> None:
    recording = read_csv(write(tmp_path / 'a.csv', HEADER, '0,1,2,3,4,5,6,7', '0.02,8,,,,,,9e-3'))
    assert recording['test_signal/rate_command'].values.tolist() == [1.0, 8.0]
    assert recording['motor_1/ammeter'].values.tolist() == [2.0]
    assert recording['motor_2/ammeter'].values.tolist() == [3.0]
    assert recording['motor_1/tach_rate'].values.tolist() == [4.0]
    assert recording['motor_2/tach_rate'].values.tolist() == [5.0]
    assert recording['plant/encoder'].values.tolist() == [6.0]
    assert recording['torque_share/bias_voltage'].values.tolist() == [7.0, 0.009]
    assert recording['torque_share/bias_voltage'].time_ns.tolist() == [0, 20_000_000]
    assert [recording[name].unit for name in FIELD_COLUMNS.values()] == [
        'rad/s', 'article A', 'article A', 'rad/s', 'rad/s', 'rad', 'V']


def test_columns_may_be_missing_and_in_any_order(tmp_path: Path) -> None:
    recording = read_csv(write(tmp_path / 'a.csv', 'encoder_rad, rate_command_rad_s ,time_s',
                               '5, 6 ,0.25', '', '7,8,0.5'))
    assert recording.names == ('plant/encoder', 'test_signal/rate_command')
    assert recording['plant/encoder'].time_s.tolist() == [0.25, 0.5]


def test_the_test_sheet_beside_a_csv_is_read(tmp_path: Path) -> None:
    path = write(tmp_path / 'a.csv', HEADER, '0,1,2,3,4,5,6,7')
    (tmp_path / 'a.yaml').write_text('circuit: old\n')
    assert read_csv(path).sheet == parse_sheet({'circuit': 'old'})


@pytest.mark.parametrize(('lines', 'words'), [
    (['time_s,encoder_rad', '0,1'], 'line 1: there is no column rate_command_rad_s'),
    (['rate_command_rad_s', '1'], 'line 1: there is no column time_s'),
    (['time_s,rate_command_rad_s,curent_1_A', '0,1,2'],
     "line 1, column 3: no such column 'curent_1_A', did you mean current_1_A"),
    (['time_s,rate_command_rad_s,time_s', '0,1,2'], 'line 1, column 3: time_s is given twice'),
    (['time_s,rate_command_rad_s', '0,1', '0.1'], 'line 3: 1 cells, but the header has 2'),
    (['time_s,rate_command_rad_s', '0,1', '', '0.1,1,'], 'line 4: 3 cells'),
    (['time_s,rate_command_rad_s', '0,1', '0.1,one'],
     "line 3, column rate_command_rad_s: 'one' is no number"),
    (['time_s,rate_command_rad_s', '0,nan'], "column rate_command_rad_s: 'nan' is no number"),
    (['time_s,rate_command_rad_s', '0,-inf'], "'-inf' is no number"),
    (['time_s,rate_command_rad_s', '0,1_0'], "'1_0' is no number"),
    (['time_s,rate_command_rad_s', '0,\u0661'], 'is no number'),
    (['time_s,rate_command_rad_s', '0,0x10'], "'0x10' is no number"),
    (['time_s,rate_command_rad_s', '0,1e999'], 'too large'),
    (['time_s,rate_command_rad_s', '1e10,1'], 'line 2, column time_s:.*beyond'),
    (['time_s,rate_command_rad_s', ',1'], "line 2, column time_s: '' is no number"),
    (['time_s,rate_command_rad_s', '0.1,1', '0.1,2'],
     'line 3, column time_s: the time is that of line 2, but the row is another one'),
    (['time_s,rate_command_rad_s', '0.1,1', '0.1,'], 'line 3, column time_s:.*line 2'),
    (['time_s,rate_command_rad_s', '0,"1'], 'line 2: no CSV'),
    (['time_s,bad-name [A]', '0,1'], 'line 1, column 2:.*no name of a signal'),
    ([''], 'line 1: there is no column time_s'),
])
def test_what_cannot_be_read_is_refused_with_its_place(lines: list[str], words: str,
                                                       tmp_path: Path) -> None:
    path = write(tmp_path / 'a.csv', *lines)
    with pytest.raises(RecordingError, match=words) as refusal:
        read_csv(path)
    assert str(refusal.value).startswith(f'{path}: line ')
    assert '\n' not in str(refusal.value)


def test_repeated_rows_count_once_and_are_told(tmp_path: Path) -> None:
    path = write(tmp_path / 'a.csv', 'time_s,rate_command_rad_s,current_1_A', '0,1,2', '0.1,3,',
                 '0.10,3.0,', '0.2,5,6', '0.1,3,')
    with pytest.warns(RecordingWarning) as told:
        recording = read_csv(path)
    assert [str(warning.message) for warning in told] == [
        f'{path}: line 6: the time is earlier than in the row before; the rows were sorted by '
        'time', f'{path}: line 4: the row repeats an earlier one; 2 such rows were left out']
    command, current = recording['test_signal/rate_command'], recording['motor_1/ammeter']
    assert command.time_ns.tolist() == [0, 100_000_000, 200_000_000]
    assert command.values.tolist() == [1.0, 3.0, 5.0]
    assert (current.time_ns.tolist(), current.values.tolist()) == ([0, 200_000_000], [2.0, 6.0])


@given(st.permutations(range(12)), st.lists(st.integers(0, 11), max_size=6))
def test_rows_in_any_order_are_the_same_recording(order: list[int], again: list[int]) -> None:
    rows = [f'{0.25 * k},{k},{k * k if k % 3 else ""}' for k in range(12)]
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter('ignore', RecordingWarning)
        header = 'time_s,rate_command_rad_s,encoder_rad'
        sorted_one = read_csv(write(Path(folder, 'a.csv'), header, *rows))
        other = read_csv(write(Path(folder, 'b.csv'), header,
                               *(rows[k] for k in [*order, *again])))
    for name in sorted_one.names:
        assert other[name].time_ns.tolist() == sorted_one[name].time_ns.tolist()
        assert other[name].values.tolist() == sorted_one[name].values.tolist()


def test_files_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    path.write_bytes(HEADER.encode() + b'\n0,1,2,\xff,4,5,6,7\n')
    with pytest.raises(RecordingError, match='no text'):
        read_csv(path)
    with pytest.raises(RecordingError, match='No such file'):
        read_csv(tmp_path / 'none.csv')


def test_a_last_line_that_is_not_ended_is_told(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    path.write_text('time_s,rate_command_rad_s\n0,1.25\n0.1,1.2')
    with pytest.warns(RecordingWarning, match='line 3 is not ended'):
        read_csv(path)


def test_a_file_of_ours_that_lost_rows_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    write_csv(Recording.from_arrays([0.0, 0.5], {'motor_1/current': [1.0, 2.0]}), path)
    path.write_text(path.read_text().rpartition('0.5')[0])
    with pytest.raises(RecordingError, match='1 rows, but a.meta.json tells of 2'):
        read_csv(path)


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(st.dictionaries(
    st.sampled_from(['motor_1/current', 'plant/encoder', 'wind/speed', 'a/b_c']),
    st.dictionaries(st.integers(-2**62, 2**62), FINITE, max_size=8), min_size=1, max_size=4))
def test_a_round_trip_is_exact_to_the_last_bit(tmp_path_factory: pytest.TempPathFactory,
                                               samples: dict[str, dict[int, float]]) -> None:
    recording = Recording({
        name: Channel('m/s', np.array(sorted(values), dtype=np.int64),
                      np.array([values[t] for t in sorted(values)]))
        for name, values in samples.items()},
        configuration={'axis': {'ratio': 14868.0}}, notes={'who': 'me\n"'},
        changes=(Change(3, 'torque_share', {'bias_pot': 0.1}),),
        sheet=parse_sheet({'circuit': 'new'}))
    path = tmp_path_factory.mktemp('csv') / 'a.csv'
    write_csv(recording, path)
    again = read_csv(path)
    assert again == recording
    assert again.notes == recording.notes
    for name, values in samples.items():
        bits = [struct.pack('<d', values[t]) for t in sorted(values)]
        assert [struct.pack('<d', v) for v in again[name].values.tolist()] == bits
        assert again[name].time_ns.tolist() == sorted(values)


@given(st.integers(-2**63 + 1, 2**63 - 1))
def test_time_stamps_are_written_exactly(stamp: int) -> None:
    text = format_nanoseconds(stamp)
    assert Decimal(text) * 10**9 == stamp
    if abs(stamp) < 9.2e18:
        assert parse_nanoseconds(text, CELL) == stamp


@given(st.decimals(-10**6, 10**6, allow_nan=False, places=12))
def test_finer_time_stamps_are_rounded_to_the_nearest_nanosecond(time: Decimal) -> None:
    assert abs(parse_nanoseconds(str(time), CELL) - time * 10**9) <= Decimal('0.5')


@pytest.mark.parametrize('text', ['0e9999', '1e-9999', '.0e-9999'])
def test_time_stamps_with_wild_exponents_take_no_time(text: str) -> None:
    assert parse_nanoseconds(text, CELL) == 0


def test_many_rows_are_written_block_by_block(tmp_path: Path) -> None:
    time = np.arange(150_000) * 0.001
    recording = Recording.from_arrays(time, {'motor_1/current': np.sin(time)})
    one = recording['motor_1/current']
    recording = dataclasses.replace(recording, channels={
        **recording.channels, 'plant/encoder': Channel('rad', one.time_ns[::7], one.values[::7])})
    write_csv(recording, tmp_path / 'a.csv')
    assert read_csv(tmp_path / 'a.csv') == recording


def test_field_columns_are_written_under_their_names(tmp_path: Path) -> None:
    values = {name: [float(i), -float(i)] for i, name in enumerate(FIELD_COLUMNS.values())}
    recording = Recording.from_arrays([0.0, 0.02], {**values, 'plant/axis_rate': [0.0, 0.0]})
    write_csv(recording, tmp_path / 'a.csv', field=True)
    assert (tmp_path / 'a.csv').read_text().splitlines() == [
        HEADER, '0.0,0.0,1.0,2.0,3.0,4.0,5.0,6.0', '0.02,-0.0,-1.0,-2.0,-3.0,-4.0,-5.0,-6.0']
    with pytest.raises(RecordingError, match='test_signal/rate_command: no such signal'):
        write_csv(recording, tmp_path / 'b.csv', field=True, names=['plant/encoder'])


def test_nothing_is_overwritten_and_nothing_half_written(tmp_path: Path) -> None:
    recording = Recording.from_arrays([0.0], {'motor_1/current': [1.0]},
                                      sheet=parse_sheet({'circuit': 'new'}))
    sheet = tmp_path / 'a.yaml'
    sheet.write_text('circuit: old\n')
    with pytest.raises(RecordingError, match='a.yaml: exists already'):
        write_csv(recording, tmp_path / 'a.csv')
    assert [p.name for p in tmp_path.iterdir()] == ['a.yaml']
    assert sheet.read_text() == 'circuit: old\n'
    with pytest.raises(RecordingError, match='cannot be written'):
        write_csv(recording, tmp_path / 'nowhere' / 'a.csv')
    with pytest.raises(RecordingError, match='no such signal'):
        write_csv(recording, tmp_path / 'b.csv', names=['plant/encoder'])
    assert write_csv(recording, tmp_path / 'b.csv') == (
        meta_path(tmp_path / 'b.csv'), tmp_path / 'b.yaml', tmp_path / 'b.csv')
    assert {p.name for p in tmp_path.iterdir()} == {'a.yaml', 'b.csv', 'b.yaml', 'b.meta.json'}
