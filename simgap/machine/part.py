# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A part of the tests of a machine; what is not among them cannot reach a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math
from types import MappingProxyType

from simgap.machine.contract import (
    Experiment, FloatArray, Machine, Nuisances, Parameter, Point, TimeScales,
)


class Part(Machine):
    """A machine in some of its experiments; what is not among them cannot reach a fit."""

    def __init__(self, machine: Machine, chosen: Sequence[int],
                 experiments: Sequence[Experiment] | None = None,
                 held: Point = MappingProxyType({})) -> None:
        tried = machine.nuisances.initial_conditions
        super().__init__(experiments or [machine.experiments[k] for k in chosen], Nuisances(
            (), {i: tried[k] for i, k in enumerate(chosen) if k in tried}))
        self.chosen = tuple(chosen)
        self._machine = machine
        self._held = held

    def holding(self, held: Point) -> Part:
        """Return the same part with the values of some parameters held."""
        return Part(self._machine, self.chosen, self.experiments, held)

    @property
    def time_scales(self) -> TimeScales:
        return self._machine.time_scales

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        wanted = [(i, k) for i, one in enumerate(only or [None] * len(points))
                  for k in (range(len(self.chosen)) if one is None else (one,))]
        found = self._machine.simulate([{**self._held, **points[i]} for i, _ in wanted],
                                       [self.chosen[k] for _, k in wanted], until)
        rows: list[list[FloatArray | None]] = [[None] * len(self.chosen) for _ in points]
        for (i, k), row in zip(wanted, found, strict=True):
            rows[i][k] = row[self.chosen[k]]
        return rows

    def linear_response(self, name: str, experiment: int) -> FloatArray | None:
        return self._machine.linear_response(name, self.chosen[experiment])

    def low_fidelity(self) -> Machine:
        faster = self._machine.low_fidelity()
        return self if faster is self._machine else Part(
            faster, self.chosen, self.experiments, self._held)

    def parameters(self, of: Sequence[Parameter]) -> tuple[Parameter, ...]:
        """Return the parameters that act on these experiments, with the indices of this part."""
        return tuple(p if p.experiment is None else
                     replace(p, experiment=self.chosen.index(p.experiment))
                     for p in of if p.experiment is None or p.experiment in self.chosen)
