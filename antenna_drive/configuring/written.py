# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A configuration as a file that people read: each number with its unit and its source."""

from collections.abc import Iterator
from dataclasses import fields, MISSING
from operator import attrgetter
from pathlib import Path
import textwrap
from typing import Any

from antenna_drive.configuring.derived import derived, kappa, Number, reference
from antenna_drive.configuring.sheet import Sheet
from antenna_drive.parameters.loading import PLACES, SECTIONS
from antenna_drive.parameters.sets import Drive
from antenna_drive.yaml_text import yaml_float
from simgap.inputs.schema import Entry, ParameterError

KEPT = 'kept: as in the reference drive'
_WIDTH = 98


def configuration(sheet: Sheet) -> str:
    """Return a whole configuration as YAML; ParameterError if figures do not go together."""
    found = {(number.section, number.name): number for number in derived(sheet)}
    drive, real = reference(sheet.circuit), kappa(sheet)
    lines = [
        f'# A drive from {Path(sheet.source).name}, by antenna-drive configure.',
        '# Each number has its source:',
        '#   sheet    as given', '#   derived  follows from what was given',
        '#   assumed  a rule of thumb, no figure says it',
        '#   kept     as in the reference drive: look whether it fits yours',
        f'# One article A of this drive is {real:.6g} real amperes. Divide what a clamp meter '
        'shows by',
        f'# it; in a map for antenna-drive import: scale: {1.0 / real:.6g}',
        'base: none']
    for section, kind in SECTIONS.items():
        body = [line for item in fields(kind) if 'entry' in item.metadata
                for line in _entry(found.get((section, item.name)), section, item, drive, sheet)]
        lines += ['', f'{section}:', *body] if body else []
    return '\n'.join(lines) + '\n'


def _entry(number: Number | None, section: str, item: Any, drive: Drive,
           sheet: Sheet) -> Iterator[str]:
    """Yield the lines of an entry; none for an effect that no figure of the sheet is about."""
    if number is None:
        if item.default is not MISSING:
            return
        place = PLACES.get(section, f'motor_1.{section}')
        number = Number(section, item.name, attrgetter(f'{place}.{item.name}')(drive), KEPT)
    entry: Entry = item.metadata['entry']
    given = number.value
    value = [_rounded(one) for one in given] if isinstance(given, tuple) else _rounded(given)
    try:
        entry.check(f'{section}.{item.name}', value)
    except ParameterError as error:
        raise ParameterError(f'{sheet.source}: {error}; it is {number.source}') from None
    shown = (f'[{", ".join(map(yaml_float, value))}]' if isinstance(value, list)
             else yaml_float(value))
    unit = f'"{entry.unit}"' if entry.unit == '1' else entry.unit
    yield f'  {item.name}: {{value: {shown}, unit: {unit},'
    source = f'source: "{number.source}"}}'
    yield from textwrap.wrap(source, _WIDTH, initial_indent='    ', subsequent_indent='      ')


def _rounded(value: float) -> float:
    return float(f'{value:.6g}')
