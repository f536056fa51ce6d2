# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Logs of tests, as they come from a file or from Python, and the test that a simulation gets.

A simulation takes one step from row to row, so rows that a recorder lost are put back.
"""

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from simgap.errors import UserError
from simgap.inputs.labels import parse_labels, plain_value
from simgap.inputs.limits import SAMPLES
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, nearest, ParameterError
from simgap.logs.bags import REMEDY
from simgap.logs.channel import Channel, IntArray, NANOSECONDS, RecordingError
from simgap.logs.column_map import ImportMap, load_map
from simgap.logs.mapped import read_file
from simgap.logs.table import Text, TIMES
from simgap.logs.tables import open_table
from simgap.logs.text import Cell, LATEST_S, parse_number
from simgap.machine.contract import FloatArray

_LEAST_SAMPLES = 2
# A command is known in a gap where the rates before and after it tell the way across it up to this
# share of its range.
_KNOWN = 0.01


class LogError(UserError):
    """A log cannot be used; the message names file, column and remedy."""


@dataclass(frozen=True)
class Log:
    """
    What was recorded in one test.

    time : of the samples, rising, shape (n,) [s]
    columns : shape (n,) each, as recorded; NaN where there is no sample
    constants, labels : what the tester knows, such as a mass, and what was different: load: A
    """

    name: str
    time: FloatArray
    columns: Mapping[str, FloatArray]
    constants: Mapping[str, float] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    _held: dict[str, FloatArray] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Make arrays; LogError if the time does not rise or a column differs in length."""
        time = np.array(self.time, float)
        if time.ndim != 1 or time.size < _LEAST_SAMPLES or not np.all(np.diff(time) > 0.0):
            raise LogError(f'{self.name}: time: two or more increasing times are needed')
        columns = {name: np.array(values, float) for name, values in self.columns.items()}
        for name, values in columns.items():
            if values.shape != time.shape:
                raise LogError(f'{self.name}: {name}: shape {values.shape} given, allowed is '
                               f'{time.shape}, as the time has')
        object.__setattr__(self, 'time', time)
        object.__setattr__(self, 'columns', columns)
        object.__setattr__(self, '_held', {name: _held(v) for name, v in columns.items()})

    def __getitem__(self, column: str) -> FloatArray:
        """Return a column, shape (n,), the last sample held; LogError if there is none."""
        try:
            return self._held[column]
        except KeyError:
            raise LogError(f'{self.name}: no column {column}{nearest(column, self.columns)}; '
                           f'there are {", ".join(self.columns)}') from None


@dataclass(frozen=True)
class OneTest:
    """
    What a simulation gets of a test.

    log : the test's log, perhaps only its beginning
    push : what enters at each place of the model, shape (n,); zero unless something does
    """

    log: Log
    push: Mapping[str, FloatArray]

    @property
    def name(self) -> str:
        return self.log.name

    @property
    def time(self) -> FloatArray:
        """Return the times of the samples, shape (n,) [s]."""
        return self.log.time

    @property
    def constants(self) -> Mapping[str, float]:
        return self.log.constants

    def __getitem__(self, column: str) -> FloatArray:
        return self.log[column]


def beginning(log: Log, until: float) -> Log:
    """Return a log's samples up to a time after its first [s]."""
    count = max(int(np.searchsorted(log.time, log.time[0] + until, side='right')), _LEAST_SAMPLES)
    if count >= log.time.size:
        return log
    return replace(log, time=log.time[:count], columns={
        name: values[:count] for name, values in log.columns.items()})


def read_log(path: str | Path, import_map: ImportMap | None = None) -> Log:
    """
    Read a log, and NAME.yaml beside it if it is there: constants and labels of the test.

    path : a file of any kind that `tables` knows; without a map, time_s, time or t is the time
    import_map : which column is which, and how it is written
    """
    path = Path(path)
    constants, labels = _sheet(path.with_suffix('.yaml'))
    time, columns, told = (_mapped(path, import_map, constants) if import_map else _plain(path))
    try:
        return Log(path.stem, time, columns, {**told, **constants}, labels)
    except LogError as error:
        raise LogError(f'{path}: {str(error).partition(": ")[2]}') from None


def read_logs(paths: Sequence[str | Path], map_path: str | Path | None = None) -> list[Log]:
    """Read several files with one map; errors of `read_log` and `load_map`, or of equal names."""
    import_map = load_map(map_path) if map_path else None
    logs = [read_log(path, import_map) for path in paths]
    names = [log.name for log in logs]
    for name in names:
        if names.count(name) > 1:
            raise LogError(f'{name}: two files of this name are given; rename one of them')
    return logs


def _plain(path: Path) -> tuple[FloatArray, dict[str, FloatArray], Mapping[str, float]]:
    with open_table(path) as table:
        names = list(table.names)
        if not names:
            raise LogError(f'{path}: no column is read without a map. {REMEDY}')
        if len(set(names)) < len(names):
            raise LogError(f'{path}: {table.start}' + (
                'a column is there twice' if any(names) else
                'the columns have no names; --map says which is which'))
        cells = {name: array('d') for name in names}
        room = SAMPLES.value()
        for line, row in table.rows:
            room -= len(names)
            if room < 0:
                raise RecordingError(f'{path}: {table.counted} {line}: {SAMPLES.exceeded()}')
            for name, given in zip(names, row, strict=True):
                if name not in cells:
                    continue
                try:
                    cells[name].append(_number(given, Cell(path, line, name, table.counted)))
                except RecordingError:
                    if table.is_text:
                        raise
                    del cells[name]  # a column of another kind beside the numbers
    columns = {name: np.array(cells.pop(name)[:table.lengths.get(name)]) for name in list(cells)}
    time = next((name for name in TIMES if name in columns), '')
    if not time:
        raise LogError(f'{path}: no column {" or ".join(TIMES)}; with --map another column '
                       'is the time')
    if np.nanmax(np.abs(columns[time]), initial=0.0) > LATEST_S:
        raise LogError(f'{path}: {time} is beyond {LATEST_S:g} s; a map says in which unit it is')
    return columns.pop(time), columns, table.constants


def _number(given: Text, cell: Cell) -> float:
    """Return the number in a cell; NaN if it is empty."""
    if isinstance(given, list):
        raise cell.refuse('a vector; --map takes numbers out of vectors')
    text = given.strip()
    return parse_number(text, cell) if text else math.nan


def _mapped(path: Path, import_map: ImportMap, constants: Mapping[str, float],
            ) -> tuple[FloatArray, dict[str, FloatArray], Mapping[str, float]]:
    """Read a file with a map; of several clocks one gives the times."""
    file = read_file(path, import_map, constants)
    stamps_of: dict[object, list[IntArray]] = {}
    for name, channel in file.channels.items():
        stamps_of.setdefault(file.clocks[name][0], []).append(channel.time_ns)
    every = {clock: np.unique(np.concatenate(list({id(part): part for part in parts}.values())))
             for clock, parts in stamps_of.items()}
    onto = import_map.time.onto
    if onto and onto not in file.clocks:
        raise LogError(f'{path}: time.onto: the map has no signal {onto}'
                       f'{nearest(onto, file.clocks)}')
    main = file.clocks[onto][0] if onto else max(every, key=lambda clock: len(every[clock]))
    stamps = every[main]
    if len(stamps) < _LEAST_SAMPLES:
        raise LogError(f'{path}: fewer than {_LEAST_SAMPLES} samples')
    columns = {}
    for name, channel in file.channels.items():
        if not len(channel):
            raise LogError(f'{path}: {name}: no sample; take the signal out of the map')
        if channel.time_ns[0] > stamps[-1] or channel.time_ns[-1] < stamps[0]:
            raise LogError(f'{path}: {name}: its time has no part in common with the others; '
                           'clock_offset_s moves a signal, origin: first counts a file from its '
                           'first stamp, and time: {column: log_time} takes one clock for a bag')
        clock, join = file.clocks[name]
        columns[name] = _joined(channel, stamps, 'next' if clock == main else join)
    return stamps / NANOSECONDS, columns, file.constants


def _joined(channel: Channel, stamps: IntArray, join: str) -> FloatArray:
    """Return a channel at the stamps of another clock, NaN where it has no sample there."""
    column = np.full(len(stamps), np.nan)
    if join == 'next':
        place = np.searchsorted(stamps, channel.time_ns)
        column[place[place < len(stamps)]] = channel.values[place < len(stamps)]
        return column
    # each sample counts once, at the nearest stamp, or noise would be in the log many times
    middles = stamps[:-1] + np.diff(stamps) // 2
    nearest = np.unique(np.searchsorted(middles, channel.time_ns))
    inside = (stamps >= channel.time_ns[0]) & (stamps <= channel.time_ns[-1])
    nearest = nearest[inside[nearest]]
    column[nearest] = channel.at(stamps[nearest])
    return column


def _sheet(path: Path) -> tuple[dict[str, float], dict[str, str]]:
    if not path.is_file():
        return {}, {}
    try:
        top = mapping_of('', read_yaml(path), ('constants', 'labels'))
        constants = {name: float(Entry('').check(f'constants.{name}', plain_value(  # type: ignore
            value))) for name, value in mapping_of('constants', top.get('constants', {})).items()}
        return constants, dict(parse_labels('labels', top.get('labels', {})))
    except ParameterError as error:
        raise LogError(f'{path}: {error}') from None


def _held(values: FloatArray) -> FloatArray:
    """Return values with the last one before in the place of each that is missing."""
    there = np.isfinite(values)
    if there.all() or not there.any():
        return values
    last = np.maximum.accumulate(np.where(there, np.arange(values.size), 0))
    return np.where(np.isfinite(values[last]), values[last], values[there][0])


def without_gaps(log: Log, commands: Sequence[str], settles_s: float = 0.0) -> Log:
    """
    Return a log with all its rows, for `machine(..., log=...)`.

    Where rows lack at even times but for jitter, as many as fit are put in, with NaN for readings.
    Commands are interpolated. Where one jumped or turned in a gap, nobody knows when: readings are
    left out from the gap on until the machine has settled. Raises LogError if a column is missing.

    commands : columns that are known between the rows, too, such as a reference
    settles_s : for which readings are left out after an unknown command [s]
    """
    steps = np.diff(log.time)
    counts = np.maximum(np.round(steps / np.median(steps)).astype(int), 1)
    if np.all(counts == 1):
        return log
    rows = np.r_[0, np.cumsum(counts)]
    every = np.arange(rows[-1] + 1)
    time = np.interp(every, rows, log.time)
    columns = {}
    for name, values in log.columns.items():
        columns[name] = np.full(every.size, np.nan)
        columns[name][rows] = values
    unknown = np.zeros(every.size, dtype=bool)
    for name in commands:
        values = log[name]
        columns[name] = np.interp(every, rows, values)
        rates = np.diff(values) / counts
        for k in np.flatnonzero(counts > 1):
            around = [rates[max(k - 1, 0)], rates[min(k + 1, rates.size - 1)]]
            if abs(rates[k] - np.mean(around)) * counts[k] > _KNOWN * np.ptp(values):
                unknown |= (time > log.time[k]) & (time <= log.time[k + 1] + settles_s)
                continue
            across = CubicHermiteSpline(rows[k:k + 2], values[k:k + 2], around)
            lost = every[rows[k] + 1:rows[k + 1]]
            columns[name][lost] = across(lost)
    for name in columns.keys() - set(commands):
        columns[name][unknown] = np.nan
    return replace(log, time=time, columns=columns)
