# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a verdict knows of its rivals: the next test is designed from it, see `separation`.

Each rival is a hypothesis with its fitted numbers and their covariance. Numbers of a single test,
such as where it starts, or of a day are integrated out: the next test has its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from simgap.machine.contract import Machine, Parameter
from simgap.search.rival import Rival
from simgap.settings import DEFAULT, Settings
from simgap.verdict.intervals import covariance
from simgap.verdict.verdict import Answer


@dataclass(frozen=True)
class Findings:
    """What the design of a further test takes from the tests so far."""

    rivals: Sequence[Rival] = ()  # answers of the verdict; none before the first test
    inflated: float = 1.0  # divides differences of the cost
    # of each sensor, see `noise.found_noise`; by default that of its data sheet
    noise: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    # smallest size at which an effect shows, in the unit of its first parameter, by effect;
    # unknown where answers are open
    shown: Mapping[str, float] = field(default_factory=dict)
    # probability that something without a name acts in a part of the machine, by part; the
    # remainder is spread over the whole catalogue
    unnamed: Mapping[str, float] = field(default_factory=dict)

    def are_open(self, settings: Settings = DEFAULT) -> bool:
        """
        Return whether there are answers to tell apart: several, and none of them sure.

        Nothing can be distinguished if `unknown` is the likeliest, or if all answers but the best
        together have less than the least probability of `unknown`.
        """
        known = [rival.probability for rival in self.rivals]
        return len(known) > 1 and self.unlisted < max(known) < min(
            settings.planning.sure, (1.0 - settings.verdict.least_unknown) * sum(known))

    @property
    def unlisted(self) -> float:
        """Return the probability that none of the answers is true."""
        return 1.0 - sum(rival.probability for rival in self.rivals)

    def as_data(self) -> dict[str, Any]:
        """Return the findings as plain data: the entry `planning` of a verdict."""
        return {'inflation': self.inflated, 'noise': dict(self.noise), 'shown': dict(self.shown),
                'unnamed': dict(self.unnamed),
                'rivals': [rival.as_data() for rival in self.rivals]}

    @classmethod
    def of_data(cls, planning: Mapping[str, Any]) -> Findings:
        """Take the findings from `planning` of a verdict, with the errors of `Rival.of_data`."""
        # an earlier version lacks some entries
        return cls([Rival.of_data(item) for item in planning['rivals']],
                   float(planning['inflation']), dict(planning.get('noise', {})),
                   {effect: float(size) for effect, size in planning.get('shown', {}).items()},
                   {part: float(share) for part, share in planning.get('unnamed', {}).items()})


def known_to(machine: Machine, rival: Rival) -> dict[str, float]:
    """Return a rival's values as far as the planned tests have these numbers."""
    own = {p.name for p in numbers_of(machine, rival)}
    return {name: value for name, value in rival.point.items() if name in own}


def numbers_of(machine: Machine, rival: Rival) -> list[Parameter]:
    """Return the numbers of a machine that has the effects of a rival."""
    return [*machine.nuisances, *(p for form in rival.forms_of(machine) for p in form.parameters)]


def rivals_of(answers: Sequence[Answer], inflated: float, settings: Settings) -> list[Rival]:
    """Return the likeliest of sorted answers with what is known of their numbers."""
    found = []
    for answer in answers[:settings.verdict.largest_group]:
        if answer.probability < settings.verdict.least_probability:
            continue
        hypothesis, state = answer.hypothesis, answer.hypothesis.state
        shared = [j for j, p in enumerate(state.parameters) if p.experiment is None and not p.of]
        posterior = covariance(state, inflated, settings.interval)
        found.append(Rival(
            answer.effects, hypothesis.effects, tuple(form.name for form in hypothesis.forms),
            answer.probability, tuple(state.parameters[j].name for j in shared), state.x[shared],
            posterior[np.ix_(shared, shared)]))
    return found
