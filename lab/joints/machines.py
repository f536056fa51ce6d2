# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The joint and the axis as tables: nominal numbers, tolerances, effects and what is outside.

An effect sets numbers of the mechanism (`sets`) or multiplies them by its number `factor`
(`scales`). `stated` says how a verdict states its size, as in sizes.yaml.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from lab.antenna.effect import drawn, Parameters, Quantity
from lab.antenna.table import read_table
import numpy as np

MACHINES = ('joint', 'axis')
# The same in MuJoCo, by name the table in the room of the benchmark.
BENCHMARK = {'mujoco_joint': 'joint', 'mujoco_axis': 'axis'}
MODELS = Path(__file__).with_name('models')
ROOM = Path(__file__).parents[1] / 'benchmark'
# Numbers that are a part of the test, and become a time.
_SHARES_OF_A_TEST = ('brake_from', 'brake_until', 'slip_at')


@dataclass(frozen=True)
class Cause:
    """An effect as a machine has it."""

    key: str                            # 'component.effect', as the diagnosis names it
    quantities: tuple[Quantity, ...]    # the first is the size, the others are drawn uniformly
    sets: Mapping[str, str]             # by number of the mechanism, the quantity it becomes
    scales: tuple[str, ...]             # numbers that are multiplied by the quantity 'factor'
    stated: Mapping[str, str]           # how a verdict states the size; empty if not comparable

    def draw(self, size: float, random: np.random.Generator) -> dict[str, float]:
        """Draw the effect's numbers; a size of 0 is just detectable, 1 is strong."""
        return drawn(self.quantities, size, random)

    def changed(self, numbers: Mapping[str, float], values: Parameters,
                duration: float) -> dict[str, float]:
        """Return a mechanism's numbers with the effect's values, in a test of `duration` [s]."""
        found = dict(numbers)
        for name, quantity in self.sets.items():
            found[name] = values[quantity] * (duration if name in _SHARES_OF_A_TEST else 1.0)
        for name in self.scales:
            found[name] *= values['factor']
        return found


@dataclass(frozen=True)
class Kind:
    """A kind of machine."""

    name: str                       # one of MACHINES or BENCHMARK
    table: Mapping[str, Any]        # its YAML file
    catalogue: Mapping[str, Cause]  # its effects by key
    outside: Mapping[str, Cause]    # what its model lacks by key

    @property
    def columns(self) -> Mapping[str, str]:
        """Return the columns of a recording for reference, position and current."""
        found: Mapping[str, str] = self.table['columns']
        return found

    @property
    def readings(self) -> tuple[str, ...]:
        """Return the names of what is read, such as 'position'."""
        return tuple(name for name in self.columns if name != 'reference')

    @property
    def formats(self) -> dict[str, str]:
        """Return how the columns of a recording are written."""
        return {'time_s': '%.6f', **{
            self.columns[name]: text for name, text in self.table['formats'].items()}}

    @property
    def model(self) -> str:
        """Return the model that diagnoses it, as `antenna-drive diagnose --model` takes it."""
        if self.name in BENCHMARK:
            return f'{ROOM / "models.py"}:{BENCHMARK[self.name]}'
        return f'{MODELS / self.name}.py:machine'

    def cause(self, key: str) -> Cause:
        """Return an effect of the catalogue or outside it."""
        return self.catalogue.get(key) or self.outside[key]

    def deviations(self, random: np.random.Generator) -> dict[str, float]:
        """Draw by how much each number is off, as a factor within its tolerance."""
        return {name: 1.0 + float(random.uniform(-share, share))
                for name, share in self.table['tolerances'].items()}

    def numbers(self, deviations: Mapping[str, float], effects: list[dict[str, Any]],
                duration: float) -> dict[str, float]:
        """
        Return the numbers of one machine in one test of `duration` [s].

        Deviations are factors by the numbers that are off; `effects` are those of a truth.
        """
        numbers = {name: value * deviations.get(name, 1.0)
                   for name, value in self.table['nominal'].items()}
        for entry in effects:
            numbers = self.cause(entry['id']).changed(numbers, entry['parameters'], duration)
        return {name: float(value) for name, value in numbers.items()}


@cache
def kind_of(name: str) -> Kind:
    """Return a kind of machine by its name, one of MACHINES or BENCHMARK."""
    place = BENCHMARK.get(name)
    table = read_table(f'{place or name}.yaml',
                       Path(__file__).parent if place is None else ROOM)
    return Kind(name, table, _causes(table['effects']), _causes(table['outside']))


def _causes(table: Mapping[str, Any]) -> dict[str, Cause]:
    return {key: Cause(
        key, tuple(Quantity(name, **limits) for name, limits in entry['sizes'].items()),
        entry.get('sets', {}), tuple(entry.get('scales', ())), entry.get('stated', {}))
        for key, entry in table.items()}
