# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tests that may be the next one, with what each is expected to tell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import Any

from simgap.next_test.separation import Separation
from simgap.search.rival import Rival


@dataclass(frozen=True)
class Candidate:
    """A test and what it is expected to tell."""

    family: str  # as drawn from the test space
    test: Any
    use: Mapping[str, float]  # share of each limit that it uses, the worst of all rivals
    score: float = 0.0  # by the criterion; the larger the better
    # smallest sizes that show over those in the best test, geometric mean; NaN if unknown
    coarseness: float = math.nan
    separation: Separation | None = None  # how well it tells the rivals apart
    # smallest size that shows and its unit, by effect
    sizes: Mapping[str, tuple[float, str]] = field(default_factory=dict)

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
