# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Opens a file of any kind as a table: its kind is known by what it holds, else by its name."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
import itertools
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zipfile import BadZipFile
import zlib

from simgap.errors import one_line
from simgap.inputs.limits import CSV_LINE, SIGNALS
from simgap.inputs.plain import PlainDataError
from simgap.logs.bags import BagTable
from simgap.logs.channel import RecordingError
from simgap.logs.files import (
    arrays, read_json, read_json_lines, read_npy, read_npz, read_parquet,
)
from simgap.logs.mat import read_mat
from simgap.logs.table import Layout, Table
from simgap.logs.text import open_text, rows

# what the libraries raise where a file is damaged
_DAMAGE = (ValueError, TypeError, BadZipFile, EOFError, zlib.error, ArithmeticError, LookupError,
           AttributeError, RuntimeError, SyntaxError, TokenError)


@contextmanager
def open_table(path: Path, layout: Layout = Layout()) -> Iterator[Table]:
    """Open a file as its kind is opened; RecordingError if it is damaged or too large."""
    try:
        kind = kind_of(path)
        if not kind:
            with open_text(path, layout.encoding) as stream:
                yield _text_table(path, stream, layout)
            return
        table = _refusing(path, _READERS[kind], layout)
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
    if layout.transposed:
        lines = [first, *(row for _, row in table)]
        skipped = layout.header + layout.units_row
        return Table([row[0].strip() if layout.header else '' for row in lines],
                     enumerate(zip(*(row[skipped:] for row in lines), strict=True), 1), '',
                     'place', is_text=True)
    if layout.units_row:
        next(table, None)
    if layout.header:
        return Table([cell.strip() for cell in first], table, start, 'line', is_text=True)
    table = itertools.chain([(line, first)] if first else [], table)
    return Table([''] * len(first), table, start, 'line', is_text=True)


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


def _refusing(path: Path, read: Callable[[Path, Layout], Table], layout: Layout) -> Table:
    """Read a file, and say in a line what a library says of a damaged one."""
    try:
        return read(path, layout)
    except (OSError, RecordingError):
        raise
    except MemoryError:
        raise RecordingError('not enough memory for what the file says it holds') from None
    except PlainDataError as error:
        raise RecordingError(str(error)) from None
    except _DAMAGE as error:
        raise RecordingError(f'no {path.suffix} that can be read, '
                             f'{one_line(error) or type(error).__name__}') from None


_READERS: Mapping[str, Callable[[Path, Layout], Table]] = {
    '.npy': read_npy, '.npz': read_npz, '.json': read_json,
    '.mat': lambda path, layout: arrays(read_mat(path), layout),
    '.jsonl': read_json_lines, '.ndjson': read_json_lines, '.parquet': read_parquet,
    '.pq': read_parquet, '.mcap': lambda path, layout: BagTable(path)}
# The kind that the first bytes tell, or a remedy; JSON and the oldest .mat have none of their own.
_STARTS = {
    b'\x89MCAP0': '.mcap', b'SQLite format 3': '.mcap', b'PAR1': '.parquet', b'\x93NUMPY': '.npy',
    b'PK\x03\x04': '.npz', b'MATLAB 5.0': '.mat',
    b'\x28\xb5\x2f\xfd': 'packed as a whole; `zstd -d FILE` unpacks it, and folders need it not',
    b'#ROSBAG': 'a bag of ROS 1; `rosbags-convert --src FILE --dst FOLDER` makes one of ROS 2',
    b'\x89HDF': 'a file of HDF5; save it as .npz or .parquet, or with -v7 in MATLAB'}


def kind_of(path: Path) -> str:
    """Return the suffix that a file's kind usually has, '' for text; OSError if unreadable."""
    if path.is_dir():
        return '.mcap'
    with path.open('rb') as stream:
        begun = stream.read(max(map(len, _STARTS)))
    kind = next((kind for start, kind in _STARTS.items() if begun.startswith(start)),
                path.suffix.lower() if path.suffix.lower() in _READERS else '')
    if kind and kind not in _READERS:
        raise RecordingError(f'{path}: {kind}')
    return kind
