# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A defect of the real antenna: its range of sizes, and how it changes a machine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

from lab.antenna.machine import Records
import numpy as np

Parameters = Mapping[str, float]
Change = Callable[[Records, Parameters], None]


@dataclass(frozen=True)
class Quantity:
    """A number of a defect and its plausible range."""

    name: str
    unit: str               # such as 'N m'
    low: float
    high: float             # both bounds are more than 0 unless `spacing` is 'even'
    spacing: str = 'log'    # 'log', 'even' or 'whole' (whole numbers)
    turned: str = ''        # at random: '', 'sign' (+ or -), 'inverse' (1 / size, for factors)

    def at(self, part: float, random: np.random.Generator) -> float:
        """Return the value at `part` of the range, 0 to 1, `turned` at random."""
        if self.spacing == 'log':
            value = math.exp((1.0 - part) * math.log(self.low) + part * math.log(self.high))
        elif self.spacing == 'even':
            value = (1.0 - part) * self.low + part * self.high
        else:
            value = float(math.floor(self.low + part * (self.high - self.low) + 0.5))
        turn = bool(random.integers(2))
        if self.turned == 'sign' and turn:
            return -value
        if self.turned == 'inverse' and turn:
            return 1.0 / value
        return value


@dataclass(frozen=True)
class Defect:
    """An effect as the real antenna has it: its name, its numbers and its form."""

    key: str                            # 'component.effect', as the diagnosis names it
    form: str                           # in this program, for people
    quantities: tuple[Quantity, ...]    # the first is the size, the others are drawn uniformly
    change: Change                      # applies the effect to a machine

    def draw(self, size: float, random: np.random.Generator) -> dict[str, float]:
        """Draw the effect's numbers by name at a size from 0 (just detectable) to 1 (strong)."""
        return drawn(self.quantities, size, random)


def drawn(quantities: Sequence[Quantity], size: float,
          random: np.random.Generator) -> dict[str, float]:
    """Draw numbers by name: the first at `size`, from 0 to 1, the others uniformly."""
    first, *others = quantities
    values = {first.name: first.at(size, random)}
    for quantity in others:
        values[quantity.name] = quantity.at(float(random.uniform()), random)
    return values


def defects(table: Mapping[str, Mapping[str, Any]],
            functions: Mapping[str, Change]) -> dict[str, Defect]:
    """
    Return the effects of a table by key, in its order; effects.yaml describes its entries.

    `functions` are the changes that are more than setting or scaling fields, by key.
    """
    found = {}
    for place, entries in table.items():
        for name, entry in entries.items():
            key = f'{place}.{name}'
            quantities = tuple(Quantity(quantity, **limits)
                               for quantity, limits in entry['sizes'].items())
            found[key] = Defect(key, entry['form'], quantities,
                                functions.get(key) or _change(place, entry))
    return found


def _change(place: str, entry: Mapping[str, Any]) -> Change:
    """Return the change that an entry describes: fields to set, fields to scale."""
    def change(machine: Records, values: Parameters) -> None:
        motors = _motors(place, values)
        for path, quantity in entry.get('sets', {}).items():
            _field(machine, path, motors)[...] = values[quantity]
        for path in entry.get('scales', ()):
            _field(machine, path, motors)[...] *= values['factor']
    return change


def _motors(place: str, values: Parameters) -> slice:
    """Return which motors an effect changes: that of its place or of its numbers, or both."""
    number = place.rpartition('_')[2]
    if 'motor' in values:
        which = int(values['motor'])
    elif number.isdigit():
        which = int(number)
    else:
        return slice(None)
    return slice(which - 1, which)


def _field(machine: Records, path: str, motors: slice) -> Any:
    record, field = path.split('.')
    column = getattr(machine, record)[field]
    return column[motors] if record == 'motors' else column
