# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a planned test tells of rivals: how badly a wrong one would fit, what that decides."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from simgap.machine.contract import FloatArray, Point
from simgap.search.rival import Rival

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

    def posterior(self, caution: float = 1.0) -> FloatArray:
        """Return the probability of j if i is true, shape (r, r); `caution` divides evidence."""
        logits = np.log(np.maximum(self.prior, LEAST)) - self.lack / caution
        weights = np.exp(logits - logits.max(axis=1, keepdims=True))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def expected(self) -> float:
        """Return the probability that the true rival is expected to get, if one of them is."""
        return float(self.prior @ np.diag(self.posterior()))

    def information(self, caution: float = 1.0) -> float:
        """Return the information on which rival is true that is expected, in nats."""
        after = np.maximum(np.diag(self.posterior(caution)), LEAST)
        return float(self.prior @ np.log(after / np.maximum(self.prior, LEAST)))

    def surely(self, sure: float) -> float:
        """Return how probable it is that the true rival gets at least the probability `sure`."""
        return float(self.prior @ (np.diag(self.posterior()) >= sure))

    def least_lack(self) -> FloatArray:
        """Return by how much two rivals are told apart at least, whichever is true, (r, r)."""
        return np.asarray(np.minimum(self.lack, self.lack.T))


def prior_of(rivals: Sequence[Rival]) -> FloatArray:
    """Return the probabilities of rivals if one of them is true, shape (r,)."""
    prior = np.array([rival.probability for rival in rivals])
    return np.asarray(prior / prior.sum())
