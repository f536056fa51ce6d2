# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Tables as they come: text, .npy, .npz, .mat, JSON, JSON lines and Parquet, as rows of cells.

Cells are texts, empty without a sample, or vectors of texts. A number becomes the shortest text
that is read back to its last bit, so a file means the same whatever its kind.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
import itertools
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zipfile import BadZipFile, ZipFile
import zlib

import numpy as np
from simgap.errors import one_line
from simgap.inputs.limits import CSV_LINE, SAMPLES, SIGNALS
from simgap.inputs.plain import from_json, PlainDataError
from simgap.logs.channel import RecordingError
from simgap.logs.mat import read_mat
from simgap.logs.text import open_text, read_text, rows

# A cell: a text that may be a number, or a vector of such texts.
Text = str | list[str]
_BLOCK = 4096   # rows that are turned into cells at a time
# what the libraries raise where a file is damaged
_DAMAGE = (ValueError, TypeError, BadZipFile, EOFError, zlib.error, ArithmeticError, LookupError,
           AttributeError, RuntimeError, SyntaxError, TokenError)


@dataclass(frozen=True)
class Layout:
    """How text is laid out; other kinds of files need no such help."""

    delimiter: str = ''  # between cells; '' for the one that the header has
    decimal: str = '.'  # in numbers
    comment: str = ''  # rows that begin with it are left out; '' for none
    encoding: str = 'utf-8-sig'
    skip_lines: int = 0  # lines before the header
    header: bool = True  # False if the columns have no names
    units_row: bool = False  # whether a row behind the header is left out
    missing: tuple[str, ...] = ()  # cells that hold no sample, such as NaN


@dataclass(frozen=True)
class Table:
    """An open file."""

    names: Sequence[str]  # of the columns; empty texts where they have none
    rows: Iterator[tuple[int, Sequence[Text]]]  # with the number of each one's line
    start: str = ''  # where the names stand, for errors
    counted: str = 'row'  # what the number of a row counts
    # of columns that need not be equally long
    lengths: Mapping[str, int] = field(default_factory=dict)
    is_text: bool = False  # whether a cell that is not a number is a mistake


@contextmanager
def open_table(path: Path, layout: Layout = Layout()) -> Iterator[Table]:
    """Open a file by its suffix, else as text; RecordingError if it is damaged or too large."""
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        with open_text(path, layout.encoding) as stream:
            yield _text_table(path, stream, layout)
        return
    try:
        table = reader(path)
        if len(table.names) > SIGNALS.value():
            raise RecordingError(SIGNALS.exceeded())
        yield table
    except OSError as error:
        raise RecordingError(f'{path}: {error.strerror or one_line(error)}') from error
    except RecordingError as error:
        told = str(error)
        raise RecordingError(told if told.startswith(f'{path}') else f'{path}: {told}') from None


def _text_table(path: Path, stream: Any, layout: Layout) -> Table:
    try:
        for _ in range(layout.skip_lines):
            stream.readline(CSV_LINE.value())
    except UnicodeDecodeError:
        raise RecordingError(f'{path}: line 1: no text in {stream.encoding}') from None
    table = _text_rows(path, stream, layout)
    line, first = next(table, (layout.skip_lines + 1, []))
    start = f'line {line}: '
    if layout.units_row:
        next(table, None)
    if layout.header:
        return Table([cell.strip() for cell in first], table, start, 'line', is_text=True)
    again = [(line, first)] if first else []
    return Table([''] * len(first), itertools.chain(again, table), start, 'line', is_text=True)


def _text_rows(path: Path, stream: Any, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows behind what is to be skipped, comments left out, with their true lines."""
    count = None
    for line, row in rows(path, stream, layout.delimiter):
        if layout.comment and row[0].lstrip().startswith(layout.comment):
            continue
        count = len(row) if count is None else count
        if len(row) != count:
            what = 'header' if layout.header else 'first row'
            raise RecordingError(f'{path}: line {line + layout.skip_lines}: {len(row)} cells, but '
                                 f"the {what} has {count}; a decimal comma needs delimiter: ';'")
        yield line + layout.skip_lines, ['' if cell.strip() in layout.missing else cell
                                         for cell in row]


def _arrays(columns: Mapping[str, Any], names: Sequence[str] | None = None) -> Table:
    """Return arrays as a table: vectors are columns, shape (n, k) is a column of vectors."""
    columns = {name: _upright(values) for name, values in columns.items()
               if values.dtype.kind in 'biuf'}
    columns = {name: values for name, values in columns.items() if values.ndim in (1, 2)}
    lengths = {name: len(values) for name, values in columns.items()}
    return Table(list(columns) if names is None else names, _array_rows(columns), lengths=lengths)


def _upright(values: Any) -> Any:
    """Return an array without the dimension that MATLAB gives to every vector."""
    return values.squeeze() if values.ndim == 2 and 1 in values.shape else values


def _array_rows(columns: Mapping[str, Any]) -> Iterator[tuple[int, Sequence[Text]]]:
    count = max(map(len, columns.values()), default=0)
    for first in range(0, count, _BLOCK):
        parts = [[_cell(value) for value in values[first:first + _BLOCK].tolist()]
                 for values in columns.values()]
        yield from enumerate(itertools.zip_longest(*parts, fillvalue=''), first + 1)


def _npy(path: Path) -> Table:
    with path.open('rb') as stream:
        _within(SAMPLES.value() - _npy_header(stream)[0])
        stream.seek(0)
        values = np.load(stream, allow_pickle=False)
    if values.dtype.names:
        return _arrays({name: values[name] for name in values.dtype.names})
    table = values[:, np.newaxis] if values.ndim == 1 else values
    if table.ndim != 2 or table.dtype.kind not in 'biuf':
        raise RecordingError(f'an array of shape {values.shape} and type {values.dtype}, allowed '
                             'is a table of numbers, or an array with named columns')
    columns = {str(j): table[:, j] for j in range(min(table.shape[1], SIGNALS.value() + 1))}
    return _arrays(columns, [''] * len(columns))


def _npz(path: Path) -> Table:
    wanted, room = [], SAMPLES.value()
    with ZipFile(path) as archive:
        for name in archive.namelist():
            if name.endswith('.npy'):
                with archive.open(name) as stream:
                    count, kind = _npy_header(stream)
                if kind.kind in 'biuf':
                    wanted.append(name.removesuffix('.npy'))
                    room -= count
    _within(room)
    with np.load(path, allow_pickle=False) as file:
        return _arrays({name: np.asarray(file[name]) for name in wanted})


def _npy_header(stream: Any) -> tuple[int, Any]:
    """Return how many numbers an array holds, and their type, before anything is unpacked."""
    version = np.lib.format.read_magic(stream)
    read = (np.lib.format.read_array_header_1_0 if version == (1, 0)
            else np.lib.format.read_array_header_2_0)
    shape, _, kind = read(stream)
    return int(np.prod(shape, dtype=object)) * max(1, len(kind.names or ())), kind


def _within(room: int) -> None:
    if room < 0:
        raise RecordingError(SAMPLES.exceeded())


def _json(path: Path) -> Table:
    tree = from_json(read_text(path))
    if isinstance(tree, dict):
        columns = {name: values for name, values in tree.items() if isinstance(values, list)}
        count = max(map(len, columns.values()), default=0)
        cells = ([_cell(values[k]) if k < len(values) else '' for values in columns.values()]
                 for k in range(count))
        return Table(list(columns), enumerate(cells, 1),
                     lengths={name: len(values) for name, values in columns.items()})
    if isinstance(tree, list):
        return _records(enumerate(tree, 1), 'record')
    raise RecordingError('a single value, allowed is a mapping of columns or a list of records')


def _json_lines(path: Path) -> Table:
    return _records(_parsed_lines(path), 'line')


def _parsed_lines(path: Path) -> Iterator[tuple[int, Any]]:
    longest = CSV_LINE.value()
    with path.open('rb') as stream:
        number = 0
        while line := stream.readline(longest + 1):
            number += 1
            if len(line) > longest:
                raise RecordingError(f'line {number}: {CSV_LINE.exceeded()}')
            if line.strip():
                try:
                    yield number, from_json(line.strip())
                except PlainDataError as error:
                    raise RecordingError(f'line {number}: {error}') from None


def _records(items: Iterator[tuple[int, Any]], counted: str) -> Table:
    """Return records as rows; the columns are those of the first, and others may lack some."""
    number, first = next(items, (1, {}))
    if not isinstance(first, dict):
        raise RecordingError(f'{counted} {number}: no mapping from columns to values')
    names = list(first)

    def cells() -> Iterator[tuple[int, Sequence[Text]]]:
        for place, record in itertools.chain([(number, first)], items):
            if not isinstance(record, dict):
                raise RecordingError(f'{counted} {place}: no mapping from columns to values')
            yield place, [_cell(record.get(name)) for name in names]

    return Table(names, cells(), counted=counted)


def _parquet(path: Path) -> Table:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise RecordingError('needs pyarrow: pip install pyarrow') from None
    try:
        file = parquet.ParquetFile(path)
        # what it says of single columns, Arrow reads without a check that a program survives
        _within(SAMPLES.value() - file.metadata.num_rows * file.metadata.num_columns)
        return Table(file.schema_arrow.names, _parquet_rows(file, pyarrow))
    except pyarrow.ArrowException as error:
        raise RecordingError(f'no Parquet, {one_line(error)}') from None


def _parquet_rows(file: Any, pyarrow: Any) -> Iterator[tuple[int, Sequence[Text]]]:
    first = 1
    try:
        for batch in file.iter_batches(_BLOCK, use_threads=False):
            columns = []
            for column in batch.columns:
                if pyarrow.types.is_timestamp(column.type):
                    # Python's dates know microseconds
                    column = column.cast(pyarrow.timestamp('us', column.type.tz), safe=False)
                columns.append([_cell(value) for value in column.to_pylist()])
            yield from enumerate(zip(*columns, strict=True), first)
            first += batch.num_rows
    except pyarrow.ArrowException as error:
        raise RecordingError(f'after row {first - 1}: no Parquet, {one_line(error)}') from None


def _cell(value: Any) -> Text:
    """Return a value of a file as a cell: a vector if it is a list."""
    return [_text(part) for part in value] if isinstance(value, list) else _text(value)


def _text(value: Any) -> str:
    """Return a single value as a text; NaN and null are not samples."""
    if value is None or value != value:
        return ''
    if isinstance(value, (bool, int, float)):
        return repr(int(value) if isinstance(value, bool) else value)
    if isinstance(value, datetime):
        return value.isoformat()
    return value if isinstance(value, str) else f'a {type(value).__name__}'


def _refusing(read: Callable[[Path], Table]) -> Callable[[Path], Table]:
    """Return a reader that says in a line what a library says of a damaged file."""
    def reader(path: Path) -> Table:
        try:
            return read(path)
        except (OSError, RecordingError):
            raise
        except MemoryError:
            raise RecordingError('not enough memory for what the file says it holds') from None
        except PlainDataError as error:
            raise RecordingError(str(error)) from None
        except _DAMAGE as error:
            raise RecordingError(f'no {path.suffix} that can be read, '
                                 f'{one_line(error) or type(error).__name__}') from None
    return reader


_READERS: Mapping[str, Callable[[Path], Table]] = {
    suffix: _refusing(read) for suffixes, read in (
        ('.npy', _npy), ('.npz', _npz), ('.mat', lambda path: _arrays(read_mat(path))),
        ('.json', _json), ('.jsonl .ndjson', _json_lines), ('.parquet .pq', _parquet))
    for suffix in suffixes.split()}
