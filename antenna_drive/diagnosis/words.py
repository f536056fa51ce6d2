# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue in plain words: what is said of each effect's number, and what to do next.

The words are in words.yaml. What a number is compared with is looked up in the drive's record.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache, partial
import math
from pathlib import Path
import re
from typing import Any

from antenna_drive.diagnosis.modifiers import AntennaParameter, Modifier, SCALE, SET
from antenna_drive.parameters.records import place_of
from antenna_drive.parameters.sets import Drive, values
import numpy as np
from simgap.machine.contract import Effect
from simgap.machine.machine import Words
from simgap.verdict.spoken import number, quantity, with_interval
import yaml

# A change above this share is said as a multiple.
_MULTIPLE = 10.0


@cache
def _table() -> dict[str, Any]:
    """Return the words of the drive's effects."""
    path = Path(__file__).with_name('words.yaml')
    found: dict[str, Any] = yaml.safe_load(path.read_text(encoding='utf-8'))
    return found


def row_of(component: str, effect: str, number: str = '') -> dict[str, str]:
    """Return the words of a kind of effect, wherever it is, or those of one of its numbers."""
    kind = 'motor' if component == 'motors' else component.removesuffix('_1').removesuffix('_2')
    rows: dict[str, dict[str, str]] = _table()['effects']
    return rows.get(f'{kind}.{effect}.{number}') or rows[f'{kind}.{effect}']


def advice() -> tuple[tuple[tuple[str, ...], str], ...]:
    """Return which tests settle which effects, see `Machine.advice`."""
    return tuple((tuple(row['effects']), row['test']) for row in _table()['advice'])


def ratio(change: float, word: str = ' percent') -> str:
    """Return by how much a number differs, without its sign: 40 percent, 930 times."""
    size = abs(change)
    return f'{number(size)} times' if size >= _MULTIPLE else f'{100.0 * size:.3g}{word}'


def words(effects: Iterable[Effect], drive: Drive,
          record: np.ndarray[Any, np.dtype[Any]]) -> dict[str, Words]:
    """Return what people say of effects, by id; `record`, shape (1,), is that of a test."""
    units = {path: entry.unit for path, entry, _ in values(drive)}
    return {effect.id: partial(_clause, effect, units, record) for effect in effects}


def _clause(effect: Effect, units: Mapping[str, str], record: np.ndarray[Any, np.dtype[Any]],
            numbers: Mapping[str, Any]) -> tuple[str, Sequence[str]]:
    """Return what is said of an effect with some numbers, and its next steps."""
    known = {size.name: size for form in effect.forms for size in form.sizes}
    sizes = {name: item for name, item in numbers.items() if _bare(name) in known}
    name = max(sizes, key=lambda key: abs(sizes[key]['value']))
    size, form, table = known[_bare(name)], effect.forms[0], _table()
    assert isinstance(size, AntennaParameter)
    row = row_of(effect.component, effect.id.partition('.')[2],
                 size.name.removeprefix(f'{effect.id}.'))
    mode = size.name.rpartition('_')[2]
    row = {key: text.format(
        part=table['parts'].get(effect.component, effect.component.replace('_', ' ')),
        mode=f'mode {mode}' if mode.isdigit() else 'all modes', by='{by}')
        for key, text in row.items()}
    text = _sized(row['greater'], row.get('smaller', ''), size.modifier.how,
                  *_configured(size.modifier, units, record),
                  _amplitude(list(sizes.values())) if form.is_wave else sizes[name])
    if form.is_wave:
        text += f', {name.partition("@")[2].partition("[")[0]} cycles a turn'
    else:
        text += ''.join(f', {key.rpartition(".")[2].replace("_", " ")} '
                        f'{quantity(item["value"], item["unit"])}' for key, item in numbers.items()
                        if key not in sizes and item['unit'] != '1')
    if name.endswith(']'):
        text += f', where {name[name.index("[") + 1:-1]}'
    return text, (f'inspect {row["inspect"]}', table['predict'],
                  f'repeat {table["tests"].get(row["repeat"], row["repeat"])}')


def _bare(name: str) -> str:
    """Return the name of a number without its order and its label."""
    return name.partition('@')[0].partition('[')[0]


def _sized(greater: str, smaller: str, how: str, base: float | None, unit: str,
           item: Mapping[str, Any]) -> str:
    """
    Return what is said with the size, beside the configured one if there is one.

    greater, smaller : what is said of a number above zero and below it ('' for the same)
    how : what the number does to the configured one
    base, unit : the configured number, None for none, and its unit
    item : the number as a verdict has it
    """
    values = [item['value'], *item['ci95']]
    if base:
        made = [base * (1.0 + v) if how == SCALE else v if how == SET else base + v
                for v in values]
        change = made[0] / base - 1.0
    else:
        change = values[0]
        made = [-v for v in values] if change < 0.0 and smaller else values
    text = smaller if change < 0.0 and smaller else greater
    if '{by}' in text and not base:
        near, far = sorted(max(v * math.copysign(1.0, change), 0.0) for v in values[1:])
        return text.replace('{by}', f'{ratio(change)} ({ratio(near, "")} to {ratio(far, "")})')
    told = with_interval({'value': made[0], 'ci95': sorted(made[1:]),
                          'unit': unit or item['unit']})
    return (f'{text.replace("{by}", ratio(change))}: {told}'
            + (f' instead of {number(base)}' if base else ''))


def _amplitude(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the amplitude of a wave from its sine and cosine parts, with its interval."""
    size = math.hypot(*(part['value'] for part in parts))
    half = math.hypot(*(0.5 * (part['ci95'][1] - part['ci95'][0]) * part['value'] / size
                        for part in parts)) if size else 0.0
    return {'value': size, 'ci95': [max(size - half, 0.0), size + half], 'unit': parts[0]['unit']}


def _configured(modifier: Modifier, units: Mapping[str, str],
                record: np.ndarray[Any, np.dtype[Any]]) -> tuple[float | None, str]:
    """Return the number that a modifier changes, None where several differ, and its unit."""
    # what is added to a resistance has a field of its own
    fields = [path.removesuffix('_change') for path in modifier.fields]
    if not fields:
        return None, ''
    entries = [re.sub(r'\.\d+$', '', path) for path in fields]
    numbers = record.view(np.float64)
    found = {float(numbers[place_of(record.dtype, path)])
             for path, entry in zip(fields, entries, strict=True)
             if entry.rpartition('.')[2] == entries[0].rpartition('.')[2]}
    return found.pop() if len(found) == 1 else None, units.get(entries[0], '')
