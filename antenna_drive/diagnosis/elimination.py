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
"""
Whether each effect of a verdict is needed: the fits without it are taken to their end.

What keeps a fit of a hundred offsets from its end looks like a weak effect: in a trial, an antenna
without any was named one whose fit had merely come further, and a single effect was given a
partner of size nought.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from antenna_drive.diagnosis import verdict
from antenna_drive.diagnosis.search import Candidate

# An effect that gains less than this share of the cost is doubted.
DOUBTFUL = 0.25


class Fits(Protocol):
    """What takes fits to their end, see `Search`."""

    def polished(self, candidate: Candidate) -> Candidate:
        """Go on with a fit."""

    def without(self, candidate: Candidate, effect: str) -> Candidate:
        """Return a candidate without one of its effects, fitted to its end."""


def doubted(fits: Fits, candidates: Sequence[Candidate]) -> tuple[list[Candidate], Candidate]:
    """
    Doubt each effect of the best candidate, until the best has none that is in doubt.

    Parameters
    ----------
    fits
        the search that the candidates come from
    candidates
        fitted ones, the offsets alone first

    Returns
    -------
    the candidates in their order, and the best of them, fitted to its end

    """
    found = {frozenset(c.effects): c for c in candidates}
    tried: set[frozenset[str]] = set()
    best = verdict.best(candidates)
    polished = fits.polished(best)
    while True:
        rests = {effect: frozenset(best.effects) - {effect} for effect in best.effects}
        # what is not among the candidates any more was far behind
        doubts = {effect: rest for effect, rest in rests.items() if rest in found
                  and rest not in tried and found[rest].cost < (1.0 + DOUBTFUL) * best.cost}
        if not doubts:
            return list(found.values()), polished
        for effect, rest in doubts.items():
            tried.add(rest)
            simpler = fits.without(polished, effect)
            # all others are as far from their ends as the best was
            behind = simpler.cost + best.cost - polished.cost
            if behind < found[rest].cost:
                found[rest] = replace(simpler, state=replace(simpler.state, cost=behind))
        leading = verdict.best(list(found.values()))
        if leading is not best:
            best, polished = leading, fits.polished(leading)
