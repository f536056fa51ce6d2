# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The families of cases: the one that the diagnosis was developed on, and those to report on.

Family b has other forms of effects, outsiders and programmes. Family c has those of a, and what
every day and every logger bring (`days`).
"""

from collections.abc import Mapping
from typing import NamedTuple

from lab.antenna import effects, family_b, outside, wild_programme
from lab.antenna.effect import Defect
from lab.antenna.wild_programme import Shapes


class Family(NamedTuple):
    """Forms of effects, outsiders and programmes; `shapes` are those of a wild case."""

    catalogue: Mapping[str, Defect]
    outside: Mapping[str, Defect]
    shapes: Shapes
    days: bool = False

    def defect(self, key: str) -> Defect:
        """Return an effect of the catalogue or outside it."""
        return self.catalogue.get(key) or self.outside[key]


FAMILIES = {'a': Family(effects.CATALOGUE, outside.OUTSIDE, wild_programme.SHAPES),
            'c': Family(effects.CATALOGUE, outside.OUTSIDE, wild_programme.SHAPES, days=True),
            'b': Family(family_b.CATALOGUE, family_b.OUTSIDE, family_b.SHAPES)}
