# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What is in a recording, as a first map: the one with which it was read to see what is in it.

Layout, clocks and units are guesses, from the first rows or messages and from names.
"""

from collections.abc import Iterator, Mapping, Sequence
import json
import math
from pathlib import Path
import re
from typing import Any

import numpy as np
from simgap.logs.bags import BagTable, LOG_TIME
from simgap.logs.channel import Channel, FloatArray, NANOSECONDS, RecordingError
from simgap.logs.column_map import parse_map, UNITS
from simgap.logs.mapped import read_file
from simgap.logs.suspicions import suspicions
from simgap.logs.table import AUTO, Layout, Seen, Table, Text
from simgap.logs.tables import kind_of, open_table
from simgap.logs.text import open_text

_HEAD = 200    # rows from which is guessed
_WIDEST = 64   # arrays with more columns, and fewer rows, lie on their side
_GAP = 3.0     # times the usual step
_TIME_NAME = re.compile(r'\W*(time|timestamp|stamp|zeit|t|sec|seconds|ms|us|ns)(?![a-z])', re.I)
_EPISODE = 'episode_index'  # of LeRobot, whose time starts again with each
_MISSING = ('NaN', 'nan', 'NA', 'N/A', 'n/a', 'null', 'None', '-')
# Units as people write them at the end of a name, in brackets or behind an underscore.
_WRITTEN = {**{unit.replace(' ', '').replace('/', '_'): unit for unit in UNITS if unit != '1'},
            'degrees': 'deg', 'radians': 'rad', 'dps': 'deg/s'}
_WORDS = (('velocit|speed|rate', 'rad/s'), ('torque|effort', 'N m'), ('current|amp', 'A'),
          ('volt', 'V'), ('force', 'N'), ('position|angle|goal|reference|action|state', 'rad'))


def inspected(path: Path) -> dict[str, Any]:
    """Return what is in a recording as plain data; RecordingError if that is no number at all."""
    entries = _text_entries(path) if path.exists() and not kind_of(path) else {}
    with open_table(path, Layout(**entries)) as table:
        groups = list(table.topics()) if isinstance(table, BagTable) else []
        rows = [] if groups else _head(table)
    if groups:
        entries['time'] = {'column': AUTO, 'origin': 'first', 'duplicates': 'first'}
    elif not table.is_text and len(rows) <= _WIDEST < max((len(part) for row in rows for part in (
            row, *row) if not isinstance(part, str)), default=0):
        entries['transposed'] = True
        with open_table(path, Layout(**entries)) as table:
            rows = _head(table)
    if not groups:
        columns = _numbers(table, rows, entries)
        entries.update(_time_entries(path, columns))
        clock = entries['time']['column']
        groups = [Seen('', '', clock, [name for name in columns if name != clock])]
    names = [name for group in groups for name in group.columns]
    if not names:
        raise RecordingError('; '.join([f'{path}: no column of numbers', *(
            group.remark for group in groups)]).rstrip('; '))
    described = _described(entries['time'], groups, _read(path, entries, names))
    return {'recording': str(path), 'entries': entries, 'groups': described}


def _described(time: dict[str, Any], groups: Sequence[Seen],
               read: Mapping[str | int, tuple[str, Channel]]) -> list[dict[str, Any]]:
    """Return each group as plain data, and complete the entries of the time."""
    times = [np.unique(np.concatenate([np.empty(0, np.int64), *(
        read[name][1].time_ns for name in group.columns)])) / NANOSECONDS for group in groups]
    moves = {name for name, (_, channel) in read.items()
             if len(channel) and np.ptp(channel.values) > 0.0} or set(read)
    # of topics that are about as fast, one that tells the time itself
    most = max(stamps.size for stamps in times)
    main = max(range(len(groups)), key=lambda k: (not moves.isdisjoint(
        groups[k].columns), times[k].size > 0.9 * most, groups[k].clock != LOG_TIME))
    time['column'] = groups[main].clock
    if groups[1:]:
        time['onto'] = next(read[name][0] for name in groups[main].columns if name in moves)
    described = []
    for k, (group, stamps) in enumerate(zip(groups, times, strict=True)):
        steps = np.diff(stamps)
        step = float(np.median(steps)) if steps.size else math.nan
        own = {} if group.clock == time['column'] else {'time_column': group.clock}
        if k != main:
            own['join'] = 'linear'
        described.append({
            'topic': group.topic, 'type': group.kind, 'remark': group.remark,
            'samples': stamps.size, 'rate_hz': 1.0 / step,
            'length_s': float(np.ptp(stamps)) if stamps.size else 0.0,
            'gaps_s': [stamps[gap:gap + 2].tolist()
                       for gap in np.flatnonzero(steps > _GAP * step)],
            'signals': {read[name][0]: {**_signal(name, read[name][1], own),
                                        'moves': name in moves} for name in group.columns}})
    return described


def _signal(name: str | int, channel: Channel, own: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entry of a signal in a map, its range, and what looks wrong."""
    found = list(suspicions(channel))
    entry = {'column': name, 'unit': _unit(str(name), channel.values), **own}
    for thing in found:
        entry.update(thing.entries)
    values = channel.values if len(channel) else np.array([math.nan])
    return {'entry': entry, 'least': float(values.min()), 'greatest': float(values.max()),
            'suspicions': [thing.text for thing in found]}


def first_map(found: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a map of all that `inspected` found."""
    yield (f'# {found["recording"]}: delete what you do not need, name the rest as your model '
           'does, and check')
    yield '# each unit: it is guessed from names and numbers'
    yield from (f'{key}: {json.dumps(value)}' for key, value in found['entries'].items())
    yield 'signals:'
    for group in found['groups']:
        kind = f' ({group["type"]})' if group['type'] else ''
        yield f'  # {group["topic"] or "table"}{kind}: ' + (
            group['remark'] or f'{group["samples"]} samples at {group["rate_hz"]:.4g} Hz for '
            f'{group["length_s"]:.6g} s')
        for first, last in group['gaps_s']:
            yield f'  # a gap from {first:.6g} to {last:.6g} s'
        for name, signal in group['signals'].items():
            mark = '' if signal['moves'] else '# '
            yield f'  {mark}{name}: {json.dumps(signal["entry"])}  # ' + (
                'no number' if math.isnan(signal['least']) else
                f'{signal["least"]:.6g} to {signal["greatest"]:.6g}')
            yield from (f'    # {text}' for text in signal['suspicions'])
    if found['groups'][1:]:
        yield '# join: linear moves samples to the nearest stamps of onto; omit it for a command'


def _head(table: Table) -> list[Sequence[Text]]:
    return [row for _, (_, row) in zip(range(_HEAD), table.rows)]


def _text_entries(path: Path) -> dict[str, Any]:
    """Guess how text is laid out, from its first lines."""
    with open_text(path) as stream:
        lines = [line.strip('\r\n') for line in (stream.readline(100_000) for _ in range(_HEAD))]
    entries: dict[str, Any] = {'comment': '#'} if lines[0].startswith('#') else {}
    lines = [line for line in lines if line.strip() and line[0] != entries.get('comment')]
    delimiter = next((c for c in ';\t' if lines and c in lines[0]), ',')
    if delimiter != ',':
        entries['delimiter'] = delimiter
        if any(re.search(r'\d,\d', line) for line in lines):
            entries['decimal'] = ','
    cells = [[cell.strip() for cell in line.split(delimiter)] for line in lines]
    if missing := {*_MISSING} & {cell for row in cells for cell in row}:
        entries['missing'] = sorted(missing)
    is_number = [[_number(cell, entries) is not None for cell in row] for row in cells]
    if len(lines) > 1 and all(not row[0] and len(row) > 3 and all(row[2:]) for row in is_number):
        entries['transposed'], units = True, not any(row[1] for row in is_number)
    else:
        units = [any(row) for row in is_number[:3]] == [False, False, True]
        if is_number and any(is_number[0]):
            entries['header'] = False
    return entries | ({'units_row': True} if units else {})


def _number(text: str, entries: Mapping[str, Any]) -> float | None:
    """Return the number in a cell: NaN where there is none, None for another text."""
    try:
        return float(text.replace(entries.get('decimal', '.'), '.') or 'nan')
    except ValueError:
        return math.nan if text in _MISSING else None


def _numbers(table: Table, rows: Sequence[Sequence[Text]], entries: Mapping[str, Any],
             ) -> dict[str | int, FloatArray]:
    """Return the columns that begin with numbers."""
    columns: dict[str | int, FloatArray] = {}
    for place, name in enumerate(table.names):
        cells = [row[place] for row in rows]
        width = max((len(cell) for cell in cells if isinstance(cell, list)), default=0)
        labels = table.labels.get(name) or range(width)
        for k, label in enumerate(labels) if width else [(0, None)]:
            texts = [''.join(cell[k:k + 1]) if isinstance(cell, list) else cell.strip()
                     for cell in cells]
            numbers = [number for text in texts if (number := _number(text, entries)) is not None]
            if len(numbers) == len(texts) and np.isfinite(numbers).any():
                columns[f'{name}[{label}]' if width else name or place] = np.array(numbers)
    return columns


def _time_entries(path: Path, columns: Mapping[str | int, FloatArray]) -> dict[str, Any]:
    """Return the entries of a map that say which column is the time, and in which unit."""
    rising = [name for name, values in columns.items() if values.size > 1
              and np.isfinite(values).all() and np.mean(np.diff(values) > 0.0) > 0.9]
    if not rising:
        raise RecordingError(f'{path}: ' + (
            'no column rises from row to row, so none can be the time' if columns else
            'no row with a number'))
    clock = min(rising, key=lambda name: not _TIME_NAME.match(str(name)))
    told = re.search(r'(?:^|[\W_])(ns|us|ms)\b', str(clock))
    size = float(np.max(np.abs(columns[clock])))
    unit = told[1] if told else next((unit for unit, least in (
        ('ns', 1e17), ('us', 1e14), ('ms', 1e11)) if size > least), 's')
    return {'time': {'column': clock, 'unit': unit, 'duplicates': 'first'}} | (
        {'where': {_EPISODE: float(columns[_EPISODE][0])}} if _EPISODE in columns else {})


def _read(path: Path, entries: Mapping[str, Any], names: Sequence[str | int],
          ) -> dict[str | int, tuple[str, Channel]]:
    """Read columns as they are written; return them with names of signals."""
    signals: dict[str, str | int] = {}
    for name in names:
        word = re.sub(r'\W+', '_', re.sub(r'\[\w+=', '[', str(name))).strip('_')
        word = word if word[:1].isalpha() else f'column_{word}'
        while word in signals:
            word += '_'
        signals[word] = name
    channels = read_file(path, parse_map({**entries, 'signals': {
        word: {'column': name, 'unit': '1'} for word, name in signals.items()}})).channels
    return {name: (word, channels[word]) for word, name in signals.items()}


def _unit(name: str, values: FloatArray) -> str:
    """Return the unit that a name and the numbers under it suggest, '1' for none."""
    told = re.search(r'[\[( /]([^\[\]()= ]+)[\])]?$', name)
    behind = re.search(r'_([a-zA-Z]+(?:_s)?)$', re.sub(r'[\[(].*', '', name))
    for written in (told, behind):
        if written and (unit := _WRITTEN.get(written[1].replace('/', '_'))):
            return unit
    last = re.sub(r'\[.*?\]', '', name).removesuffix('.data').rpartition('.')[2]
    unit = next((unit for words, unit in _WORDS if re.search(words, last, re.I)), '1')
    greatest = float(np.max(np.abs(values), initial=0.0))
    if unit == 'rad' and greatest > 1.0 and bool(np.all(np.mod(values, 1.0) == 0.0)):
        return '1'  # counts, of which nobody knows how many make a turn
    return 'deg' if unit == 'rad' and greatest > 7.0 else unit
