# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The families of forms: the one that the diagnosis was developed on, and the one to report on."""

from __future__ import annotations

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

    def defect(self, key: str) -> Defect:
        """Return an effect of the catalogue or outside it."""
        return self.catalogue.get(key) or self.outside[key]


FAMILIES = {'a': Family(effects.CATALOGUE, outside.OUTSIDE, wild_programme.SHAPES),
            'b': Family(family_b.CATALOGUE, family_b.OUTSIDE, family_b.SHAPES)}
