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
A map from somebody else's CSV to the drive's signals: columns, units, signs, clocks.

docs/recording.md describes the map's entries with an example.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
import itertools
import math
from pathlib import Path
from typing import Any, TextIO
import warnings

from antenna_drive.emulator.wiring import OUTPUTS, signal_names
from antenna_drive.errors import one_line
from antenna_drive.limits import SAMPLES
from antenna_drive.parameters.plain_yaml import read_yaml
from antenna_drive.parameters.schema import (
    Entry, mapping_of, nearest, ParameterError, quoted,
)
from antenna_drive.recording.csv_format import (
    Cell, FIELD_COLUMNS, open_text, parse_nanoseconds, parse_number, rows,
)
from antenna_drive.recording.recording import (
    check_name, make_channel, NANOSECONDS, nanoseconds, Recording, RecordingError,
    RecordingWarning, unit_of,
)
from antenna_drive.recording.sheet import load_sheet, plain_value, TestSheet
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
_TOP = (*_TEXT_ENTRIES, 'skip_lines', 'time', 'signals')
_TIME = ('column', 'unit', 'offset_s', 'origin', 'duplicates')
_NUMBERS = {
    'scale': Entry('1', -1e12, 1e12), 'offset': Entry(''),
    'clock_offset_s': Entry('s', -9e9, 9e9),
    'counts_per_revolution': Entry('1', 1.0, 2.0**64),
}
_SIGNAL = ('column', 'unit', 'sign', 'time_column', *_NUMBERS)
_SKIP_LINES = Entry('1', 0, 10000, whole=True)


@dataclass(frozen=True)
class TimeMap:
    """
    How the time is written.

    Attributes
    ----------
    column : name of the column
    unit : one of TIME_UNITS, or iso8601 (without a zone it is taken for UTC)
    offset_ns : added to every time stamp [ns]
    from_first : count from the first time stamp of the file
    duplicates : which row counts where a time stamp is repeated: refuse, first or last

    """

    column: str
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
    column : name of the column
    unit : SI unit of the signal
    factor : SI units in the unit of the column
    gain : sign * scale
    offset : in the unit of the column
    time_column : column of this signal's own time stamps; None for the common one
    clock_offset_ns : added to this signal's time stamps [ns]

    """

    column: str
    unit: str
    factor: float = 1.0
    gain: float = 1.0
    offset: float = 0.0
    time_column: str | None = None
    clock_offset_ns: int = 0


@dataclass(frozen=True)
class ImportMap:
    """What a CSV holds and how it is written."""

    time: TimeMap
    signals: Mapping[str, SignalMap]
    delimiter: str = ','
    decimal: str = '.'
    comment: str = ''
    encoding: str = 'utf-8-sig'
    skip_lines: int = 0
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
    signals = {}
    own = mapping_of('signals', top.get('signals'))
    for name, body in own.items():
        signal = FIELD_COLUMNS.get(str(name), str(name))
        if signal in signals:
            raise ParameterError(f'signals.{one_line(name)}: {signal} is given twice')
        signals[signal] = _signal(f'signals.{one_line(name)}', signal, body)
    if not signals:
        raise ParameterError('signals: none is given')
    return ImportMap(_time(top.get('time')), signals, skip_lines=skip, source=top, **texts)


def _text(key: str, value: object, choices: tuple[str, ...] | None = None) -> str:
    if choices is not None:
        return str(Entry('', choices=choices).check(key, plain_value(value)))
    if not isinstance(value, str) or not value:
        raise ParameterError(f'{key}: {quoted(plain_value(value))} given, allowed is a text')
    return value


def _time(body: object) -> TimeMap:
    entries = mapping_of('time', body, _TIME)
    return TimeMap(
        _text('time.column', entries.get('column')),
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
        _text(f'{key}.column', entries.get('column')), si, factor,
        float(sign) * numbers.get('scale', 1.0), numbers.get('offset', 0.0),
        None if own_time is None else _text(f'{key}.time_column', own_time),
        nanoseconds(numbers.get('clock_offset_s', 0.0)))


def import_csv(path: str | Path, import_map: ImportMap, sheet: bool = True) -> Recording:
    """
    Read a CSV as a map describes it.

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
    clocks: dict[str, _Clock] = {}
    samples: dict[str, tuple[array[int], array[float]]] = {}
    room = SAMPLES.value()
    with open_text(path, import_map.encoding) as stream:
        table = _table(path, stream, import_map)
        line, header = next(table, (import_map.skip_lines + 1, []))
        place = _places(path, line, [cell.strip() for cell in header], import_map)
        for name in import_map.signals:
            samples[name] = (array('q'), array('d'))
        for signal in import_map.signals.values():
            column = signal.time_column or import_map.time.column
            clocks.setdefault(column, _Clock(path, column, import_map))
        for line, row in table:
            if len(row) != len(header):
                raise RecordingError(f'{path}: line {line}: {len(row)} cells, but the header has '
                                     f'{len(header)}')
            room -= len(samples)
            if room < 0:
                raise RecordingError(f'{path}: line {line}: {SAMPLES.exceeded()}')
            stamps = {column: clock.read(line, row[place[column]].strip())
                      for column, clock in clocks.items()}
            for name, signal in import_map.signals.items():
                text = row[place[signal.column]].strip()
                stamp = stamps[signal.time_column or import_map.time.column]
                if not text:
                    continue
                cell = Cell(path, line, signal.column)
                if import_map.decimal != '.':
                    text = text.replace('.', ' ').replace(import_map.decimal, '.')
                number = signal.gain * parse_number(text, cell) + signal.offset
                if stamp is None:
                    raise cell.refuse('there is a value, but no time stamp')
                _append(samples[name], stamp + signal.clock_offset_ns, signal.factor * number,
                        cell, import_map.time.duplicates)
    dropped = sum(clock.repeated for clock in clocks.values())
    if dropped and import_map.time.duplicates != 'refuse':
        warnings.warn(f'{path}: {dropped} time stamps are repeated; the '
                      f'{import_map.time.duplicates} row of each counts', RecordingWarning,
                      stacklevel=2)
    first = min((s[0][0] for s in samples.values() if s[0]), default=0)
    origin = first if import_map.time.from_first else 0
    channels = {}
    for name, (stamps_ns, values) in samples.items():
        channels[name] = make_channel(name, import_map.signals[name].unit,
                                      np.array(stamps_ns, dtype=np.int64) - origin, values)
    beside = path.with_suffix('.yaml')
    return Recording(channels,
                     sheet=load_sheet(beside) if sheet and beside.is_file() else TestSheet(),
                     notes={'source': path.name, 'import_map': import_map.source})


def _append(samples: tuple[array[int], array[float]], stamp: int, value: float, cell: Cell,
            duplicates: str) -> None:
    stamps, values = samples
    if not math.isfinite(value) or abs(stamp) >= 2**63:
        raise cell.refuse('too large a number')
    if stamps and stamp == stamps[-1] and duplicates != 'refuse':
        if duplicates == 'last':
            values[-1] = value
        return
    stamps.append(stamp)
    values.append(value)


def _table(path: Path, stream: TextIO, import_map: ImportMap) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows behind what is to be skipped, comments left out, with their true lines."""
    try:
        for _ in range(import_map.skip_lines):
            stream.readline()
    except UnicodeDecodeError:
        raise RecordingError(f'{path}: line 1: no text in {stream.encoding}') from None
    for line, row in rows(path, stream, import_map.delimiter):
        if import_map.comment and row[0].lstrip().startswith(import_map.comment):
            continue
        yield line + import_map.skip_lines, row


def _places(path: Path, line: int, header: list[str], import_map: ImportMap) -> dict[str, int]:
    needed = [import_map.time.column] if any(
        s.time_column is None for s in import_map.signals.values()) else []
    needed += itertools.chain.from_iterable(
        (s.column, s.time_column) if s.time_column else (s.column,)
        for s in import_map.signals.values())
    for column in needed:
        if header.count(column) != 1:
            what = 'is there twice' if column in header else (
                f'is not there{one_line(nearest(column, header))}')
            raise RecordingError(f'{path}: line {line}: the column '
                                 f'{one_line(repr(column), 60)} {what}')
    return {column: header.index(column) for column in needed}


class _Clock:
    """Reads one column of time stamps, and checks that they rise."""

    def __init__(self, path: Path, column: str, import_map: ImportMap) -> None:
        self.repeated = 0
        self._path, self._column = path, column
        self._time, self._decimal = import_map.time, import_map.decimal
        self._previous: int | None = None

    def read(self, line: int, text: str) -> int | None:
        """Return a time stamp [ns], None for an empty cell."""
        cell = Cell(self._path, line, self._column)
        if not text:
            return None
        if self._time.unit == ISO_8601:
            stamp = _iso_8601(text, cell)
        else:
            if self._decimal != '.':
                text = text.replace('.', ' ').replace(self._decimal, '.')
            stamp = parse_nanoseconds(text, cell, TIME_UNITS[self._time.unit])
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
