# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Recordings as CSV: the field test's columns, or every signal under its own name.

One row per time stamp; a cell is empty where a signal has no sample. Numbers are written so that
each double, and each time stamp in nanoseconds, is read back to its last bit. Beside NAME.csv
may lie NAME.yaml, the test sheet, and NAME.meta.json, which `write_csv` adds: the configuration,
live changes and notes, and the number of rows, by which a file that was cut is known.

docs/recording.md describes the columns.
"""

from array import array
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
import math
from pathlib import Path
import re
from typing import Any, IO
import warnings

from antenna_drive.readings import FIELD_COLUMNS, RATE_COMMAND, RATE_COMMAND_COLUMN
from antenna_drive.recording.atomic import new_file, refuse_existing
from antenna_drive.recording.plain import to_json
from antenna_drive.recording.recording import (
    all_stamps, Change, in_rows, Recording, unit_of,
)
from antenna_drive.recording.sheet import dump_sheet, load_sheet, TestSheet
import numpy as np
from simgap.errors import one_line
from simgap.inputs.limits import SAMPLES, SIGNALS
from simgap.inputs.plain import from_json, PlainDataError
from simgap.inputs.schema import nearest
from simgap.logs.channel import (
    Channel, check_name, FloatArray, IntArray, make_channel, NANOSECONDS, RecordingError,
    RecordingWarning,
)
from simgap.logs.text import Cell, open_text, parse_nanoseconds, parse_number, read_text, rows

TIME = 'time_s'
_OWN_COLUMN = re.compile(r'(\S+) \[([^\[\]]*)\]', re.ASCII)


def read_csv(path: str | Path) -> Recording:
    """
    Read a CSV file and what lies beside it.

    path : NAME.csv with the field test's columns (FIELD_COLUMNS) or those of `write_csv`

    Returns the recording; the test sheet is that of NAME.yaml where there is one.

    Raises RecordingError: the file cannot be read as such; the message names file, line and
    column.
    Raises ParameterError: NAME.yaml is no test sheet.
    Warns RecordingWarning: the last line is not ended, rows were not in the order of time, or rows
    were repeated.
    """
    path = Path(path)
    with open_text(path) as stream:
        table = rows(path, stream)
        line, header = next(table, (1, []))
        units = _header(path, line, header)
        stamps, columns = array('q'), [array('d') for _ in units]
        room = SAMPLES.value()
        time_column = list(units).index(TIME)
        previous, in_order = -2**63, True
        for line, row in table:
            if len(row) != len(units):
                raise RecordingError(f'{path}: line {line}: {len(row)} cells, but the header has '
                                     f'{len(units)}')
            cell = Cell(path, line, TIME)
            stamp = parse_nanoseconds(row[time_column].strip(), cell)
            in_order &= stamp > previous
            previous = stamp
            stamps.append(stamp)
            room -= len(row) - 1 - row.count('')
            if room < 0:
                raise RecordingError(f'{path}: line {line}: {SAMPLES.exceeded()}')
            for i, text in enumerate(row):
                if i != time_column:
                    text = text.strip()
                    columns[i].append(parse_number(text, Cell(path, line, header[i]))
                                      if text else math.nan)
    stamps_ns = np.array(stamps, np.int64)
    if not in_order:
        stamps_ns = _sort_rows(path, time_column, stamps_ns, columns)
    channels = {name: make_channel(name, unit, own_stamps, numbers)
                for (name, unit), (own_stamps, numbers) in zip(
                    units.items(), _taken(stamps_ns, columns), strict=True) if name != TIME}
    sheet_path = path.with_suffix('.yaml')
    sheet = load_sheet(sheet_path) if sheet_path.is_file() else TestSheet()
    return replace(_with_meta(path, Recording(channels), len(stamps)), sheet=sheet)


def _taken(stamps: IntArray, columns: list[Any]) -> Iterator[tuple[IntArray, FloatArray]]:
    """Yield stamps and values of each column, and keep none: ten million rows fill a memory."""
    stamps.flags.writeable = False
    while columns:
        values = np.array(columns.pop(0))
        values.flags.writeable = False
        there = np.isfinite(values)
        if there.size < stamps.size:
            yield stamps[:0], values  # of the time
        elif there.all():
            yield stamps, values  # as they are: a channel copies what can be written to
        else:
            yield stamps[there], values[there]


def _sort_rows(path: Path, time_column: int, stamps: IntArray, columns: list[Any]) -> IntArray:
    """
    Put the rows into the order of time, each once; return the stamps of those that are left.

    stamps : of each row [ns], shape (rows,)
    columns : of each but that of the time the values, NaN where there is none, shape (rows,)

    Raises RecordingError if two rows have one time stamp and differ. Warns with RecordingWarning
    if rows were sorted, or repeated rows left out.
    """
    with open_text(path) as stream, warnings.catch_warnings():
        warnings.simplefilter('ignore', RecordingWarning)
        # few ever need the lines: they are not kept while a file is read
        lines = np.array([line for line, _ in rows(path, stream)][1:])
    back = np.flatnonzero(np.diff(stamps) < 0) + 1
    if back.size:
        warnings.warn(f'{path}: line {lines[back[0]]}: the time is earlier than in the row '
                      'before; the rows were sorted by time', RecordingWarning, stacklevel=3)
    order = np.argsort(stamps, kind='stable')
    stamps, lines = stamps[order], lines[order]
    again = np.flatnonzero(np.diff(stamps) == 0) + 1
    for number in set(range(len(columns))) - {time_column}:
        values = np.array(columns[number])[order]
        before, after = values[again - 1], values[again]
        unlike = again[(before != after) & ~(np.isnan(before) & np.isnan(after))]
        if unlike.size:
            raise RecordingError(
                f'{path}: line {lines[unlike[0]]}, column {TIME}: the time is that of line '
                f'{lines[unlike[0] - 1]}, but the row is another one; remove one of them')
        columns[number] = np.delete(values, again)
    if again.size:
        warnings.warn(f'{path}: line {lines[again].min()}: the row repeats an earlier one; '
                      f'{again.size} such rows were left out', RecordingWarning, stacklevel=3)
    return np.delete(stamps, again)


def _header(path: Path, line: int, header: list[str]) -> dict[str, str]:
    """Return the unit of each column, by the name of its signal."""
    units: dict[str, str] = {}
    if len(header) > SIGNALS.value():
        raise RecordingError(f'{path}: line {line}: {SIGNALS.exceeded()}')
    for number, column in enumerate(header, 1):
        column = column.strip()
        cell = Cell(path, line, str(number))
        own = _OWN_COLUMN.fullmatch(column)
        if column == TIME:
            name, unit = TIME, 's'
        elif column in FIELD_COLUMNS:
            name = FIELD_COLUMNS[column]
            unit = unit_of(name)
        elif own:
            name, unit = own.groups()
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
        if name in units:
            raise cell.refuse(f'{one_line(column, 60)} is given twice')
        units[name] = unit
    if TIME not in units:
        raise RecordingError(f'{path}: line {line}: there is no column {TIME}')
    field = any(column.strip() in FIELD_COLUMNS for column in header)
    if field and RATE_COMMAND not in units:
        raise RecordingError(f'{path}: line {line}: there is no column {RATE_COMMAND_COLUMN}')
    return units


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
    """Return configuration, changes and notes from a file's plain data; or PlainDataError."""
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

    recording : what to write
    path : NAME.csv, not there yet
    field : write the field test's columns under their names, and no other signal
    names : the signals to write; all of them if not given

    Returns the files written.

    Raises RecordingError: there is no such signal, a file exists already, or cannot be written.
    """
    path = Path(path)
    if field:
        chosen = {column: name for column, name in FIELD_COLUMNS.items()
                  if name in recording and (names is None or name in names)}
        if RATE_COMMAND_COLUMN not in chosen:
            raise RecordingError(f'{RATE_COMMAND}: no such signal in this recording; a field test '
                                 'needs it')
    else:
        chosen = {f'{name} [{recording[name].unit}]': name
                  for name in (recording.names if names is None else names)}
    channels = [recording[name] for name in chosen.values()]
    meta = {'rows': len(all_stamps(channels)), 'configuration': recording.configuration,
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
                    _write_rows(stream, list(chosen), channels)
            undo.callback(target.unlink, missing_ok=True)
        undo.pop_all()
    return tuple(targets)


def _write_rows(stream: IO[bytes], columns: Sequence[str], channels: Sequence[Channel]) -> None:
    stream.write((','.join([TIME, *columns]) + '\n').encode())
    for stamps, table in in_rows(channels):
        cells = [map(format_nanoseconds, stamps.tolist()), *(
            ['' if math.isnan(value) else repr(value) for value in column]
            for column in table.T.tolist())]
        stream.write(('\n'.join(map(','.join, zip(*cells, strict=True))) + '\n').encode())


def format_nanoseconds(stamp: int) -> str:
    """Return a time stamp in seconds: all its nanoseconds, no idle zeros."""
    whole, rest = divmod(abs(stamp), NANOSECONDS)
    fraction = f'{rest:09d}'.rstrip('0') or '0'
    return f'{"-" if stamp < 0 else ""}{whole}.{fraction}'
