# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The doubt whether an effect of a fit is larger than its tolerance, or mends something else."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from simgap.search.hypothesis import Hypothesis
from simgap.settings import IntervalSettings


@dataclass(frozen=True)
class Doubt:
    """What tells whether an effect is larger than its tolerance."""

    size: str  # number that exceeds its tolerance by most deviations
    excess: float  # over the tolerance, in the number's unit
    deviation: float  # standard deviation of the number
    sure: float  # excess in deviations at which the doubt is a half
    gain: float  # [half chi-square] over the inflation; 0 if no fit has shown it
    sure_by_gain: float  # gain at which the doubt is a half, however small the excess
    slope: float  # how sharply the doubt falls beyond these limits

    @property
    def certainty(self) -> float:
        """Return the excess or the gain over that at which the doubt is a half."""
        return max(self.excess / self.deviation / self.sure, self.gain / self.sure_by_gain)

    @property
    def probability(self) -> float:
        """Return the probability that the effect is within its tolerance after all."""
        return float(1.0 / (1.0 + self.certainty ** self.slope))


def doubts(hypothesis: Hypothesis, deviating: Mapping[str, float], gained: float,
           settings: IntervalSettings, beyond: float,
           own_gains: Mapping[str, float] = MappingProxyType({})) -> dict[str, Doubt]:
    """
    Return the doubts whether effects are larger than their tolerances, by effect.

    The strongest is not in doubt if `gained`, the gain of all, is large. A weaker one may only
    mend its form, and has to exceed its tolerance by more, or to gain more of its own. Gains are
    [half chi-square] over the inflation. Courses over time are judged elsewhere. `deviating` has
    standard deviations; `beyond` is the excess of the strongest, in deviations, at which its doubt
    is a half.
    """
    point = hypothesis.state.point()
    found: dict[str, Doubt] = {}
    for effect, form in zip(hypothesis.effects, hypothesis.forms, strict=True):
        if effect in hypothesis.beyond_tolerance and not form.is_course:
            most = max(form.sizes, key=lambda p: (
                (abs(point[p.name]) - p.tolerance) / deviating[p.name]))
            found[effect] = Doubt(
                most.name, abs(point[most.name]) - most.tolerance, deviating[most.name],
                max(beyond, settings.sure_of_partner), own_gains.get(effect, 0.0),
                settings.partner_sure_by_gain, settings.sure_slope)
    strongest = max((doubt.excess / doubt.deviation for doubt in found.values()), default=0.0)
    return {effect: doubt if doubt.excess / doubt.deviation < strongest else
            replace(doubt, sure=beyond, gain=gained, sure_by_gain=settings.sure_by_gain)
            for effect, doubt in found.items()}
