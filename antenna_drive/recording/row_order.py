# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Rows of a table in the order of time: sorted where they are not, repeated ones left out."""

from collections.abc import Iterable
from pathlib import Path
import warnings

import numpy as np
from simgap.logs.channel import FloatArray, IntArray, RecordingError, RecordingWarning

Column = tuple[IntArray, FloatArray]


def sorted_rows(path: Path, time_column: str, stamps: IntArray, lines: IntArray,
                columns: Iterable[Column]) -> list[Column]:
    """
    Return the columns with their rows in the order of time, each row once.

    stamps, lines : time stamp and line of each row, shape (rows,)
    columns : stamps and values of each column, which may lack some rows

    Raises RecordingError if two rows have one time stamp and differ. Warns with RecordingWarning
    if rows were sorted, or repeated rows left out.
    """
    steps = np.diff(stamps)
    if np.any(steps < 0):
        warnings.warn(
            f'{path}: line {lines[1:][steps < 0][0]}: the time is earlier than in the row before; '
            'the rows were sorted by time', RecordingWarning, stacklevel=3)
    order = np.argsort(stamps, kind='stable')
    stamps, lines = stamps[order], lines[order]
    repeated = np.flatnonzero(np.diff(stamps) == 0) + 1
    rows_at = dict(zip(*(part.tolist() for part in np.unique(stamps[repeated],
                                                             return_counts=True))))
    found = []
    for column_stamps, values in columns:
        order = np.argsort(column_stamps, kind='stable')
        column_stamps, values = column_stamps[order], values[order]
        again = np.flatnonzero(np.diff(column_stamps) == 0) + 1
        # of equal rows, a value is in each or in none
        here, counts = np.unique(column_stamps, return_counts=True)
        twice = np.isin(here, stamps[repeated])
        unlike = [stamp for stamp, count in zip(here[twice].tolist(), counts[twice].tolist())
                  if count != 1 + rows_at[stamp]]
        unlike += column_stamps[again][values[again] != values[again - 1]].tolist()
        if unlike:
            place = int(np.searchsorted(stamps, min(unlike)))
            raise RecordingError(
                f'{path}: line {lines[place + 1]}, column {time_column}: the time is that of '
                f'line {lines[place]}, but the row is another one; remove one of them')
        found.append((np.delete(column_stamps, again), np.delete(values, again)))
    if repeated.size:
        warnings.warn(f'{path}: line {lines[repeated].min()}: the row repeats an earlier one; '
                      f'{repeated.size} such rows were left out', RecordingWarning, stacklevel=3)
    return found
