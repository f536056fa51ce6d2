# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tables in files that are no text: .npy, .npz, .mat, Parquet as LeRobot has it, and JSON."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
import itertools
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from simgap.errors import one_line
from simgap.inputs.limits import CSV_LINE, SAMPLES, SIGNALS
from simgap.inputs.plain import from_json, PlainDataError
from simgap.inputs.schema import nearest
from simgap.logs.channel import RecordingError
from simgap.logs.table import cell_of, Layout, Table, Text
from simgap.logs.text import read_text

_BLOCK = 4096   # rows that are turned into cells at a time


def arrays(columns: Mapping[str, Any], layout: Layout, names: list[str] | None = None) -> Table:
    """Return arrays as a table: vectors are columns, shape (n, k) is a column of vectors."""
    columns = {name: values.T if layout.transposed else values
               for name, values in columns.items() if values.dtype.kind in 'biuf'}
    # MATLAB gives a second dimension to every vector
    columns = {name: values.squeeze() if values.ndim == 2 and 1 in values.shape else values
               for name, values in columns.items()}
    columns = {name: values for name, values in columns.items() if values.ndim in (1, 2)}
    lengths = {name: len(values) for name, values in columns.items()}
    return Table(list(columns) if names is None else names, _array_rows(columns), lengths=lengths)


def _array_rows(columns: Mapping[str, Any]) -> Iterator[tuple[int, Sequence[Text]]]:
    count = max(map(len, columns.values()), default=0)
    for first in range(0, count, _BLOCK):
        parts = [[cell_of(value) for value in values[first:first + _BLOCK].tolist()]
                 for values in columns.values()]
        yield from enumerate(itertools.zip_longest(*parts, fillvalue=''), first + 1)


def read_npy(path: Path, layout: Layout) -> Table:
    """Read an array: a table of numbers, or one with named columns."""
    with path.open('rb') as stream:
        _within(SAMPLES.value() - _npy_header(stream)[0])
        stream.seek(0)
        values = np.load(stream, allow_pickle=False)
    if values.dtype.names:
        return arrays({name: values[name] for name in values.dtype.names}, layout)
    table = values[:, np.newaxis] if values.ndim == 1 else values
    table = table.T if layout.transposed else table
    if table.ndim != 2 or table.dtype.kind not in 'biuf':
        raise RecordingError(f'an array of shape {values.shape} and type {values.dtype}, allowed '
                             'is a table of numbers, or an array with named columns')
    columns = {str(j): table[:, j] for j in range(min(table.shape[1], SIGNALS.value() + 1))}
    return arrays(columns, Layout(), [''] * len(columns))


def read_npz(path: Path, layout: Layout) -> Table:
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
        return arrays({name: np.asarray(file[name]) for name in wanted}, layout)


def _npy_header(stream: Any) -> tuple[int, Any]:
    """Return how many numbers an array holds, and their type, before anything is unpacked."""
    read = (np.lib.format.read_array_header_1_0 if np.lib.format.read_magic(stream) == (1, 0)
            else np.lib.format.read_array_header_2_0)
    shape, _, kind = read(stream)
    return int(np.prod(shape, dtype=object)) * max(1, len(kind.names or ())), kind


def _within(room: int) -> None:
    if room < 0:
        raise RecordingError(SAMPLES.exceeded())


def read_parquet(path: Path, layout: Layout) -> Table:
    """Read the columns by name; with those of LeRobot come the labels of its vectors."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise RecordingError('needs pyarrow: pip install pyarrow') from None
    try:
        file = parquet.ParquetFile(path)
        # what it says of single columns, Arrow reads without a check that a program survives
        _within(SAMPLES.value() - file.metadata.num_rows * file.metadata.num_columns)
        return Table(file.schema_arrow.names, _parquet_rows(file, pyarrow), labels=_lerobot(path))
    except pyarrow.ArrowException as error:
        raise RecordingError(f'no Parquet, {one_line(error)}') from None


def _lerobot(path: Path) -> dict[str, Sequence[str]]:
    """Return what LeRobot calls the numbers of its vectors: in meta/info.json, above the data."""
    # data/chunk-000/file-000.parquet lies in the folder that has it
    told = next((file for folder in path.absolute().parents[:3]
                 if (file := folder / 'meta' / 'info.json').is_file()), None)
    labels: dict[str, Sequence[str]] = {}
    for name, feature in (from_json(read_text(told))['features'] if told else {}).items():
        names = feature.get('names')
        while isinstance(names, dict):  # by kind: {motors: [...]}
            names = next(iter(names.values()), None)
        if isinstance(names, list):
            labels[name] = list(map(str, names))
    return labels


def _parquet_rows(file: Any, pyarrow: Any) -> Iterator[tuple[int, Sequence[Text]]]:
    first = 1
    try:
        for batch in file.iter_batches(_BLOCK, use_threads=False):
            columns = []
            for column in batch.columns:
                if pyarrow.types.is_timestamp(column.type):
                    # Python's dates know microseconds
                    column = column.cast(pyarrow.timestamp('us', column.type.tz), safe=False)
                columns.append([cell_of(value) for value in column.to_pylist()])
            yield from enumerate(zip(*columns, strict=True), first)
            first += batch.num_rows
    except pyarrow.ArrowException as error:
        raise RecordingError(f'after row {first - 1}: no Parquet, {one_line(error)}') from None


def read_json(path: Path, layout: Layout) -> Table:
    """Read columns or records, which may lie under keys with constants beside these."""
    tree, constants = from_json(read_text(path)), dict[str, float]()
    keys = layout.records.split('.') if layout.records else []
    while isinstance(tree, dict):
        constants.update((name, float(part)) for name, part in tree.items()
                         if type(part) in (int, float))
        inner = [name for name, part in tree.items() if isinstance(part, (dict, list))]
        is_table = any(isinstance(part, list) and part and not isinstance(part[0], dict)
                       for part in tree.values())
        if not keys and (is_table or len(inner) != 1):
            break
        key = keys.pop(0) if keys else inner[0]
        if key not in inner:
            raise RecordingError(f'records: there is no table {one_line(key)}'
                                 f'{nearest(key, inner)}; there are {", ".join(inner)}')
        tree = tree[key]
    if isinstance(tree, list):
        return replace(_records(enumerate(tree, 1), 'record'), constants=constants)
    if not isinstance(tree, dict):
        raise RecordingError('a single value, allowed are columns in a mapping, or records')
    columns = {name: values for name, values in tree.items() if isinstance(values, list)}
    cells = itertools.zip_longest(*(map(cell_of, values) for values in columns.values()),
                                  fillvalue='')
    return Table(list(columns), enumerate(cells, 1), constants=constants,
                 lengths={name: len(values) for name, values in columns.items()})


def read_json_lines(path: Path, layout: Layout) -> Table:
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
    def fields(place: int, record: object) -> dict[str, Any]:
        if not isinstance(record, dict):
            raise RecordingError(f'{counted} {place}: no mapping from columns to values')
        return _flat(record)

    number, first = next(items, (1, {}))
    names = list(fields(number, first))
    rows = ((place, [cell_of(value) for value in map(fields(place, record).get, names)])
            for place, record in itertools.chain([(number, first)], items))
    return Table(names, rows, counted=counted)


def _flat(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record with the fields of its inner records as `outer.inner`."""
    return {name if inner is None else f'{name}.{inner}': value for name, part in record.items()
            for inner, value in (_flat(part) if isinstance(part, dict) else {None: part}).items()}
