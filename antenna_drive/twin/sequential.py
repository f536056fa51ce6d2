# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
When a verdict that grows may be believed: a rule for looking as often as one likes.

Each look gives probabilities of the answers. Two properties of probabilities that follow from
Bayes' rule make repeated looks harmless:

- Naming a gap. On a healthy machine, the odds of 'some gap' against 'no gap', divided by those
  before any data, are a martingale with mean 1: an e-process (A. Ramdas, P. Gruenwald, V. Vovk,
  G. Shafer, Statistical Science 38 (2023) 576). By Ville's inequality they ever exceed 1 / alpha
  with a probability of at most alpha, however many looks there are. The prior odds of a gap are
  at most 1 here, because each effect pays a price before it is considered. Leaving them out only
  makes the rule more careful.
- Believing the first answer. Whenever one stops, the mean error is the mean of one minus the
  probability with which one has stopped. Who stops at 0.9 is wrong at most once in ten, if the
  probabilities are what they say (D. V. Lindley, Biometrika 44 (1957) 187).

Both hold exactly for exact probabilities. Those of a diagnosis are as good as trials show them to
be (expected calibration error), and they are of what the tests can show. One motion does not show
every effect: a slow square wave calls a machine healthy whose fault a fast triangle shows. The
same first answer is therefore asked for in two looks, one after the other, and in a second test.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

NONE, UNKNOWN = ('none',), ('unknown',)
Answer = tuple[str, ...]


@dataclass(frozen=True)
class Rule:
    """When to stop."""

    # greatest probability that a gap is ever decided on a healthy machine
    false_alarm: float = 0.05
    error: float = 0.1  # greatest mean error of a decided answer
    looks: int = 2  # so many looks in a row must have the same first answer
    tests: int = 2  # the last look must be based on so many tests


@dataclass(frozen=True)
class Look:
    """What one look said."""

    seconds: float  # of testing that it was based on [s]
    tests: int  # that it was based on, those that are long enough to count
    probabilities: Mapping[Answer, float]  # of the answers; they sum to 1
    confusable: Sequence[frozenset[str]] = ()  # groups of effects that the data cannot tell apart

    @property
    def first(self) -> Answer:
        """Return the likeliest answer."""
        return max(self.probabilities, key=lambda answer: self.probabilities[answer])

    @property
    def confidence(self) -> float:
        """Return the probability of the first answer, with what it cannot be told from."""
        first = self.first
        return min(1.0, sum(p for answer, p in self.probabilities.items()
                            if self.same(answer, first)))

    @property
    def evidence(self) -> float:
        """Return the odds of a gap against no gap, an e-value."""
        none = self.probabilities.get(NONE, 0.0)
        return (1.0 - none) / max(none, 1e-300)

    def same(self, answer: Answer, first: Answer) -> bool:
        """Return whether two answers name the same but for confusable effects."""
        if len(answer) != len(first) or NONE in (answer, first) or UNKNOWN in (answer, first):
            return answer == first
        left = list(answer)
        for effect in first:
            match = next((other for other in left if other == effect or any(
                {effect, other} <= group for group in self.confusable)), None)
            if match is None:
                return False
            left.remove(match)
        return True


def decided(looks: Sequence[Look], rule: Rule) -> bool:
    """Return whether one may stop after these looks, in the order of time."""
    last = looks[-rule.looks:]
    if len(last) < rule.looks or any(not last[-1].same(look.first, last[-1].first)
                                     for look in last):
        return False
    now = last[-1]
    if now.tests < rule.tests or now.confidence < 1.0 - rule.error:
        return False
    return now.first == NONE or now.evidence >= 1.0 / rule.false_alarm
