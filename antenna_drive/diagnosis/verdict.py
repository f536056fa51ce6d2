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

from antenna_drive.diagnosis.search import Candidate
import numpy as np

TEMPERATURE = 8.0
# No model has quite the machine's form: what an effect gains is no gap while it is less than such
# a share of the noise.
DETECTABLE = 0.02
# No form of an effect is quite the machine's: a second effect must do more than mend the first,
# and pays so much, and such a share of what the first explains.
SECOND_PRICE = 60.0
SECOND_SHARE = 0.015
# The same effect in two places has one form: the second place mends no form, only the size.
TWIN_SHARE = 0.005
# The unknown: how far the slow residual is above noise, and the share of the gap that is left,
# each as a logarithm against the value that tips the scales.
EXCESS, LEFT = 1.0, 0.06
EXCESS_WEIGHT, LEFT_WEIGHT = 1.6, 1.6
# A sensor may be noisier than its sheet says, but not so many times in variance; what is louder
# and was as loud before any effect was added is no noise. Each again as a logarithm.
NOISIER, NOISIER_WEIGHT = 5.0, 4.0
REMAINS, REMAINS_WEIGHT = 0.3, 3.0
# An effect of values that are strange for it is another one that only looks like it.
STRANGE_WEIGHT = 6.0
# An effect that explains less than this where it was not fitted is none.
EXPLAINED, EXPLAINED_WEIGHT = 0.4, 12.0
# But what leaves nothing but noise in every test has not failed: without one of the tests its
# values may not be determined.
NOISE, NOISE_WEIGHT = 0.3, 4.0
# No diagnosis is surer than trials have shown this one to be: so often something outside the
# catalogue was at work where every test was passed, and only so often where one failed.
LEAST, MOST = 0.05, 0.88
# Candidates within so much of the best cannot be told from it.
ALIKE = 14.0
LARGEST_GROUP = 5


@dataclass(frozen=True)
class Ranked:
    """A candidate with what it costs in all and its probability."""

    candidate: Candidate
    score: float
    probability: float


@dataclass(frozen=True)
class Prices:
    """
    What effects cost beside the prices of their numbers.

    Attributes
    ----------
    gap : what the best single effect gains over the offsets alone
    noise : the least cost that any candidate reaches

    """

    gap: float
    noise: float

    @classmethod
    def among(cls, candidates: Sequence[Candidate]) -> Prices:
        """Return the prices among these candidates, the offsets alone being one of them."""
        none = min(c.cost for c in candidates if not c.effects)
        single = min((c.cost for c in candidates if len(c.effects) == 1), default=none)
        return cls(max(none - single, 0.0), min(c.cost for c in candidates))

    def score(self, candidate: Candidate) -> float:
        """Return the cost of a candidate with all prices."""
        count = len(candidate.effects)
        total = candidate.priced
        if count:
            total += DETECTABLE * self.noise
        if count > 1:
            twins = len({effect.partition('.')[2] for effect in candidate.effects}) < count
            total += (count - 1) * (
                SECOND_PRICE + (TWIN_SHARE if twins else SECOND_SHARE) * self.gap)
        return total


@dataclass(frozen=True)
class Remains:
    """
    What the best candidate leaves.

    Attributes
    ----------
    excess : slow residual, over white noise, 0 if it is noise
    left : share of the gap, 0 to 1
    fast : variance of the fast part of the loudest signal, in that of its sensor's noise
    fast_left : share of that signal's fast part that was there before any effect was added
    strangeness : of the effects' values, see `Form.strangeness`
    explained : upper end of the interval of what its effects explain of a test that they were not
        fitted to; None without effects
    loudest : signal whose fast part is the loudest

    """

    excess: float
    left: float
    fast: float = 1.0
    fast_left: float = 1.0
    strangeness: float = 0.0
    explained: float | None = None
    loudest: str = ''


def unknown_probability(remains: Remains) -> float:
    """Return how probable it is that something outside the catalogue is at work."""
    slow = _logistic(EXCESS_WEIGHT * _log(remains.excess / EXCESS)
                     + LEFT_WEIGHT * _log(remains.left / LEFT))
    fast = (_logistic(NOISIER_WEIGHT * _log(remains.fast / NOISIER))
            * _logistic(REMAINS_WEIGHT * _log(remains.fast_left / REMAINS)))
    strange = _logistic(STRANGE_WEIGHT * _log(remains.strangeness))
    fails = 0.0 if remains.explained is None else _logistic(
        EXPLAINED_WEIGHT * (EXPLAINED - remains.explained)) * _logistic(
        NOISE_WEIGHT * _log(remains.excess / NOISE))
    passed = (1.0 - slow) * (1.0 - fast) * (1.0 - strange) * (1.0 - fails)
    return MOST - (MOST - LEAST) * passed


def _log(ratio: float) -> float:
    return math.log(max(ratio, 1e-3))


def _logistic(logit: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(max(logit, -8.0), 8.0)))


def rank(candidates: Sequence[Candidate], unknown: float) -> list[Ranked]:
    """
    Return the candidates by probability.

    Parameters
    ----------
    candidates
        fitted ones, the offsets alone among them
    unknown
        probability of something else, from `unknown_probability`

    """
    prices = Prices.among(candidates)
    scores = np.array([prices.score(c) for c in candidates])
    weight = np.exp(-(scores - scores.min()) / TEMPERATURE)
    weight /= weight.sum()
    ranked = [Ranked(c, float(s), float(w) * (1.0 - unknown))
              for c, s, w in zip(candidates, scores, weight, strict=True)]
    return sorted(ranked, key=lambda r: r.score)


def best(candidates: Sequence[Candidate]) -> Candidate:
    """Return the candidate with the least score."""
    return min(candidates, key=Prices.among(candidates).score)


def confusable(candidates: Sequence[Candidate]) -> list[list[str]]:
    """
    Return groups of effects that these data cannot tell apart.

    Effects belong together if one in the other's place costs hardly more. A group holds at
    most LARGEST_GROUP, the likeliest of them.
    """
    top, score = best(candidates), Prices.among(candidates).score
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
