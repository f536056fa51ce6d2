# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Read a file of any kind that `tables` knows, as a map describes it."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta, timezone
from functools import partial
import math
from pathlib import Path
import re
from typing import Any
import warnings

import numpy as np
from simgap.errors import one_line
from simgap.inputs.limits import SAMPLES
from simgap.logs.channel import (
    Channel, make_channel, NANOSECONDS, RecordingError, RecordingWarning,
)
from simgap.logs.column_map import ImportMap, ISO_8601, SignalMap, TIME_UNITS
from simgap.logs.expression import Reference
from simgap.logs.fields import Stamp
from simgap.logs.table import Layout, Table, Text
from simgap.logs.tables import open_table
from simgap.logs.text import Cell, parse_nanoseconds, parse_number

_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_BETWEEN = re.compile(r'[\s,;]+')
# a comma is not a separator where it is the decimal point
_BETWEEN_DECIMAL_COMMAS = re.compile(r'[\s;]+')


@dataclass(frozen=True)
class MappedFile:
    """What a map finds in a file, and in others of the same test."""

    channels: Mapping[str, Channel]  # by the name of the signal
    # equal for signals whose stamps are those of one clock; and how each comes onto another
    clocks: Mapping[str, tuple[object, str]]
    constants: Mapping[str, float]  # that the file tells beside its table


def read_file(path: str | Path, import_map: ImportMap,
              constants: Mapping[str, float] | None = None) -> MappedFile:
    """
    Return what a map finds in a file and beside it; constants are what expressions may name.

    RecordingError names file, line and column of what the map does not allow. Warns if the last
    line is not ended, or repeated rows were left out.
    """
    path = Path(path)
    found = _one_file(path, import_map, constants or {})
    for name, other_map in import_map.also.items():
        test = path.stem.rpartition('_')[0] or path.stem
        other = read_file(path.with_name(name.replace('{test}', test)), other_map, constants)
        found = MappedFile({**found.channels, **other.channels}, {**found.clocks, **other.clocks},
                           {**other.constants, **found.constants})
    return found


def _one_file(path: Path, import_map: ImportMap, constants: Mapping[str, float]) -> MappedFile:
    room = SAMPLES.value()
    with open_table(path, import_map.layout) as table:
        if not table.is_text:  # a number is a number there, whatever text would look like
            import_map = replace(import_map, layout=Layout())
        known = {name: value for name, value in {**table.constants, **constants}.items()
                 if name not in table.names}
        signals = [_Samples(path, replace(signal, number=signal.number.bound(known)), table,
                            import_map) for signal in import_map.signals.values()]
        clocks = {samples.clock: _Clock(path, samples.clock, table, import_map)
                  for samples in signals}
        _check_lengths(table, signals)
        beginning: dict[int, list[_Samples]] = {}
        for samples in signals:
            beginning.setdefault(samples.places[1], []).append(samples)
        conditions = [(*table.place(column), value) for column, value in import_map.where.items()]
        for line, row in table.rows:
            if conditions and not all(_holds(row[place], k, value)
                                      for place, k, value in conditions):
                continue
            room -= len(signals)
            if room < 0:
                raise RecordingError(f'{path}: {table.counted} {line}: {SAMPLES.exceeded()}')
            # a message fills few of the columns of a bag
            stamps = {column: clock.read(line, row) for column, clock in clocks.items()
                      if row[clock.place] != ''}
            for place, own in beginning.items():
                if row[place] != '':
                    for samples in own:
                        samples.read(line, row, stamps)
    dropped = sum(clock.repeated for clock in clocks.values())
    if dropped and import_map.time.duplicates != 'refuse':
        warnings.warn(f'{path}: {dropped} time stamps are repeated; the '
                      f'{import_map.time.duplicates} row of each counts', RecordingWarning,
                      stacklevel=2)
    return MappedFile(_channels(import_map, signals), {
        name: ((path, samples.clock, signal.clock_offset_ns), signal.join)
        for (name, signal), samples in zip(import_map.signals.items(), signals, strict=True)
    }, table.constants)


def _channels(import_map: ImportMap, signals: list[_Samples]) -> dict[str, Channel]:
    """Return the samples as channels, which share the times that are the same."""
    first = min((int(s.stamps[0]) for s in signals if s.stamps), default=0)
    origin = first if import_map.time.from_first else 0
    channels: dict[str, Channel] = {}
    shared = np.empty(0, np.int64)
    for (name, signal), samples in zip(import_map.signals.items(), signals, strict=True):
        samples.finish()
        times = np.array(samples.stamps, np.int64) - origin
        if not np.array_equal(times, shared):
            shared = times
            shared.flags.writeable = False  # or each channel would have a copy
        values: Any = samples.values
        if signal.unwrap:
            values = np.unwrap(np.array(values), period=signal.factor * abs(signal.gain)
                               * signal.unwrap)
        channels[name] = make_channel(name, signal.unit, shared, values)
        samples.values, samples.stamps = array('d'), array('q')  # ten million rows are held once
    return channels


def _holds(given: Text, index: int | None, wanted: object) -> bool:
    """Tell whether a cell has a value, as a number or as a text."""
    text = given if isinstance(given, str) else given[index or 0]
    try:
        return float(text) == float(wanted)  # type: ignore[arg-type]
    except ValueError:
        return text == wanted


def _check_lengths(table: Table, signals: Sequence[_Samples]) -> None:
    for samples in signals:
        lengths = {name: table.lengths[name] for place in samples.places
                   if (name := table.names[place]) in table.lengths}
        if len(set(lengths.values())) > 1:
            raise RecordingError(' and '.join(
                f'{one_line(column, 60)} has {length} values'
                for column, length in lengths.items()) + '; a signal needs one for each time; '
                'transposed: true in a map turns tables that lie on their side')


class _Samples:
    def __init__(self, path: Path, signal: SignalMap, table: Table, import_map: ImportMap) -> None:
        self.stamps, self.values = array('q'), array('d')
        self.name = ' and '.join(map(str, signal.number.references))
        self._path, self._signal, self._counted = path, signal, table.counted
        self.clock = table.clock(signal.number.references[0].column, import_map.time.column
                                 if signal.time_column is None else signal.time_column)
        self.places = [table.place(self.clock)[0]]
        self._parts: list[tuple[Reference, int]] = []
        for reference in signal.number.references:
            place, index = table.place(reference.column)
            self.places.append(place)
            self._parts.append((reference if index is None else replace(reference, index=index),
                                place))
        self._decimal, self._duplicates = import_map.layout.decimal, import_map.time.duplicates
        # line and numbers of each sample, where all of them are needed for a value
        self._rows: list[tuple[int, list[float]]] = []

    def read(self, line: int, row: Sequence[Text], stamps: Mapping[str | int, int | None]) -> None:
        """Take the sample of a row, if it has one."""
        signal = self._signal
        numbers = []
        for reference, place in self._parts:
            cell = Cell(self._path, line, str(reference), self._counted)
            text = _element(row[place], reference, cell, self._decimal)
            if not text:
                return
            numbers.append(_number_of(text, cell, self._decimal, signal.sign_bit))
        value = math.nan if signal.number.whole else self._value(line, numbers)
        cell = Cell(self._path, line, self.name, self._counted)
        stamp = stamps.get(self.clock)
        if stamp is None:
            raise cell.refuse('there is a value, but no time stamp')
        stamp += signal.clock_offset_ns
        if abs(stamp) >= 2**63:
            raise cell.refuse('too large a number')
        if self.stamps and stamp == self.stamps[-1] and self._duplicates != 'refuse':
            if self._duplicates == 'first':
                return
            del self.stamps[-1:], self.values[-1:], self._rows[-1:]
        self.stamps.append(stamp)
        self.values.append(value)
        if signal.number.whole:
            self._rows.append((line, numbers))

    def finish(self) -> None:
        """Compute what could not be computed before all rows were there."""
        whole, rows, self._rows = self._signal.number.whole, self._rows, []
        if not rows:
            return
        time = (np.array(self.stamps) - self.stamps[0]) / NANOSECONDS
        for _, numbers in rows:
            numbers += [math.nan] * len(whole)
        for k, (term, function) in enumerate(whole, 1):
            taken = np.array([self._told(line, term, numbers) for line, numbers in rows])
            found = self._told(rows[-1][0], partial(function, time), taken)
            for (_, numbers), value in zip(rows, found.tolist(), strict=True):
                numbers[-k] = value
        self.values = array('d', (self._value(line, numbers) for line, numbers in rows))

    def _told(self, line: int, term: Callable[[Any], Any], given: Any) -> Any:
        """Return what a part of the expression gives; RecordingError, with its place, if none."""
        try:
            return term(given)
        except (ArithmeticError, ValueError) as error:
            raise Cell(self._path, line, self.name, self._counted).refuse(
                f'the expression has no value, {one_line(error)}') from None

    def _value(self, line: int, numbers: Sequence[float]) -> float:
        signal = self._signal
        number = self._told(line, signal.number.value, numbers)
        value = signal.factor * (signal.gain * number + signal.offset)
        if not math.isfinite(value):
            raise Cell(self._path, line, self.name, self._counted).refuse('too large a number')
        return value


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


class _Clock:
    """Reads one column of time stamps, and checks that they rise."""

    def __init__(self, path: Path, column: str | int, table: Table, import_map: ImportMap) -> None:
        self.repeated = 0
        self.place, index = table.place(column)
        self._time, self._decimal = import_map.time, import_map.layout.decimal
        self._reference = Reference(column, self._time.index if index is None else index)
        self._path, self._counted = path, table.counted
        self._previous: int | None = None

    def read(self, line: int, row: Sequence[Text]) -> int | None:
        """Return the time stamp of a row [ns], None if it has none."""
        cell = Cell(self._path, line, str(self._reference), self._counted)
        given = row[self.place]
        text = _element(given, self._reference, cell, self._decimal)
        if not text:
            return None
        if isinstance(given, Stamp):
            stamp = parse_nanoseconds(text, cell)
        elif self._time.unit == ISO_8601:
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
