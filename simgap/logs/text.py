# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Text files of numbers: rows of cells, and the number or the time stamp in each cell."""

from collections.abc import Callable, Iterator
from contextvars import ContextVar
import csv
from decimal import Decimal
import itertools
import math
import os
from pathlib import Path
import re
from typing import NamedTuple, TextIO
import warnings

from simgap.errors import one_line
from simgap.inputs.limits import CSV_LINE, TEXT
from simgap.logs.channel import NANOSECONDS, RecordingError, RecordingWarning

_NUMBER = re.compile(r'[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?', re.ASCII)
LATEST_S = 9.2e9  # what 64 bits of nanoseconds hold
# Gets the share of a large file that has been read; a command shows it.
READ: ContextVar[Callable[[float], None]] = ContextVar('READ', default=lambda share: None)


class Cell(NamedTuple):
    """Where in a file a number stands, for the message if it is none."""

    path: Path
    line: int
    column: str
    counted: str = 'line'

    def refuse(self, problem: str) -> RecordingError:
        """Return the error that names the place."""
        return RecordingError(f'{self.path}: {self.counted} {self.line}, column '
                              f'{one_line(self.column, 60)}: {problem}')


def parse_number(text: str, cell: Cell) -> float:
    """Read one finite number; RecordingError names file, line and column."""
    if not _NUMBER.fullmatch(text):
        raise cell.refuse(f'{one_line(repr(text), 40)} is no number; ' + (
            "a map with decimal: ',' reads a decimal comma" if ',' in text else
            'leave the cell empty where there is no sample, or let a map say missing: [NaN, N/A]; '
            'units_row: true in a map leaves out a row of units'))
    value = float(text)
    if not math.isfinite(value):
        raise cell.refuse(f'{one_line(repr(text), 40)} is too large a number')
    return value


def parse_nanoseconds(text: str, cell: Cell, per_unit: int = NANOSECONDS) -> int:
    """Read a decimal time stamp [ns]; RecordingError, with its place, beyond 9.2e9 s."""
    value = parse_number(text, cell)
    if abs(value) * per_unit > LATEST_S * NANOSECONDS:
        raise cell.refuse(f'{one_line(repr(text), 40)} is beyond {LATEST_S:g} s')
    return int((Decimal(text) * per_unit).to_integral_value())


def rows(path: Path, stream: TextIO, delimiter: str = '') -> Iterator[tuple[int, list[str]]]:
    """
    Yield the rows of a CSV file, but for empty ones, with the number of the line each ends on.

    Without a delimiter it is that of the first line. Warns if the last line may have been cut.
    """
    last, longest = '', CSV_LINE.value()
    try:
        first = stream.readline(longest + 1)
    except UnicodeDecodeError:
        raise RecordingError(f'{path}: after line 0: no text in {stream.encoding}') from None
    found = [c for c in ',;\t' if c in first] or [',']
    if not delimiter and len(found) > 1:
        raise RecordingError(f'{path}: line 1: {" and ".join(map(repr, found))} are there; let a '
                             'map say which is the delimiter, and decimal')

    def lines() -> Iterator[str]:
        nonlocal last
        for line in itertools.chain([first], iter(lambda: stream.readline(longest + 1), '')):
            if reader.line_num % 65536 == 65535:
                READ.get()(stream.buffer.tell() / os.fstat(stream.fileno()).st_size)
            if len(line) > longest:
                raise RecordingError(f'{path}: line {reader.line_num + 1}: '
                                     f'{CSV_LINE.exceeded()}')
            last = line
            yield line

    reader = csv.reader(lines(), delimiter=delimiter or found[0], strict=True)
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
    """Open a file for the csv module. Raises RecordingError if it cannot be opened."""
    try:
        with open(path, 'rb') as file:
            if file.read(2) in (b'\xff\xfe', b'\xfe\xff') and encoding == 'utf-8-sig':
                encoding = 'utf-16'
        return open(path, encoding=encoding, newline='')
    except OSError as error:
        raise RecordingError(f'{path}: {error.strerror}') from error


def read_text(path: Path) -> bytes:
    """Read a file of text; OSError, or RecordingError if it is longer than allowed."""
    most = TEXT.value()
    with path.open('rb') as file:
        text = file.read(most + 1)
    if len(text) > most:
        raise RecordingError(f'{path}: {TEXT.exceeded()}')
    return text
