# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue in plain words: what is said of each effect's number, and what to do next.

The words are in words.yaml. What a number is compared with is looked up in the drive's record.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
import math
from pathlib import Path
from typing import Any

from antenna_drive.diagnosis.modifiers import AntennaParameter, SCALE, SET
from antenna_drive.parameters.records import place_of
from antenna_drive.parameters.sets import Drive, values
import numpy as np
from simgap.machine.contract import Effect
from simgap.machine.machine import Words
from simgap.verdict.spoken import number, quantity, with_interval
import yaml

# What a number is added to, where that is not the field that holds the addition.
_ADDED_TO = {'armature.resistance_change': 'armature.resistance'}
# A change above this share is said as a multiple.
_MULTIPLE = 10.0


@dataclass(frozen=True)
class _Said:
    """What is said of a number: above zero, below it ('' for the same), and what to do next."""

    greater: str
    smaller: str
    configured: float | None  # what the number changes; None for nothing
    unit: str  # of `configured`
    how: str  # what the number does to it
    then: tuple[str, ...]

    def sized(self, item: Mapping[str, Any]) -> str:
        """Return what is said with the size, beside the configured one if there is one."""
        base, values = self.configured, [item['value'], *item['ci95']]
        if base:
            made = [base * (1.0 + v) if self.how == SCALE else v if self.how == SET else base + v
                    for v in values]
            change = made[0] / base - 1.0
        else:
            change = values[0]
            made = [-v for v in values] if change < 0.0 and self.smaller else values
        text = self.smaller if change < 0.0 and self.smaller else self.greater
        if '{by}' in text and not base:
            near, far = sorted(max(v * math.copysign(1.0, change), 0.0) for v in values[1:])
            return text.replace('{by}', f'{ratio(change)} ({ratio(near, "")} to {ratio(far, "")})')
        told = with_interval({'value': made[0], 'ci95': sorted(made[1:]),
                              'unit': self.unit or item['unit']})
        return (f'{text.replace("{by}", ratio(change))}: {told}'
                + (f' instead of {number(base)}' if base else ''))


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


def ratio(change: float, word: str = ' percent') -> str:
    """Return by how much a number differs, without its sign: 40 percent, 930 times."""
    size = abs(change)
    return f'{number(size)} times' if size >= _MULTIPLE else f'{100.0 * size:.3g}{word}'


def words(effects: Iterable[Effect], drive: Drive,
          record: np.ndarray[Any, np.dtype[Any]]) -> dict[str, Words]:
    """
    Return what people say of effects, by id.

    effects : of the catalogue
    drive : the configuration, which knows units
    record : of the drive in a test, shape (1,), which has the configured numbers
    """
    units = {path: entry.unit for path, entry, _ in values(drive)}
    found: dict[str, Words] = {}
    for effect in effects:
        sizes = {}
        for item in (size for form in effect.forms for size in form.sizes):
            assert isinstance(item, AntennaParameter)
            name = item.name.removeprefix(f'{effect.id}.')
            sizes[item.name] = _said(effect, name, item, units, record)
        found[effect.id] = partial(_clause, effect, sizes)
    return found


def _clause(effect: Effect, said: Mapping[str, _Said],
            numbers: Mapping[str, Any]) -> tuple[str, Sequence[str]]:
    """Return what is said of an effect with some numbers, and its next steps."""
    sizes = {name: item for name, item in numbers.items() if _bare(name) in said}
    name = max(sizes, key=lambda key: abs(sizes[key]['value']))
    words, form = said[_bare(name)], effect.forms[0]
    text = words.sized(_amplitude(list(sizes.values())) if form.is_wave else sizes[name])
    if form.is_wave:
        text += f', {name.partition("@")[2].partition("[")[0]} cycles a turn'
    else:
        if form.is_course:
            text = text.replace(': ', ': up to ', 1)
        text += ''.join(f', {key.rpartition(".")[2].replace("_", " ")} '
                        f'{quantity(item["value"], item["unit"])}' for key, item in numbers.items()
                        if key not in sizes and item['unit'] != '1')
    return text + (f', where {name[name.index("[") + 1:-1]}' if name.endswith(']') else ''
                   ), words.then


def _bare(name: str) -> str:
    """Return the name of a number without its order and its label."""
    return name.partition('@')[0].partition('[')[0]


def _amplitude(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the amplitude of a wave from its sine and cosine parts, with its interval."""
    size = math.hypot(*(part['value'] for part in parts))
    half = math.hypot(*(0.5 * (part['ci95'][1] - part['ci95'][0]) * part['value'] / size
                        for part in parts)) if size else 0.0
    return {'value': size, 'ci95': [max(size - half, 0.0), size + half],
            'unit': parts[0]['unit']}


def _said(effect: Effect, name: str, item: AntennaParameter, units: Mapping[str, str],
          record: np.ndarray[Any, np.dtype[Any]]) -> _Said:
    table, row = _table(), row_of(effect.component, effect.id.partition('.')[2], name)
    number = name.rpartition('_')[2]
    part = table['parts'].get(effect.component, effect.component.replace('_', ' '))
    said = {'part': part, 'mode': f'mode {number}' if number.isdigit() else 'all modes',
            'by': '{by}'}
    fields = [_changed(path) for path in getattr(item.modifier, 'fields', ())]
    base = _in_common(fields, record)
    return _Said(row['greater'].format(**said), row.get('smaller', '').format(**said), base,
                 units.get(_entry(fields[0]), '') if fields else '', item.modifier.how,
                 (f'inspect {row["inspect"].format(**said)}', table['predict'],
                  f'repeat {table["tests"].get(row["repeat"], row["repeat"])}'))


def _changed(path: str) -> str:
    unit, _, field = path.partition('.')
    return f'{unit}.{_ADDED_TO.get(field, field)}'


def _entry(path: str) -> str:
    """Return the entry of the configuration that a field is, or is one of the list of."""
    return path.rpartition('.')[0] if path.rpartition('.')[2].isdigit() else path


def _in_common(fields: list[str], record: np.ndarray[Any, np.dtype[Any]]) -> float | None:
    """Return the number that the first field and those of its name have; None if they differ."""
    numbers = record.view(np.float64)
    same = [path for path in fields
            if _entry(path).rpartition('.')[2] == _entry(fields[0]).rpartition('.')[2]]
    found = {float(numbers[place_of(record.dtype, path)]) for path in same}
    return found.pop() if len(found) == 1 else None
