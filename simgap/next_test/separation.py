# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a planned test tells of rivals: how badly a wrong one would fit, and what that decides."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations
import math

import numpy as np
from simgap.machine.contract import FloatArray, Point
from simgap.next_test.rivals import Rival
from simgap.verdict.doubts import Doubt

# A rival as good as impossible is no less probable than this.
LEAST = 1e-12


@dataclass(frozen=True)
class Separation:
    """What a planned test tells of r rivals."""

    prior: FloatArray  # probability of each rival before the test, shape (r,)
    lack: FloatArray  # half the chi-square by which j fits worse than i if i is true, shape (r, r)
    # share of that which each signal gives, if known
    channels: Mapping[str, float] = field(default_factory=dict)
    # where the fit of j to i ended, by (i, j)
    points: Mapping[tuple[int, int], Point] = field(default_factory=dict)
    # greatest logarithm of the odds that rival j loses to i if i is true, because the verdict
    # doubts an effect that only one of them names, shape (r, r); infinite for other pairs
    odds: FloatArray = field(default_factory=lambda: np.array(np.inf))
    # for each rival the share to which deviations shrink
    shrunk: Sequence[Mapping[str, float]] = ()

    def evidence(self, temperature: float) -> FloatArray:
        """Return the logarithm of the odds that rival j loses to i if i is true, shape (r, r)."""
        return np.asarray(np.minimum(self.lack / temperature, self.odds))

    def posterior(self, temperature: float, caution: float = 1.0) -> FloatArray:
        """Return the probability of j if i is true, shape (r, r); `caution` divides evidence."""
        logits = np.log(np.maximum(self.prior, LEAST)) - self.evidence(temperature) / caution
        weights = np.exp(logits - logits.max(axis=1, keepdims=True))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def expected(self, temperature: float) -> float:
        """Return the probability that the true rival is expected to get, if one of them is."""
        return float(self.prior @ np.diag(self.posterior(temperature)))

    def information(self, temperature: float, caution: float = 1.0) -> float:
        """Return the information on which rival is true that is expected, in nats."""
        after = np.maximum(np.diag(self.posterior(temperature, caution)), LEAST)
        return float(self.prior @ np.log(after / np.maximum(self.prior, LEAST)))

    def surely(self, temperature: float, sure: float) -> float:
        """Return how probable it is that the true rival gets at least the probability `sure`."""
        return float(self.prior @ (np.diag(self.posterior(temperature)) >= sure))

    def least_lack(self) -> FloatArray:
        """Return by how much two rivals are told apart at least, whichever is true, (r, r)."""
        return np.asarray(np.minimum(self.lack, self.lack.T))


def prior_of(rivals: Sequence[Rival]) -> FloatArray:
    """Return the probabilities of rivals if one of them is true, shape (r,)."""
    prior = np.array([rival.probability for rival in rivals])
    return np.asarray(prior / prior.sum())


def odds_of(rivals: Sequence[Rival], lack: FloatArray, shrunk: Sequence[Mapping[str, float]],
            ) -> FloatArray:
    """Return what doubts leave of the evidence, see `Separation.odds`."""
    odds = np.full(lack.shape, np.inf)
    for i, j in permutations(range(len(rivals)), 2):
        one, other = rivals[i], rivals[j]
        more = set(one.named) - set(other.named)
        if more and set(other.named) < set(one.named) and more <= set(one.doubts):
            odds[[i, j], [j, i]] = sum(
                _ended(doubt, one.deviation(doubt.size), shrunk[i].get(doubt.size, 1.0),
                       float(lack[i, j]))
                for doubt in (one.doubts[effect] for effect in sorted(more)))
    return odds


def _ended(doubt: Doubt, known: float, share: float, gain: float) -> FloatArray:
    """Return the logarithms of the odds by which a test moves a doubt, shape (2,)."""
    # By how much the doubt falls if the effect is there, and by how much the effect does if not.
    # `known` is the deviation of its size from the readings alone, which shrinks to a `share`;
    # `gain` is what the test adds if the effect is there.
    # what follows from a tolerance, or from how tests differ, does not shrink
    after = replace(doubt, deviation=math.sqrt(max(
        doubt.deviation ** 2 - (1.0 - share ** 2) * known ** 2, LEAST)))
    # a gain that no fit has shown will not be shown by the next one either
    there = replace(after, gain=doubt.gain + gain if doubt.gain else 0.0)
    # the size of what is not there goes to zero as it gets certain
    absent = replace(after, excess=doubt.excess * share ** 2)
    return doubt.slope * np.log([there.certainty / doubt.certainty,
                                 doubt.certainty / absent.certainty])


def shrunk_at_most(rivals: Sequence[Rival], i: int, lack: FloatArray) -> dict[str, float]:
    """Return the share to which deviations of a rival shrink if no other number follows."""
    found: dict[str, float] = {}
    for doubt in rivals[i].doubts.values():
        for j, other in enumerate(rivals):
            apart = rivals[i].point[doubt.size] - other.point.get(doubt.size, 0.0)
            if j != i and apart:
                share = 1.0 / math.sqrt(
                    1.0 + 2.0 * lack[j] * (rivals[i].deviation(doubt.size) / apart) ** 2)
                found[doubt.size] = max(share, found.get(doubt.size, 0.0))
    return found
