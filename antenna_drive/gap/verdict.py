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
From fitted candidates to probabilities: every parameter has its price, and 'unknown' is an answer.

A candidate is as probable as exp(-(cost + price) / TEMPERATURE), the cost being half a
chi-square. Probabilities of this kind are right only if the models are; TEMPERATURE is therefore
not one, and it and the other constants here were chosen on trials with an independent machine
(docs/diagnosis.md says on which). 'Unknown' is an absolute test: how much of the best
candidate's residual is still no noise, and how much of the gap is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from antenna_drive.gap.catalogue import Wave
from antenna_drive.gap.search import Candidate
import numpy as np

TEMPERATURE = 4.0
# Price of an effect, of each of its numbers, of a wave whose cycles were searched for.
EFFECT_PRICE = 8.0
PARAMETER_PRICE = 4.0
PULLED_PRICE = 1.5
WAVE_PRICE = 6.0
# The unknown: where an excess of slow residual over noise tips the scales, and how sharply.
EXCESS = 0.10
SHARPNESS = 2.5
# Candidates within so much of the best cannot be told from it.
ALIKE = 14.0
LARGEST_GROUP = 5


@dataclass(frozen=True)
class Ranked:
    """A candidate with what it costs in all and its probability."""

    candidate: Candidate
    score: float
    probability: float


def score(candidate: Candidate) -> float:
    """Return the cost of a candidate with the prices of its effects."""
    price = EFFECT_PRICE * len(candidate.effects)
    # a number that is pulled to nought pays in part by that
    price += sum(PULLED_PRICE if p.spread else PARAMETER_PRICE
                 for form in candidate.forms for p in form.parameters)
    price += WAVE_PRICE * sum(isinstance(form, Wave) for form in candidate.forms)
    return candidate.cost + price


def rank(candidates: Sequence[Candidate], excess: float) -> tuple[list[Ranked], float]:
    """
    Return the candidates by probability, and the probability of something unknown.

    Parameters
    ----------
    candidates : fitted ones, the offsets alone among them
    excess : how much of the best one's residual is no noise, from `excess`

    """
    scores = np.array([score(c) for c in candidates])
    weight = np.exp(-(scores - scores.min()) / TEMPERATURE)
    weight /= weight.sum()
    unknown = 1.0 / (1.0 + math.exp(-SHARPNESS * math.log(max(excess, 1e-6) / EXCESS)))
    unknown = min(unknown, 0.999)
    ranked = [Ranked(c, float(s), float(w) * (1.0 - unknown))
              for c, s, w in zip(candidates, scores, weight, strict=True)]
    return sorted(ranked, key=lambda r: r.score), unknown


def best(candidates: Sequence[Candidate]) -> Candidate:
    """Return the candidate with the least score."""
    return min(candidates, key=score)


def confusable(candidates: Sequence[Candidate]) -> list[list[str]]:
    """
    Return groups of effects that these data cannot tell apart.

    Effects belong together if one in the other's place costs hardly more. A group holds at
    most LARGEST_GROUP, the likeliest of them.
    """
    top = best(candidates)
    limit = score(top) + ALIKE
    groups: list[list[str]] = []
    for effect in top.effects:
        rest = set(top.effects) - {effect}
        others = sorted((score(c), next(iter(set(c.effects) - rest)))
                        for c in candidates
                        if len(c.effects) == len(top.effects) and rest < set(c.effects)
                        and effect not in c.effects and score(c) < limit)
        names = list(dict.fromkeys(name for _, name in others))[:LARGEST_GROUP - 1]
        if names:
            groups.append([effect, *names])
    return groups
