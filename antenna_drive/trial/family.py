# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The families of forms: the one that the diagnosis was developed on, and the one to report on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from antenna_drive.trial import effects, family_b, outside, wild_programme
from antenna_drive.trial.effect import Defect
from antenna_drive.trial.wild_programme import Shapes


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
