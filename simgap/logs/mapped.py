# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Read a file of any kind that `tables` knows, as a map describes it."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta, timezone
import math
from pathlib import Path
import re
import warnings

import numpy as np
from simgap.errors import one_line
from simgap.inputs.limits import SAMPLES
from simgap.inputs.schema import nearest
from simgap.logs.channel import Channel, make_channel, RecordingError, RecordingWarning
from simgap.logs.column_map import ImportMap, ISO_8601, SignalMap, TIME_UNITS
from simgap.logs.expression import Reference
from simgap.logs.tables import Layout, open_table, Table, Text
from simgap.logs.text import Cell, parse_nanoseconds, parse_number

_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_BETWEEN = re.compile(r'[\s,;]+')
# a comma is not a separator where it is the decimal point
_BETWEEN_DECIMAL_COMMAS = re.compile(r'[\s;]+')


def read_mapped(path: str | Path, import_map: ImportMap) -> dict[str, Channel]:
    """
    Return the signals that a map finds in a file, by name.

    RecordingError names file, line and column of what the map does not allow. Warns if the
    last line is not ended, or repeated rows were left out.
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
    channels: dict[str, Channel] = {}
    shared = np.empty(0, np.int64)
    for name, signal in import_map.signals.items():
        samples = signals.pop(0)  # ten million rows are in memory once
        times = np.array(samples.stamps, np.int64) - origin
        if not np.array_equal(times, shared):
            shared = times
            shared.flags.writeable = False  # or each channel would have a copy
        channels[name] = make_channel(name, signal.unit, shared, samples.values)
    return channels


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

    def read(self, line: int, row: Sequence[Text], stamps: Mapping[str | int, int | None]) -> None:
        """Take the sample of a row, if it has one."""
        signal = self._signal
        numbers = []
        for reference, place in self._places:
            cell = Cell(self._path, line, str(reference), self._counted)
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
        if decimal == '.' and ',' in text and ';' in text:
            raise cell.refuse(f"{one_line(repr(text), 40)} has ',' and ';'; decimal: ',' in the "
                              'map reads a decimal comma')
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
    """Return a number with a point; one that has a point already is not a number."""
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
