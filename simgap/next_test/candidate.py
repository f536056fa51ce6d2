# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tests that may be the next one, with what each is expected to tell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import Any

import numpy as np
from simgap.machine.contract import FloatArray
from simgap.next_test.separation import Separation
from simgap.search.rival import Rival

# An effect that does not show at any size is as bad as this many times the best.
_NEVER = 1e3


@dataclass(frozen=True)
class Candidate:
    """A test and what it is expected to tell."""

    family: str  # as drawn from the test space
    test: Any
    use: Mapping[str, float]  # share of each limit that it uses, the worst of all rivals
    score: float = 0.0  # by the criterion; the larger the better
    # smallest sizes that show over those in the best test, geometric mean; NaN if unknown
    coarseness: float = math.nan
    promised: Separation | None = None  # how well it tells the rivals apart to first order
    confirmed: Separation | None = None  # the same with every rival fitted to the others
    kept: float = 1.0  # share of an unconfirmed promise that counts: what its family has kept
    # standard deviation before and after, by number
    deviations: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    # smallest size that shows and its unit, by effect
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
    """What a search for the next test has found."""

    objective: str  # what was asked for
    criterion: str  # by which rule
    rivals: Sequence[Rival]  # to be told apart
    tests: Sequence[Candidate]  # judged ones that help, the best first
    refused: Mapping[str, int]  # how many drawn tests each limit has cost
    beyond: Sequence[Candidate] = ()  # if no test helps, the best ones beyond the limits
    # pairs of rivals that no judged test tells apart, with the unread signals in which they
    # differ, the greatest difference first
    alike: Sequence[tuple[int, int, Mapping[str, float]]] = ()
    tried: int = 0  # number of tests that were simulated
    unnamed: Mapping[str, float] = field(default_factory=dict)  # see `Findings`


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
