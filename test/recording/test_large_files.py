# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Ten million rows fit into two gigabytes while they are read, and it is told how far it is."""

from __future__ import annotations

from collections.abc import Callable
import io
from pathlib import Path
import sys
import tracemalloc

from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.csv_format import read_csv
from antenna_drive.recording.files import import_file, load_map
import numpy as np
import pytest
from simgap.command.output import reading
from simgap.logs.log import read_logs

COLUMNS = ['time_s', *FIELD_COLUMNS][:8]
# of a cell, while a file with eight columns and ten million rows is read
MOST_BYTES = 2e9 / (8 * 10_000_000)


def table(path: Path, rows: int, columns: list[str]) -> Path:
    """Write a table of small numbers, with rising times."""
    values = np.random.default_rng(1).normal(size=(rows, len(columns)))
    values[:, 0] = np.arange(rows) * 1e-3
    np.savetxt(path, values * 1e-3, delimiter=',', comments='', header=','.join(columns))
    return path


def mapped(path: Path) -> Path:
    """Write a map of every column but the time."""
    (path / 'map.yaml').write_text('time: {column: time_s}\nsignals:\n' + ''.join(
        f'  log/s{k}: {{column: {name}, unit: "1"}}\n' for k, name in enumerate(COLUMNS[1:])))
    return path / 'map.yaml'


@pytest.mark.parametrize('read', [
    lambda path: read_csv(path),
    lambda path: import_file(path, load_map(mapped(path.parent))),
    lambda path: read_logs([path]),
    lambda path: read_logs([path], mapped(path.parent))],
    ids=['drive', 'drive, mapped', 'log', 'log, mapped'])
@pytest.mark.slow
def test_a_cell_takes_few_bytes(read: Callable[[Path], object], tmp_path: Path) -> None:
    path = table(tmp_path / 'rec.csv', 20_000, COLUMNS)
    read(table(tmp_path / 'few.csv', 10, COLUMNS))  # whatever is loaded once
    tracemalloc.start()
    try:
        found = read(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert found
    assert peak / (20_000 * len(COLUMNS)) < MOST_BYTES


class Terminal(io.StringIO):
    """Standard error that somebody watches."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(('rows', 'shown'), [(70_000, True), (100, False)])
def test_how_far_a_large_file_is_read_is_shown(
        rows: int, shown: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = table(tmp_path / 'log.csv', rows, ['time_s', 'angle'])
    terminal = Terminal()
    monkeypatch.setattr(sys, 'stderr', terminal)
    with reading():
        read_logs([path])
    assert ('reading  [' in terminal.getvalue()) is shown
    assert ('100 %' in terminal.getvalue()) is shown
    before = terminal.getvalue()
    read_logs([path])  # nobody has asked
    assert terminal.getvalue() == before
