# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The numbers that are known only within a tolerance: they are fitted beside any effect."""

from collections.abc import Iterable, Mapping, Sequence

from simgap.machine.arrays import Point
from simgap.machine.effect import Parameter


class Nuisances(list[Parameter]):
    """
    The nuisances of a machine, and how they share numbers with its effects.

    `initial_conditions` has values, by experiment, to try out before a fit, because gradients do
    not lead across a gap. Each group is tried from the best of those before it.
    """

    def __init__(self, numbers: Iterable[Parameter] = (),
                 initial_conditions: Mapping[int, Sequence[Sequence[Point]]] | None = None,
                 ) -> None:
        super().__init__(numbers)
        self.initial_conditions = initial_conditions or {}

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """Return the nuisances of `point` that take over what they can of `removed` values."""
        return dict(point)
