# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A table: rows of cells under named columns, whatever file they come from.

Cells are texts, empty without a sample, or vectors of texts. A number becomes the shortest text
that is read back to its last bit, so a file means the same whatever its kind.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, NamedTuple

import numpy as np
from simgap.errors import one_line
from simgap.inputs.schema import nearest
from simgap.logs.channel import RecordingError

# A cell: a text that may be a number, or a vector of such texts.
Text = str | list[str]
# usual names of a column of time in seconds, and one that some files have
TIMES = ('time_s', 'time', 't')
_MORE_TIMES = (*TIMES, 'timestamp')
AUTO = 'auto'  # in the place of a column: the time is found


class Seen(NamedTuple):
    """What a first look at a topic, or at a table, shows."""

    topic: str  # '' for a table
    kind: str  # the type of its messages
    clock: str | int
    columns: Sequence[str | int]  # of numbers
    remark: str = ''


@dataclass(frozen=True)
class Layout:
    """How a file is laid out; but for the last two entries, kinds other than text need no help."""

    delimiter: str = ''  # between cells; '' for the one that the header has
    decimal: str = '.'  # in numbers
    comment: str = ''  # rows that begin with it are left out; '' for none
    encoding: str = 'utf-8-sig'
    skip_lines: int = 0  # lines before the header
    header: bool = True  # False if the columns have no names
    units_row: bool = False  # whether a row behind the header is left out
    missing: tuple[str, ...] = ()  # cells that hold no sample, such as NaN
    transposed: bool = False  # whether the table lies on its side: a column in each row
    records: str = ''  # the path of the table in a file of JSON; '' for the only one there is


@dataclass
class Table:
    """An open file."""

    names: list[str]  # of the columns; empty texts where they have none
    rows: Iterator[tuple[int, Sequence[Text]]]  # with the number of each one's line
    start: str = ''  # where the names stand, for errors
    counted: str = 'row'  # what the number of a row counts
    # of columns that need not be equally long
    lengths: Mapping[str, int] = field(default_factory=dict)
    is_text: bool = False  # whether a cell that is not a number is a mistake
    labels: Mapping[str, Sequence[str]] = field(default_factory=dict)  # of the numbers in vectors
    constants: Mapping[str, float] = field(default_factory=dict)  # that stand beside the table

    def place(self, column: str | int) -> tuple[int, int | None]:
        """Return where a column stands in a row; for `v[2]` or `v[elbow]` also which number."""
        if isinstance(column, int):
            if column >= len(self.names):
                raise RecordingError(f'{self.start}there is no column number {column}, counted '
                                     f'from 0; there are {len(self.names)}')
            return column, None
        if not any(self.names):
            raise RecordingError(
                f'{self.start}the column {one_line(repr(column), 60)} is not there: the columns '
                'have no names; give their numbers, counted from 0')
        vector, _, label = column.removesuffix(']').rpartition('[')
        if column not in self.names and self.names.count(vector) == 1:
            labels = self.labels.get(vector, ())
            if not label.isdecimal() and label not in labels:
                raise RecordingError(f'{one_line(vector)} has no number {one_line(label)}'
                                     f'{nearest(label, labels)}; allowed are numbers from 0'
                                     + ''.join(f', {one_line(known)}' for known in labels))
            return (self.names.index(vector),
                    int(label) if label.isdecimal() else labels.index(label))
        if self.names.count(column) != 1:
            what = ('is there twice' if column in self.names else
                    f'is not there{one_line(nearest(column, self.names))}')
            raise RecordingError(f'{self.start}the column {one_line(repr(column), 60)} {what}')
        return self.names.index(column), None

    def clock(self, column: str | int, chosen: str | int) -> str | int:
        """Return the column of time for a column: the chosen one, for AUTO the first usual one."""
        if chosen == AUTO and AUTO not in self.names:
            found = next((name for name in _MORE_TIMES if name in self.names), None)
            if found is None:
                raise RecordingError(f'no column {" or ".join(_MORE_TIMES)}; time: {{column: x}} '
                                     'in a map says which one is the time')
            return found
        return chosen


def cell_of(value: Any) -> Text:
    """Return a value of a file as a cell: a vector if it is a list."""
    value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
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
