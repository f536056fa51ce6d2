# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Somebody else's CSV through a map: units, signs, clocks, and refusals with their place."""

from __future__ import annotations

import math
from pathlib import Path

from antenna_drive.recording.files import import_file, load_map, parse_map
from antenna_drive.recording.recording import Recording
import pytest
from simgap.inputs.schema import ParameterError
from simgap.logs.channel import RecordingError, RecordingWarning
from simgap.logs.column_map import UNITS
import yaml

COMMAND, CURRENT, TACH, ENCODER = (
    'test_signal/rate_command', 'motor_1/current', 'motor_1/tach_rate', 'plant/encoder')

MAP = """\
skip_lines: 2
delimiter: ';'
decimal: ','
comment: '#'
encoding: latin-1
time: {column: t, unit: ms, offset_s: 0.25}
signals:
  rate_command_rad_s: {column: RATE, unit: deg/s, sign: -1}
  motor_1/current: {column: I1, unit: mA, scale: 2, offset: 100, clock_offset_s: -0.004}
  motor_1/tach_rate: {column: N1, unit: rpm}
  plant/encoder: {column: ENC, unit: counts, counts_per_revolution: 2097152}
  weather/wind: {column: WIND, unit: '1'}
"""
CSV = """\
Prüffeld;;
second line
t;RATE;I1;N1;ENC;WIND;other
# a comment;;;;;;
0,5;90;1000;60;524288;3,5;what
20,75;-45;;-30;-1048576;;else
"""


def read(tmp_path: Path, table: str, text: str) -> Recording:
    (tmp_path / 'map.yaml').write_text(text)
    (tmp_path / 'field.csv').write_bytes(table.encode('latin-1'))
    return import_file(tmp_path / 'field.csv', load_map(tmp_path / 'map.yaml'))


def test_units_signs_scales_offsets_and_clocks(tmp_path: Path) -> None:
    (tmp_path / 'field.yaml').write_text('start: rest\n')
    recording = read(tmp_path, CSV, MAP)
    assert recording[COMMAND].values == pytest.approx([-math.pi / 2, math.pi / 4])
    assert recording[COMMAND].time_ns.tolist() == [250_500_000, 270_750_000]
    assert recording[CURRENT].values == pytest.approx([2.1])
    assert recording[CURRENT].time_ns.tolist() == [246_500_000]
    assert recording[TACH].values == pytest.approx([2 * math.pi, -math.pi])
    assert recording[ENCODER].values == pytest.approx([math.pi / 2, -math.pi])
    assert recording['weather/wind'].values.tolist() == [3.5]
    assert [recording[n].unit for n in (COMMAND, CURRENT, TACH, ENCODER)] == [
        'rad/s', 'article A', 'rad/s', 'rad']
    assert recording.sheet.start == 'rest'
    assert recording.notes['import_map']['signals'][CURRENT]['unit'] == 'mA'


@pytest.mark.parametrize(('unit', 'one'), [
    ('deg', math.radians(1)), ('arcmin', math.radians(1 / 60)), ('arcsec', math.radians(1 / 3600)),
    ('mdeg', math.radians(1e-3)), ('deg/s', math.radians(1)), ('rpm', 2 * math.pi / 60),
    ('rev/s', 2 * math.pi), ('mrad/s', 1e-3), ('urad', 1e-6), ('mdeg/s', math.radians(1e-3)),
    ('arcsec/s', math.radians(1 / 3600)), ('mA', 1e-3), ('mV', 1e-3), ('kN m', 1e3)])
def test_every_unit_has_its_size(unit: str, one: float) -> None:
    assert UNITS[unit][1] == pytest.approx(one, rel=1e-15)


def test_two_clocks_in_one_file(tmp_path: Path) -> None:
    recording = read(
        tmp_path, 'ta,r,tb,i\n0.00,1,,\n0.02,2,0.013,5\n0.04,,0.05,6\n',
        'time: {column: ta, origin: first}\nsignals:\n'
        f'  {COMMAND}: {{column: r}}\n'
        f'  {CURRENT}: {{column: i, time_column: tb, clock_offset_s: -0.003}}\n')
    assert recording[COMMAND].time_ns.tolist() == [0, 20_000_000]
    assert recording[CURRENT].time_ns.tolist() == [10_000_000, 47_000_000]


def test_dates_count_from_the_first_if_asked(tmp_path: Path) -> None:
    table = ('when,r\n2026-01-15T10:28:10.123456Z,1\n2026-01-15T12:28:11+02:00,2\n'
             '2026-01-15 10:28:12,3\n')
    text = f'time: {{column: when, unit: iso8601}}\nsignals: {{{COMMAND}: {{column: r}}}}\n'
    # the seconds since 1970, as date -u +%s gives them
    assert read(tmp_path, table, text)[COMMAND].time_ns.tolist() == [
        1768472890_123456000, 1768472891_000000000, 1768472892_000000000]
    text = text.replace('iso8601', 'iso8601, origin: first')
    assert read(tmp_path, table, text)[COMMAND].time_ns.tolist() == [
        0, 876_544_000, 1_876_544_000]


@pytest.mark.parametrize(('choice', 'values'), [('first', [1.0, 3.0]), ('last', [2.0, 3.0])])
def test_repeated_time_stamps_are_chosen_from_and_told(choice: str, values: list[float],
                                                       tmp_path: Path) -> None:
    table = 't,r\n0,1\n0,2\n1,3\n'
    text = f'time: {{column: t, duplicates: {choice}}}\nsignals: {{{COMMAND}: {{column: r}}}}\n'
    with pytest.warns(RecordingWarning, match='1 time stamps are repeated'):
        assert read(tmp_path, table, text)[COMMAND].values.tolist() == values


PLAIN = f'time: {{column: t}}\nsignals: {{{COMMAND}: {{column: r}}}}\n'


@pytest.mark.parametrize(('table', 'words'), [
    ('t,r\n0,1\n0,2\n', 'line 3, column t: the time is not later.*duplicates'),
    ('t,r\n0,1\n-1,2\n', 'line 3, column t: the time is not later'),
    ('t,r\n0,1\n1,x\n', "line 3, column r: 'x' is no number"),
    ('t,r\n0,1\n1,2,3\n', 'line 3: 3 cells, but the header has 2'),
    ('t,R\n0,1\n', "line 1: the column 'r' is not there"),
    ('t,rr\n0,1\n', "line 1: the column 'r' is not there, did you mean rr"),
    ('t,r,r\n0,1,1\n', "line 1: the column 'r' is there twice"),
    ('t,r\n,1\n', 'line 2, column r: there is a value, but no time stamp'),
    ('t,r\n1e300,1\n', 'line 2, column t: .*beyond'),
    ('', "line 1: the column 't' is not there"),
])
def test_what_does_not_fit_the_map_is_refused_with_its_place(table: str, words: str,
                                                             tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=words) as refusal:
        read(tmp_path, table, PLAIN)
    assert str(refusal.value).startswith(f'{tmp_path}/field.csv: line ')


def test_lines_are_counted_from_the_top_of_the_file(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"line 6, column I1: '1 000' is no number"):
        read(tmp_path, CSV.replace('20,75;-45;;', '20,75;-45;1 000;'), MAP)
    with pytest.raises(RecordingError, match=r"line 5, column t: '0 5' is no number"):
        read(tmp_path, CSV.replace('0,5;', '0.5;'), MAP)


def test_no_date_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="line 2, column t: '2026-13-01' is no date"):
        read(tmp_path, 't,r\n2026-13-01,1\n', PLAIN.replace('t}', 't, unit: iso8601}', 1))


@pytest.mark.parametrize(('change', 'words'), [
    ({'signals': {}}, 'signals: none is given'),
    ({'signals': None}, 'signals: None given, allowed is a mapping'),
    ({'time': None}, 'time: None given, allowed is a mapping'),
    ({'time': {'unit': 's'}}, r'time\.column: None given, allowed is a text'),
    ({'time': {'column': 't', 'unit': 'min'}}, r"time\.unit: 'min' given, allowed is one of s"),
    ({'time': {'column': 't', 'offset_s': 'x'}}, r"time\.offset_s: 'x' given"),
    ({'time': {'colum': 't'}}, r'time\.colum: no such entry, did you mean column'),
    ({'delimiter': '::'}, 'delimiter: '),
    ({'decimal': ','}, 'decimal: the same as the delimiter'),
    ({'encoding': 'klingon'}, "encoding: 'klingon' given"),
    ({'skip_lines': -1}, 'skip_lines: -1 given'),
    ({'units': {}}, r'the map\.units: no such entry'),
    ({'signals': {'motor_1/curent': {'column': 'r'}}},
     r'signals\.motor_1/curent: the drive has no such signal, did you mean motor_1/current'),
    ({'signals': {'a b': {'column': 'r'}}}, 'signals: .* no name of a signal'),
    ({'signals': {'weather/wind': {'column': 'r'}}}, r'signals\.weather/wind\.unit: None given'),
    ({'signals': {CURRENT: {'column': 'r', 'unit': 'V'}}},
     r"current\.unit: 'V' given, but motor_1/current is in A; allowed is one of A, mA, counts"),
    ({'signals': {ENCODER: {'column': 'r', 'unit': 'counts'}}}, 'counts need'),
    ({'signals': {ENCODER: {'column': 'r', 'counts_per_revolution': 8}}}, 'goes with the unit'),
    ({'signals': {CURRENT: {'column': 'r', 'sign': 2}}}, r'sign: 2 given, allowed is 1 or -1'),
    ({'signals': {CURRENT: {'column': 'r', 'scale': '2'}}}, r"scale: '2' given"),
    ({'signals': {CURRENT: {'column': 'r', 'gain': 2}}}, r'gain: no such entry'),
    ({'signals': {'motor_1/ammeter': {'column': 'r'}, 'current_1_A': {'column': 'r'}}}, 'twice'),
])
def test_wrong_maps_are_refused_with_the_key(change: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words) as refusal:
        parse_map({**yaml.safe_load(PLAIN), **change})
    assert '\n' not in str(refusal.value)


def test_a_map_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r'none\.yaml: No such file'):
        load_map(tmp_path / 'none.yaml')
