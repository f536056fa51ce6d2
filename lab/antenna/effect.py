# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A defect of the real antenna: its range of sizes, and how it changes a machine."""

from __future__ import annotations

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
    """
    A number of a defect and its plausible range.

    Attributes
    ----------
    name, unit : 'torque', 'N m'
    low, high : range of the size, both more than 0 unless `spacing` is 'even'
    spacing : 'log', 'even' or 'whole' (whole numbers)
    turned : '' or a random change of the size: 'sign' (negative as likely as positive),
        'inverse' (1 / size as likely as size, for factors)

    """

    name: str
    unit: str
    low: float
    high: float
    spacing: str = 'log'
    turned: str = ''

    def at(self, part: float, random: np.random.Generator) -> float:
        """
        Return the value at `part` of the range, 0 to 1, turned at random.

        Parameters
        ----------
        part
            0 for the smallest size, 1 for the largest
        random
            decides on the sign or the inverse

        """
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
    """
    An effect as the real antenna has it: its name, its numbers and its form.

    Attributes
    ----------
    key : 'component.effect', as the diagnosis names it
    form : the form in this program, for people
    quantities : the first one is the size, the others are drawn uniformly
    change : applies the effect to a machine

    """

    key: str
    form: str
    quantities: tuple[Quantity, ...]
    change: Change

    def draw(self, size: float, random: np.random.Generator) -> dict[str, float]:
        """
        Draw the effect's numbers.

        Parameters
        ----------
        size
            0 for just detectable, 1 for strong
        random
            source of all other numbers

        Returns
        -------
        value of each quantity by name

        """
        return drawn(self.quantities, size, random)


def drawn(quantities: Sequence[Quantity], size: float,
          random: np.random.Generator) -> dict[str, float]:
    """
    Draw numbers of an effect by name, the first of them at a size and the others uniformly.

    Parameters
    ----------
    quantities
        the first one is the size
    size
        0 for just detectable, 1 for strong
    random
        source of all other numbers

    """
    first, *others = quantities
    values = {first.name: first.at(size, random)}
    for quantity in others:
        values[quantity.name] = quantity.at(float(random.uniform()), random)
    return values


def defects(table: Mapping[str, Mapping[str, Any]],
            functions: Mapping[str, Change]) -> dict[str, Defect]:
    """
    Return the effects of a table by key, in its order.

    Parameters
    ----------
    table
        entries by place and name; effects.yaml describes them
    functions
        changes that are more than setting or scaling fields, by key

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
