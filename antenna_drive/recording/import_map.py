# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
A map from somebody else's file to signals: columns, units, signs, clocks.

docs/recording.md describes the map's entries with an example.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta, timezone
import math
from pathlib import Path
import re
from typing import Any
import warnings

from antenna_drive.emulator.wiring import OUTPUTS, signal_names
from antenna_drive.errors import one_line
from antenna_drive.limits import SAMPLES
from antenna_drive.parameters.plain_yaml import read_yaml
from antenna_drive.parameters.schema import Entry, mapping_of, nearest, ParameterError, quoted
from antenna_drive.recording.csv_format import Cell, FIELD_COLUMNS, parse_nanoseconds, parse_number
from antenna_drive.recording.expression import (
    Expression, MOST_COLUMNS, parse_expression, Reference,
)
from antenna_drive.recording.recording import (
    check_name, make_channel, NANOSECONDS, nanoseconds, Recording, RecordingError,
    RecordingWarning, unit_of,
)
from antenna_drive.recording.sheet import load_sheet, plain_value, TestSheet
from antenna_drive.recording.tables import Layout, open_table, Table, Text
import numpy as np

# A unit in which a column may be written: the SI unit and how much of it one is.
UNITS: dict[str, tuple[str, float]] = {
    'rad': ('rad', 1.0), 'mrad': ('rad', 1e-3), 'urad': ('rad', 1e-6),
    'deg': ('rad', math.pi / 180), 'arcmin': ('rad', math.pi / 10800),
    'arcsec': ('rad', math.pi / 648000), 'mdeg': ('rad', math.pi / 180000),
    'rad/s': ('rad/s', 1.0), 'mrad/s': ('rad/s', 1e-3), 'deg/s': ('rad/s', math.pi / 180),
    'mdeg/s': ('rad/s', math.pi / 180000), 'arcsec/s': ('rad/s', math.pi / 648000),
    'rpm': ('rad/s', math.pi / 30), 'rev/s': ('rad/s', 2 * math.pi),
    'A': ('A', 1.0), 'mA': ('A', 1e-3), 'V': ('V', 1.0), 'mV': ('V', 1e-3),
    'N m': ('N m', 1.0), 'kN m': ('N m', 1e3), 'N': ('N', 1.0), 'kN': ('N', 1e3),
    'm': ('m', 1.0), 'mm': ('m', 1e-3), 'um': ('m', 1e-6),
    'm/s': ('m/s', 1.0), 'mm/s': ('m/s', 1e-3), '1': ('1', 1.0),
}
COUNTS = 'counts'
TIME_UNITS = {'s': NANOSECONDS, 'ms': 1_000_000, 'us': 1_000, 'ns': 1}
ISO_8601 = 'iso8601'
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)

_TEXT_ENTRIES = ('delimiter', 'decimal', 'comment', 'encoding')
_TOP = (*_TEXT_ENTRIES, 'skip_lines', 'header', 'time', 'signals')
_TIME = ('column', 'unit', 'offset_s', 'origin', 'duplicates')
_NUMBERS = {
    'scale': Entry('1', -1e12, 1e12), 'offset': Entry(''),
    'clock_offset_s': Entry('s', -9e9, 9e9),
    'counts_per_revolution': Entry('1', 1.0, 2.0**64),
}
_WHOLE_NUMBERS = {
    'index': Entry('1', 0, MOST_COLUMNS, whole=True),
    'sign_magnitude_bits': Entry('1', 2, 53, whole=True),
}
_SIGNAL = ('column', 'expression', 'unit', 'sign', 'time_column', *_NUMBERS, *_WHOLE_NUMBERS)
_SKIP_LINES = Entry('1', 0, 10000, whole=True)
_PLACE = Entry('1', 0, MOST_COLUMNS, whole=True)
_BETWEEN = re.compile(r'[\s,;]+')
# a comma is no separator where it is the decimal point
_BETWEEN_DECIMAL_COMMAS = re.compile(r'[\s;]+')


@dataclass(frozen=True)
class TimeMap:
    """
    How the time is written.

    Attributes
    ----------
    column : name of the column, or its place, counted from 0
    unit : one of TIME_UNITS, or iso8601 (without a zone it is taken for UTC)
    offset_ns : added to every time stamp [ns]
    from_first : count from the first time stamp of the file
    duplicates : which row counts where a time stamp is repeated: refuse, first or last

    """

    column: str | int
    unit: str = 's'
    offset_ns: int = 0
    from_first: bool = False
    duplicates: str = 'refuse'


@dataclass(frozen=True)
class SignalMap:
    """
    How one signal is written: SI value = factor * (sign * scale * number + offset).

    Attributes
    ----------
    number : the columns, and the number that they give
    unit : SI unit of the signal
    factor : SI units in the unit of the column
    gain : sign * scale
    offset : in the unit of the column
    time_column : column of this signal's own time stamps; None for the common one
    clock_offset_ns : added to this signal's time stamps [ns]
    sign_bit : value of the bit that is the sign of a sign-magnitude register; 0 for none

    """

    number: Expression
    unit: str
    factor: float = 1.0
    gain: float = 1.0
    offset: float = 0.0
    time_column: str | int | None = None
    clock_offset_ns: int = 0
    sign_bit: int = 0


@dataclass(frozen=True)
class ImportMap:
    """What a file holds and how it is written."""

    time: TimeMap
    signals: Mapping[str, SignalMap]
    layout: Layout = Layout()
    source: Mapping[str, Any] = field(default_factory=dict)


def load_map(path: str | Path) -> ImportMap:
    """
    Read a map.

    Raises
    ------
    ParameterError : the file cannot be read or an entry is not allowed; one line names the file,
        the key and what is allowed

    """
    path = Path(path)
    tree = read_yaml(path)
    try:
        return parse_map(tree)
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None


def parse_map(tree: object) -> ImportMap:
    """
    Check the plain data of a map.

    Raises
    ------
    ParameterError : an entry is missing, unknown or not allowed; the message names the key

    """
    top = mapping_of('the map', tree, _TOP)
    texts = {key: _text(key, top[key]) for key in _TEXT_ENTRIES if key in top}
    for key, allowed in (('delimiter', ',;\t| '), ('decimal', '.,')):
        if key in texts and (len(texts[key]) != 1 or texts[key] not in allowed):
            raise ParameterError(f'{key}: {quoted(texts[key])} given, allowed is one of '
                                 + ' '.join(repr(c) for c in allowed))
    if texts.get('decimal', '.') == texts.get('delimiter', ','):
        raise ParameterError('decimal: the same as the delimiter')
    try:
        ''.encode(texts.get('encoding', 'utf-8'))
    except (LookupError, ValueError, UnicodeError):
        raise ParameterError(f'encoding: {quoted(texts["encoding"])} given, allowed is one that '
                             'Python '
                             'knows, such as utf-8 or latin-1') from None
    skip = int(_SKIP_LINES.check('skip_lines', plain_value(  # type: ignore[arg-type]
        top.get('skip_lines', 0))))
    header = top.get('header', True)
    if not isinstance(header, bool):
        raise ParameterError(f'header: {quoted(plain_value(header))} given, allowed is true or '
                             'false')
    signals = {}
    own = mapping_of('signals', top.get('signals'))
    for name, body in own.items():
        signal = FIELD_COLUMNS.get(str(name), str(name))
        if signal in signals:
            raise ParameterError(f'signals.{one_line(name)}: {signal} is given twice')
        signals[signal] = _signal(f'signals.{one_line(name)}', signal, body)
    if not signals:
        raise ParameterError('signals: none is given')
    return ImportMap(_time(top.get('time')), signals,
                     Layout(**texts, skip_lines=skip, header=header), top)


def _text(key: str, value: object, choices: tuple[str, ...] | None = None) -> str:
    if choices is not None:
        return str(Entry('', choices=choices).check(key, plain_value(value)))
    if not isinstance(value, str) or not value:
        raise ParameterError(f'{key}: {quoted(plain_value(value))} given, allowed is a text')
    return value


def _column(key: str, value: object) -> str | int:
    """Return a column's name, or its place."""
    if isinstance(value, int) and not isinstance(value, bool):
        return int(_PLACE.check(key, plain_value(value)))  # type: ignore[arg-type]
    if not isinstance(value, str) or not value:
        raise ParameterError(f'{key}: {quoted(plain_value(value))} given, allowed is a text, or '
                             'the number of a column, counted from 0')
    return value


def _time(body: object) -> TimeMap:
    entries = mapping_of('time', body, _TIME)
    return TimeMap(
        _column('time.column', entries.get('column')),
        _text('time.unit', entries.get('unit', 's'), (*TIME_UNITS, ISO_8601)),
        nanoseconds(_number('time.offset_s', entries.get('offset_s', 0), 'clock_offset_s')),
        _text('time.origin', entries.get('origin', 'keep'), ('keep', 'first')) == 'first',
        _text('time.duplicates', entries.get('duplicates', 'refuse'),
              ('refuse', 'first', 'last')))


def _number(key: str, value: object, entry: str) -> float:
    return float(_NUMBERS[entry].check(key, plain_value(value)))  # type: ignore[arg-type]


def _signal(key: str, name: str, body: object) -> SignalMap:
    unit = unit_of(name)
    if not unit:
        if name.partition('/')[0] in OUTPUTS:
            raise ParameterError(f'{key}: the drive has no such signal'
                                 f'{nearest(name, signal_names())}')
        try:
            check_name(name)
        except RecordingError as error:
            raise ParameterError(f'signals: {error}') from None
    entries = mapping_of(key, body, _SIGNAL)
    numbers = {entry: _number(f'{key}.{entry}', entries[entry], entry)
               for entry in _NUMBERS if entry in entries}
    sign = entries.get('sign', 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise ParameterError(f'{key}.sign: {quoted(plain_value(sign))} given, allowed is 1 or -1')
    written = _text(f'{key}.unit', entries.get('unit', unit or None),
                    (*UNITS, COUNTS))
    if written == COUNTS:
        if 'counts_per_revolution' in numbers:
            si, factor = 'rad', 2 * math.pi / numbers['counts_per_revolution']
        else:  # counts of a converter: the scale says what one is
            if 'scale' not in numbers:
                raise ParameterError(f'{key}: counts need counts_per_revolution (an angle) or '
                                     'scale (anything else, in SI units for each count)')
            si, factor = unit or '1', 1.0
    else:
        if 'counts_per_revolution' in numbers:
            raise ParameterError(f'{key}.counts_per_revolution: goes with the unit counts only')
        si, factor = UNITS[written]
    if unit and si != unit:
        known = [text for text, (target, _) in UNITS.items() if target == unit]
        raise ParameterError(f'{key}.unit: {quoted(written)} given, but {name} is in {unit}; '
                             'allowed is '
                             f'one of {", ".join((*known, COUNTS))}')
    own_time = entries.get('time_column')
    return SignalMap(
        _expression(key, entries), si, factor,
        float(sign) * numbers.get('scale', 1.0), numbers.get('offset', 0.0),
        None if own_time is None else _column(f'{key}.time_column', own_time),
        nanoseconds(numbers.get('clock_offset_s', 0.0)), _sign_bit(key, entries))


def _expression(key: str, entries: Mapping[str, Any]) -> Expression:
    """Return what a signal is in the columns of the file."""
    index = _whole(key, 'index', entries)
    if 'expression' not in entries:
        return Expression.of_column(Reference(_column(f'{key}.column', entries.get('column')),
                                              index))
    for entry in ('column', *_WHOLE_NUMBERS):
        if entry in entries:
            raise ParameterError(f'{key}.{entry}: does not go with expression')
    if 'unit' not in entries:
        raise ParameterError(f'{key}.unit: an expression needs the unit of its result')
    found = parse_expression(f'{key}.expression',
                             _text(f'{key}.expression', entries['expression']))
    if not found.references:
        raise ParameterError(f'{key}.expression: names no column')
    return found


def _whole(key: str, entry: str, entries: Mapping[str, Any]) -> int | None:
    if entry not in entries:
        return None
    return int(_WHOLE_NUMBERS[entry].check(  # type: ignore[arg-type]
        f'{key}.{entry}', plain_value(entries[entry])))


def _sign_bit(key: str, entries: Mapping[str, Any]) -> int:
    bits = _whole(key, 'sign_magnitude_bits', entries)
    return 0 if bits is None else 1 << (bits - 1)


def import_file(path: str | Path, import_map: ImportMap, sheet: bool = True) -> Recording:
    """
    Read a file of any kind that `tables` knows, as a map describes it.

    Parameters
    ----------
    path
        the file; a test sheet NAME.yaml beside NAME.csv is taken along
    import_map
        what the file holds
    sheet
        False to leave the test sheet alone: it may be one of another machine

    Raises
    ------
    RecordingError : a cell, a row or the header cannot be read as the map says, or a time stamp
        is not later than the one before; one line names file, line and column
    ParameterError : NAME.yaml is no test sheet

    Warns
    -----
    RecordingWarning : the last line is not ended, or rows with repeated time stamps were left out

    """
    path = Path(path)
    room = SAMPLES.value()
    with open_table(path, import_map.layout) as table:
        if not table.is_text:  # a number is a number there, whatever text would look like
            import_map = replace(import_map, layout=Layout())
        place = _places(path, table, import_map)
        clocks = {column: _Clock(path, str(column), table.counted, import_map)
                  for column in {_clock_of(signal, import_map)
                                 for signal in import_map.signals.values()}}
        signals = [_Samples(path, signal, _clock_of(signal, import_map), place, table.counted,
                            import_map) for signal in import_map.signals.values()]
        for line, row in table.rows:
            room -= len(signals)
            if room < 0:
                raise RecordingError(f'{path}: {table.counted} {line}: {SAMPLES.exceeded()}')
            stamps = {column: clock.read(line, row[place[column]])
                      for column, clock in clocks.items()}
            for samples in signals:
                samples.read(line, row, stamps)
    dropped = sum(clock.repeated for clock in clocks.values())
    if dropped and import_map.time.duplicates != 'refuse':
        warnings.warn(f'{path}: {dropped} time stamps are repeated; the '
                      f'{import_map.time.duplicates} row of each counts', RecordingWarning,
                      stacklevel=2)
    first = min((s.stamps[0] for s in signals if s.stamps), default=0)
    origin = first if import_map.time.from_first else 0
    channels = {
        name: make_channel(name, signal.unit, np.array(samples.stamps, dtype=np.int64) - origin,
                           samples.values)
        for (name, signal), samples in zip(import_map.signals.items(), signals, strict=True)}
    beside = path.with_suffix('.yaml')
    return Recording(channels,
                     sheet=load_sheet(beside) if sheet and beside.is_file() else TestSheet(),
                     notes={'source': path.name, 'import_map': import_map.source})


def _clock_of(signal: SignalMap, import_map: ImportMap) -> str | int:
    return import_map.time.column if signal.time_column is None else signal.time_column


class _Samples:
    """Collects the samples of one signal."""

    def __init__(self, path: Path, signal: SignalMap, clock: str | int,
                 place: Mapping[str | int, int], counted: str, import_map: ImportMap) -> None:
        self.stamps, self.values = array('q'), array('d')
        self._path, self._signal, self._clock, self._counted = path, signal, clock, counted
        self._places = [(reference, place[reference.column])
                        for reference in signal.number.references]
        self._decimal, self._duplicates = import_map.layout.decimal, import_map.time.duplicates
        self._name = ' and '.join(map(str, signal.number.references))

    def read(self, line: int, row: Sequence[Text],
             stamps: Mapping[str | int, int | None]) -> None:
        """Take the sample of a row, if it has one."""
        signal = self._signal
        numbers = []
        for reference, place in self._places:
            cell = self._cell(line, reference)
            text = _element(row[place], reference, cell, self._decimal)
            if not text:
                return
            numbers.append(_number_of(text, cell, self._decimal, signal.sign_bit))
        cell = Cell(self._path, line, self._name, self._counted)
        try:
            number = signal.number.value(numbers)
        except (ArithmeticError, ValueError) as error:
            raise cell.refuse(f'the expression has no value, {one_line(error)}') from None
        stamp = stamps[self._clock]
        if stamp is None:
            raise cell.refuse('there is a value, but no time stamp')
        value = signal.factor * (signal.gain * number + signal.offset)
        _append(self.stamps, self.values, stamp + signal.clock_offset_ns, value, cell,
                self._duplicates)

    def _cell(self, line: int, reference: Reference) -> Cell:
        return Cell(self._path, line, str(reference), self._counted)


def _element(given: Text, reference: Reference, cell: Cell, decimal: str) -> str:
    """Return the text of a number: the cell's, or that of one number of its vector."""
    if reference.index is None:
        if isinstance(given, list):
            raise cell.refuse(f'a vector of {len(given)} numbers; index says which of them')
        return given.strip()
    if isinstance(given, str):
        text = given.strip()
        if not text:
            return ''
        if text[0] + text[-1] not in ('[]', '()'):
            raise cell.refuse(f'{one_line(repr(text), 40)} is no vector; [0.1, 0.2] is one')
        between = _BETWEEN if decimal == '.' else _BETWEEN_DECIMAL_COMMAS
        given = between.split(text[1:-1].strip())
    if reference.index >= len(given):
        raise cell.refuse(f'a vector of {len(given)} numbers; index counts from 0')
    return given[reference.index].strip()


def _number_of(text: str, cell: Cell, decimal: str, sign_bit: int) -> float:
    """Return a number as it is written; a sign-magnitude register has its sign in one bit."""
    number = parse_number(_point(text, decimal), cell)
    if not sign_bit:
        return number
    if not number.is_integer() or not 0 <= number < 2 * sign_bit:
        raise cell.refuse(f'{one_line(repr(text), 40)} is no register of '
                          f'{sign_bit.bit_length()} bits')
    return sign_bit - number if number >= sign_bit else number


def _point(text: str, decimal: str) -> str:
    """Return a number with a point; one that has a point already is no number."""
    return text if decimal == '.' else text.replace('.', ' ').replace(decimal, '.')


def _append(stamps: array[int], values: array[float], stamp: int, value: float, cell: Cell,
            duplicates: str) -> None:
    if not math.isfinite(value) or abs(stamp) >= 2**63:
        raise cell.refuse('too large a number')
    if stamps and stamp == stamps[-1] and duplicates != 'refuse':
        if duplicates == 'last':
            values[-1] = value
        return
    stamps.append(stamp)
    values.append(value)


def _places(path: Path, table: Table, import_map: ImportMap) -> dict[str | int, int]:
    """Return where each column that the map names lies in a row."""
    found: dict[str | int, int] = {}
    for signal in import_map.signals.values():
        clock = _clock_of(signal, import_map)
        together = {column: _place(path, table, column) for column in (
            clock, *(reference.column for reference in signal.number.references))}
        lengths = {column: table.lengths[name] for column, place in together.items()
                   if (name := table.names[place]) in table.lengths}
        if len(set(lengths.values())) > 1:
            raise RecordingError(f'{path}: ' + ' and '.join(
                f'{one_line(column, 60)} has {length} values'
                for column, length in lengths.items()) + '; a signal needs one for each time')
        found.update(together)
    return found


def _place(path: Path, table: Table, column: str | int) -> int:
    names, where = table.names, f'{path}: {table.start}'
    if isinstance(column, int):
        if column >= len(names):
            raise RecordingError(f'{where}there is no column number {column}, counted from 0; '
                                 f'there are {len(names)}')
        return column
    if not any(names):
        raise RecordingError(f'{where}the column {one_line(repr(column), 60)} is not there: the '
                             'columns have no names; give their numbers, counted from 0')
    if names.count(column) != 1:  # type: ignore[attr-defined]
        what = 'is there twice' if column in names else (
            f'is not there{one_line(nearest(column, names))}')
        raise RecordingError(f'{where}the column {one_line(repr(column), 60)} {what}')
    return names.index(column)


class _Clock:
    """Reads one column of time stamps, and checks that they rise."""

    def __init__(self, path: Path, column: str, counted: str, import_map: ImportMap) -> None:
        self.repeated = 0
        self._path, self._column, self._counted = path, column, counted
        self._time, self._decimal = import_map.time, import_map.layout.decimal
        self._previous: int | None = None

    def read(self, line: int, given: Text) -> int | None:
        """Return a time stamp [ns], None for an empty cell."""
        cell = Cell(self._path, line, self._column, self._counted)
        if isinstance(given, list):
            raise cell.refuse('a vector, allowed is a time')
        text = given.strip()
        if not text:
            return None
        if self._time.unit == ISO_8601:
            stamp = _iso_8601(text, cell)
        else:
            stamp = parse_nanoseconds(_point(text, self._decimal), cell,
                                      TIME_UNITS[self._time.unit])
        stamp += self._time.offset_ns
        if self._previous is not None:
            if stamp == self._previous and self._time.duplicates != 'refuse':
                self.repeated += 1
            elif stamp <= self._previous:
                raise cell.refuse(
                    'the time is not later than in the row before'
                    + (' (time.duplicates: first or last chooses one of equal ones)'
                       if stamp == self._previous else ''))
        self._previous = stamp
        return stamp


def _iso_8601(text: str, cell: Cell) -> int:
    try:
        # Python 3.10 does not read the letter for UTC
        moment = datetime.fromisoformat(text.removesuffix('Z') + '+00:00' * text.endswith('Z'))
        if moment.tzinfo is None:
            moment = moment.replace(tzinfo=timezone.utc)
        return (moment - _EPOCH) // timedelta(microseconds=1) * 1000
    except (ValueError, OverflowError):
        raise cell.refuse(f'{one_line(repr(text), 40)} is no date and time of ISO 8601') from None
