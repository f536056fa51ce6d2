# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The numbers that are known only within a tolerance: they are fitted beside any effect."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from simgap.machine.arrays import Point
from simgap.machine.effect import Form, Parameter


class Nuisances(list[Parameter]):
    """
    The nuisances of a machine, and how they share numbers with its effects.

    numbers : the nuisances
    initial_conditions : of some experiments by index, values that are tried out before a fit.
        Gradients do not lead from one side of a gap to the other. Groups are tried one after the
        other, each from the best of those before it: conditions that hardly depend on each other
        need not be tried in all combinations
    """

    def __init__(self, numbers: Iterable[Parameter] = (),
                 initial_conditions: Mapping[int, Sequence[Sequence[Point]]] | None = None,
                 ) -> None:
        super().__init__(numbers)
        self.initial_conditions = initial_conditions or {}

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """
        Return the nuisances that take over what they can of an effect that is removed.

        `point` has the nuisances, `removed` the values of the effect's parameters.
        """
        return dict(point)

    def take_over(self, point: Point, forms: Sequence[Form]) -> tuple[dict[str, float], set[str]]:
        """
        Return a point at which effects alone stand for their numbers, and what is held at zero.

        A nuisance may stand for the very number that an effect changes. Both together are not
        determined, so the nuisance is held at zero, and the effect takes over its value. Of
        several nuisances it takes over what they have in common. By default none is held.
        """
        return dict(point), set()
