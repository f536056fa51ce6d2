# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tests that may be the next one, with what each is expected to tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import Any

import numpy as np
from simgap.machine.contract import FloatArray
from simgap.next_test.rivals import Rival
from simgap.next_test.separation import Separation

# An effect that does not show at any size is as bad as this many times the best.
_NEVER = 1e3


@dataclass(frozen=True)
class Candidate:
    """
    A test and what it is expected to tell.

    family, test : as the test space has drawn it
    use : share of each limit that it uses, the worst of all rivals
    score : by the criterion; the larger the better
    coarseness : smallest size of each effect of the catalogue that shows, over that in the best
        test that was judged, in the geometric mean; NaN where it was not asked for
    promised : how well it tells the rivals apart to first order
    confirmed : the same with every rival fitted to the readings of the others
    kept : while not confirmed, the share of its promise that counts: as other tests of its family
        have kept theirs
    deviations : of each number of the effects, its standard deviation before and after
    sizes : of each effect, the smallest size that shows, and its unit
    """

    family: str
    test: Any
    use: Mapping[str, float]
    score: float = 0.0
    coarseness: float = math.nan
    promised: Separation | None = None
    confirmed: Separation | None = None
    kept: float = 1.0
    deviations: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sizes: Mapping[str, tuple[float, str]] = field(default_factory=dict)

    @property
    def separation(self) -> Separation | None:
        """Return how well it tells the rivals apart, confirmed if it was."""
        return self.confirmed or self.promised

    @property
    def tightest(self) -> tuple[str, float]:
        """Return the limit that it uses most, and its share."""
        return max(self.use.items(), key=lambda item: item[1], default=('', 0.0))


@dataclass(frozen=True)
class Proposal:
    """
    What was found.

    objective, criterion : what was asked for, and by which rule
    rivals : that were to be told apart
    tests : judged ones that help, the best first; none if no test within the limits helps
    refused : how many drawn tests each limit has cost
    beyond : if no test helps, the best ones beyond the limits
    alike : pairs of rivals that no judged test tells apart, with what no sensor reads in which
        they differ, the greatest difference first
    tried : number of tests that were simulated
    unnamed : where something without a name may act, see `Findings`
    """

    objective: str
    criterion: str
    rivals: Sequence[Rival]
    tests: Sequence[Candidate]
    refused: Mapping[str, int]
    beyond: Sequence[Candidate] = ()
    alike: Sequence[tuple[int, int, Mapping[str, float]]] = ()
    tried: int = 0
    unnamed: Mapping[str, float] = field(default_factory=dict)


def coarseness_of(tests: Sequence[Candidate], weights: FloatArray) -> list[float]:
    """Return for each test the sizes that show, over the least of all, in the geometric mean."""
    if not tests:
        return []
    sizes = np.array([[size for size, _ in test.sizes.values()] for test in tests])
    seen = np.isfinite(sizes).any(axis=0)
    if not seen.any():
        return [1.0] * len(tests)
    shown = sizes[:, seen]
    over = np.minimum(shown / shown.min(axis=0), _NEVER)
    return np.exp(np.average(np.log(over), axis=1, weights=weights[seen])).tolist()


def of_each_family(tests: Sequence[Candidate], most: int) -> list[Candidate]:
    """Return the best tests of every family in turn: rough scores compare no families."""
    best = sorted(tests, key=lambda test: -test.score)
    families: dict[str, list[Candidate]] = {}
    for test in best:
        families.setdefault(test.family, []).append(test)
    rank = {id(test): k for group in families.values() for k, test in enumerate(group)}
    return sorted(best, key=lambda test: rank[id(test)])[:most]
