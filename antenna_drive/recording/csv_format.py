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
Recordings as CSV: the field test's columns, or every signal under its own name.

One row per time stamp; a cell is empty where a signal has no sample. Numbers are written so that
each double, and each time stamp in nanoseconds, is read back to its last bit. Beside NAME.csv
may lie NAME.yaml, the test sheet, and NAME.meta.json, which `write_csv` adds: the configuration,
live changes and notes, and the number of rows, by which a file that was cut is known.

docs/recording.md describes the columns.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
import csv
from dataclasses import replace
from decimal import Decimal
import math
from pathlib import Path
import re
from typing import Any, IO, NamedTuple, TextIO
import warnings

from antenna_drive.errors import one_line
from antenna_drive.limits import CSV_LINE, SAMPLES, SIGNALS, TEXT
from antenna_drive.parameters.schema import nearest
from antenna_drive.recording.atomic import new_file, refuse_existing
from antenna_drive.recording.plain import from_json, PlainDataError, to_json
from antenna_drive.recording.recording import (
    Change, Channel, check_name, IntArray, make_channel, NANOSECONDS, Recording, RecordingError,
    RecordingWarning, unit_of,
)
from antenna_drive.recording.row_order import Column, sorted_rows
from antenna_drive.recording.sheet import dump_sheet, load_sheet, TestSheet
import numpy as np

TIME = 'time_s'
RATE_COMMAND = 'rate_command_rad_s'
# The columns of a field test, and the signals that they are: the readings of the sensors.
FIELD_COLUMNS = {
    RATE_COMMAND: 'test_signal/rate_command',
    'current_1_A': 'motor_1/ammeter',
    'current_2_A': 'motor_2/ammeter',
    'tach_rate_1_rad_s': 'motor_1/tach_rate',
    'tach_rate_2_rad_s': 'motor_2/tach_rate',
    'encoder_rad': 'plant/encoder',
    'bias_voltage_V': 'torque_share/bias_voltage',
}

_NUMBER = re.compile(r'[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?', re.ASCII)
_OWN_COLUMN = re.compile(r'(\S+) \[([^\[\]]*)\]', re.ASCII)
_LATEST_S = 9.2e9  # what 64 bits of nanoseconds hold
_BLOCK = 65536  # rows written at a time


class Cell(NamedTuple):
    """Where in a file a number stands, for the message if it is none."""

    path: Path
    line: int
    column: str
    counted: str = 'line'

    def refuse(self, problem: str) -> RecordingError:
        """Return the error that names the place."""
        column = one_line(self.column, 60)
        return RecordingError(
            f'{self.path}: {self.counted} {self.line}, column {column}: {problem}')


def parse_number(text: str, cell: Cell) -> float:
    """
    Read one number.

    Raises
    ------
    RecordingError : no finite number; the message names file, line and column

    """
    if not _NUMBER.fullmatch(text):
        raise cell.refuse(f'{one_line(repr(text), 40)} is no number; leave the cell empty where '
                          'there is no sample')
    value = float(text)
    if not math.isfinite(value):
        raise cell.refuse(f'{one_line(repr(text), 40)} is too large a number')
    return value


def parse_nanoseconds(text: str, cell: Cell, per_unit: int = NANOSECONDS) -> int:
    """
    Read a time stamp, exact up to the nanosecond that it is rounded to.

    Parameters
    ----------
    text
        decimal number
    cell
        where it stands
    per_unit
        nanoseconds in the unit of the number; seconds if not given

    Raises
    ------
    RecordingError : no number, or beyond 9.2e9 s; the message names file, line and column

    """
    value = parse_number(text, cell)
    if abs(value) * per_unit > _LATEST_S * NANOSECONDS:
        raise cell.refuse(f'{one_line(repr(text), 40)} is beyond {_LATEST_S:g} s')
    return int((Decimal(text) * per_unit).to_integral_value())


def format_nanoseconds(stamp: int) -> str:
    """Return a time stamp in seconds: all its nanoseconds, no idle zeros."""
    whole, rest = divmod(abs(stamp), NANOSECONDS)
    fraction = f'{rest:09d}'.rstrip('0') or '0'
    return f'{"-" if stamp < 0 else ""}{whole}.{fraction}'


def rows(path: Path, stream: TextIO, delimiter: str = ',') -> Iterator[tuple[int, list[str]]]:
    """
    Yield the rows of a CSV file with the number of the line that each ends on.

    Empty lines are left out. Warns if the last line is not ended: it may have been cut.

    Raises
    ------
    RecordingError : no CSV, no text or too long a line; the message names file and line

    """
    last = ''

    longest = CSV_LINE.value()

    def lines() -> Iterator[str]:
        nonlocal last
        while line := stream.readline(longest + 1):
            if len(line) > longest:
                raise RecordingError(f'{path}: line {reader.line_num + 1}: '
                                     f'{CSV_LINE.exceeded()}')
            last = line
            yield line

    reader = csv.reader(lines(), delimiter=delimiter, strict=True)
    while True:
        try:
            row = next(reader)
        except StopIteration:
            break
        except csv.Error as error:
            raise RecordingError(f'{path}: line {reader.line_num}: no CSV, {error}') from None
        except UnicodeDecodeError:
            raise RecordingError(f'{path}: after line {reader.line_num}: no text in '
                                 f'{stream.encoding}') from None
        if row:
            yield reader.line_num, row
    if last and not last.endswith(('\n', '\r')):
        warnings.warn(f'{path}: line {reader.line_num} is not ended; was the file cut there?',
                      RecordingWarning, stacklevel=2)


def open_text(path: Path, encoding: str = 'utf-8-sig') -> TextIO:
    """
    Open a file for the csv module.

    Raises
    ------
    RecordingError : it cannot be opened

    """
    try:
        return open(path, encoding=encoding, newline='')
    except OSError as error:
        raise RecordingError(f'{path}: {error.strerror}') from error


def read_csv(path: str | Path) -> Recording:
    """
    Read a CSV file and what lies beside it.

    Parameters
    ----------
    path
        NAME.csv with the field test's columns (FIELD_COLUMNS) or those of `write_csv`

    Returns
    -------
    the recording; the test sheet is that of NAME.yaml where there is one

    Raises
    ------
    RecordingError : the file cannot be read as such; the message names file, line and column
    ParameterError : NAME.yaml is no test sheet

    Warns
    -----
    RecordingWarning : the last line is not ended, rows were not in the order of time, or rows
        were repeated

    """
    path = Path(path)
    with open_text(path) as stream:
        table = rows(path, stream)
        line, header = next(table, (1, []))
        names = _header(path, line, header)
        columns = [(array('q'), array('d')) for _ in names]
        room = SAMPLES.value()
        time_column = names.index(TIME)
        previous, count, in_order = -2**63, 0, True
        for line, row in table:
            if len(row) != len(names):
                raise RecordingError(f'{path}: line {line}: {len(row)} cells, but the header has '
                                     f'{len(names)}')
            cell = Cell(path, line, TIME)
            stamp = parse_nanoseconds(row[time_column].strip(), cell)
            in_order &= stamp > previous
            previous, count = stamp, count + 1
            room -= len(row) - 1 - row.count('')
            if room < 0:
                raise RecordingError(f'{path}: line {line}: {SAMPLES.exceeded()}')
            for i, text in enumerate(row):
                text = text.strip()
                if i != time_column and text:
                    stamps, values = columns[i]
                    stamps.append(stamp)
                    values.append(parse_number(text, Cell(path, line, header[i])))
    ordered: Iterable[Column] = ((np.array(stamps, np.int64), np.array(values))
                                 for stamps, values in columns)
    if not in_order:
        ordered = sorted_rows(path, TIME, *_times_and_lines(path, time_column), ordered)
    channels = {}
    for i, (name, (stamps_ns, numbers)) in enumerate(zip(names, ordered, strict=True)):
        if i != time_column:
            unit = unit_of(name) if header[i].strip() in FIELD_COLUMNS else _unit(header[i])
            channels[name] = make_channel(name, unit, stamps_ns, numbers)
    sheet_path = path.with_suffix('.yaml')
    sheet = load_sheet(sheet_path) if sheet_path.is_file() else TestSheet()
    return replace(_with_meta(path, Recording(channels), count), sheet=sheet)


def _times_and_lines(path: Path, time_column: int) -> tuple[IntArray, IntArray]:
    """Return time stamp and line of each row of a file that has been read; few ever need them."""
    with open_text(path) as stream, warnings.catch_warnings():
        warnings.simplefilter('ignore', RecordingWarning)
        table = rows(path, stream)
        next(table)
        found = [(parse_nanoseconds(row[time_column].strip(), Cell(path, line, TIME)), line)
                 for line, row in table]
    stamps, lines = np.array(found, np.int64).T
    return stamps, lines


def _header(path: Path, line: int, header: list[str]) -> list[str]:
    names: list[str] = []
    if len(header) > SIGNALS.value():
        raise RecordingError(f'{path}: line {line}: {SIGNALS.exceeded()}')
    for number, column in enumerate(header, 1):
        column = column.strip()
        cell = Cell(path, line, str(number))
        own = _OWN_COLUMN.fullmatch(column)
        if column == TIME:
            name = TIME
        elif column in FIELD_COLUMNS:
            name = FIELD_COLUMNS[column]
        elif own:
            name = own.group(1)
            try:
                check_name(name)
            except RecordingError as error:
                raise cell.refuse(str(error)) from None
        else:
            known = [TIME, *FIELD_COLUMNS]
            raise cell.refuse(
                f'no such column {one_line(repr(column), 40)}{nearest(column, known)} Allowed are '
                f"{', '.join(known)} and 'unit/signal [unit]'; antenna-drive import --map reads "
                'other columns')
        if name in names:
            raise cell.refuse(f'{one_line(column, 60)} is given twice')
        names.append(name)
    if TIME not in names:
        raise RecordingError(f'{path}: line {line}: there is no column {TIME}')
    field = any(column.strip() in FIELD_COLUMNS for column in header)
    if field and FIELD_COLUMNS[RATE_COMMAND] not in names:
        raise RecordingError(f'{path}: line {line}: there is no column {RATE_COMMAND}')
    return names


def _unit(column: str) -> str:
    own = _OWN_COLUMN.fullmatch(column.strip())
    return own.group(2) if own else ''


def read_text(path: Path) -> bytes:
    """
    Read a file of text that lies beside a recording.

    Raises
    ------
    OSError : it cannot be read
    RecordingError : it is longer than allowed

    """
    most = TEXT.value()
    with path.open('rb') as file:
        text = file.read(most + 1)
    if len(text) > most:
        raise RecordingError(f'{path}: {TEXT.exceeded()}')
    return text


def meta_path(path: Path) -> Path:
    """Return the file beside a CSV that holds what its cells cannot."""
    return path.with_suffix('.meta.json')


def _with_meta(path: Path, recording: Recording, count: int) -> Recording:
    beside = meta_path(path)
    if not beside.is_file():
        return recording
    try:
        meta = from_json(read_text(beside))
        if not isinstance(meta, dict) or not isinstance(meta.get('rows'), int):
            raise PlainDataError('no description of a CSV')
        if meta['rows'] != count:
            raise RecordingError(f'{path}: {count} rows, but {beside.name} tells of '
                                 f'{meta["rows"]}; was the file cut? If not, remove {beside.name}')
        return replace(recording, **parse_known(meta))
    except OSError as error:
        raise RecordingError(f'{beside}: {error.strerror}') from error
    except PlainDataError as error:
        raise RecordingError(f'{beside}: {error}') from None


def parse_known(meta: dict[str, Any]) -> dict[str, Any]:
    """
    Return configuration, changes and notes from plain data that a file held.

    Raises
    ------
    PlainDataError : something in it is not what it has to be

    """
    changes = []
    given = meta.get('changes', [])
    for item in given if isinstance(given, list) else [given]:
        try:
            step, unit, values = item
        except (TypeError, ValueError):
            raise PlainDataError('a live change is not [step, unit, values]') from None
        if type(step) is not int or not isinstance(unit, str) or not isinstance(values, dict):
            raise PlainDataError('a live change is not [step, unit, values]')
        changes.append(Change(step, unit, values))
    known: dict[str, Any] = {'changes': tuple(changes)}
    for key in ('configuration', 'notes'):
        known[key] = meta.get(key, {})
        if not isinstance(known[key], dict):
            raise PlainDataError(f'{key} is no mapping')
    return known


def write_csv(recording: Recording, path: str | Path, *, field: bool = False,
              names: Sequence[str] | None = None) -> tuple[Path, ...]:
    """
    Write a recording as CSV, with its test sheet and what else is known of it beside it.

    Parameters
    ----------
    recording
        what to write
    path
        NAME.csv, not there yet
    field
        write the field test's columns under their names, and no other signal
    names
        the signals to write; all of them if not given

    Returns
    -------
    the files written

    Raises
    ------
    RecordingError : there is no such signal, a file exists already, or cannot be written

    """
    path = Path(path)
    if field:
        chosen = {column: name for column, name in FIELD_COLUMNS.items()
                  if name in recording and (names is None or name in names)}
        if RATE_COMMAND not in chosen:
            raise RecordingError(f'{FIELD_COLUMNS[RATE_COMMAND]}: no such signal in this '
                                 'recording; a field test needs it')
    else:
        chosen = {f'{name} [{recording[name].unit}]': name
                  for name in (recording.names if names is None else names)}
    channels = [recording[name] for name in chosen.values()]
    stamps = np.unique(np.concatenate([np.empty(0, np.int64), *(c.time_ns for c in channels)]))
    meta = {'rows': len(stamps), 'configuration': recording.configuration,
            'changes': tuple(tuple(change) for change in recording.changes),
            'notes': recording.notes}
    beside, sheet_path = meta_path(path), path.with_suffix('.yaml')
    targets = [beside, *([sheet_path] if recording.sheet else []), path]
    for target in targets:
        refuse_existing(target)
    with ExitStack() as undo:
        for target in targets:
            with new_file(target) as stream:
                if target == beside:
                    stream.write(to_json(meta).encode() + b'\n')
                elif target == sheet_path:
                    stream.write(dump_sheet(recording.sheet).encode())
                else:
                    _write_rows(stream, list(chosen), channels, stamps)
            undo.callback(target.unlink, missing_ok=True)
        undo.pop_all()
    return tuple(targets)


def _write_rows(stream: IO[bytes], columns: Sequence[str], channels: Sequence[Channel],
                stamps: Any) -> None:
    stream.write((','.join([TIME, *columns]) + '\n').encode())
    for first in range(0, len(stamps), _BLOCK):
        block = stamps[first:first + _BLOCK]
        cells = [[format_nanoseconds(stamp) for stamp in block.tolist()]]
        for channel in channels:
            low, high = np.searchsorted(channel.time_ns, [block[0], block[-1] + 1])
            column = [''] * len(block)
            places = np.searchsorted(block, channel.time_ns[low:high])
            for place, value in zip(places.tolist(), channel.values[low:high].tolist(),
                                    strict=True):
                column[place] = repr(value)
            cells.append(column)
        stream.write(('\n'.join(map(','.join, zip(*cells, strict=True))) + '\n').encode())
