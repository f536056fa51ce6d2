# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a verdict knows of its rivals: the next test is designed from it, see `discrimination`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
import math
from typing import Any

import numpy as np
from scipy.stats import truncnorm
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import FloatArray, Form, Machine, Parameter, Point
from simgap.search.hypothesis import Hypothesis
from simgap.settings import PlanningSettings, Settings
from simgap.verdict.doubts import Doubt
from simgap.verdict.intervals import covariance
from simgap.verdict.verdict import Answer

# Digits of a covariance in a file: a number's deviation is known to a few percent at best.
_DIGITS = 5
# Variance that a number keeps at least within bounds, as a share of what it had.
_LEAST_VARIANCE = 1e-6
# No variance is less than this.
_LEAST = 1e-30


@dataclass(frozen=True)
class Rival:
    """An answer of a verdict."""

    named: tuple[str, ...]  # effects that it names; none for 'none'
    effects: tuple[str, ...]  # that were fitted
    forms: tuple[str, ...]  # their names, one for each effect
    probability: float  # of the answer, in the verdict
    names: tuple[str, ...]  # numbers of the machine and of the effects, m of them
    values: FloatArray  # shape (m,)
    covariance: FloatArray  # shape (m, m)
    doubts: Mapping[str, Doubt] = field(default_factory=dict)  # by effect

    @property
    def point(self) -> dict[str, float]:
        """Return the values by name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    def forms_of(self, machine: Machine) -> list[Form]:
        """Return the forms of the effects in a machine; KeyError if its catalogue lacks one."""
        return [machine.catalogue.form_named(machine.catalogue[effect], form)
                for effect, form in zip(self.effects, self.forms, strict=True)]

    def is_known_to(self, machine: Machine) -> bool:
        """Return whether a machine has the effects in these forms."""
        try:
            self.forms_of(machine)
        except KeyError:
            return False
        return True

    def deviation(self, name: str) -> float:
        """Return the standard deviation of one of the values."""
        place = self.names.index(name)
        return math.sqrt(max(float(self.covariance[place, place]), _LEAST))

    def covariance_of(self, names: Sequence[str]) -> FloatArray:
        """Return the covariance of some of the values."""
        places = [self.names.index(name) for name in names]
        return self.covariance[np.ix_(places, places)]

    def as_data(self) -> dict[str, Any]:
        """Return the rival as plain data, for the JSON."""
        # the lower triangle of the covariance, a text for each row: a line for each number would
        # bury the verdict
        rows = [' '.join(f'{x:.{_DIGITS}g}' for x in row[:i + 1])
                for i, row in enumerate(self.covariance)]
        return {'named': list(self.named), 'effects': list(self.effects),
                'forms': list(self.forms), 'probability': self.probability,
                'names': list(self.names), 'values': self.values.tolist(), 'covariance': rows,
                'doubts': {effect: asdict(doubt) for effect, doubt in self.doubts.items()}}

    @classmethod
    def of_data(cls, data: Mapping[str, Any]) -> Rival:
        """Take a rival from plain data; KeyError, TypeError, ValueError or AttributeError."""
        names = tuple(data['names'])
        lower = np.zeros((len(names), len(names)))
        for i, row in enumerate(data['covariance']):
            lower[i, :i + 1] = [float(x) for x in row.split()]
        return cls(tuple(data['named']), tuple(data['effects']), tuple(data['forms']),
                   float(data['probability']), names, np.array(data['values'], float),
                   lower + np.tril(lower, -1).T,
                   {effect: Doubt(**doubt) for effect, doubt in data.get('doubts', {}).items()})


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

    def are_open(self, settings: Settings) -> bool:
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


def rivals_of(problem: LeastSquares, answers: Sequence[Answer], inflated: float,
              settings: PlanningSettings,
              doubted: Callable[[Hypothesis], Mapping[str, Doubt]] = lambda hypothesis: {},
              ) -> list[Rival]:
    """Return the likeliest of sorted answers with what is known of their numbers, see `Rival`."""
    found = []
    for answer in answers[:settings.rivals]:
        if answer.probability < settings.least_probability:
            continue
        hypothesis, state = answer.hypothesis, answer.hypothesis.state
        if state.kept_hessian is None:
            state = hypothesis.with_jacobian(problem).state
        shared = [j for j, p in enumerate(state.parameters) if p.experiment is None]
        posterior = covariance(state, inflated, problem.settings.interval)
        names = tuple(state.parameters[j].name for j in shared)
        values, known = state.x[shared], posterior[np.ix_(shared, shared)]
        for effect, form in zip(hypothesis.effects, hypothesis.forms, strict=True):
            for size, low, high in _regions(form, state.point(), effect in answer.effects):
                if size.name in names:
                    values, known = within(values, known, names.index(size.name), low, high)
        found.append(Rival(
            answer.effects, hypothesis.effects, tuple(form.name for form in hypothesis.forms),
            answer.probability, names, values, known,
            {effect: doubt for effect, doubt in doubted(hypothesis).items()
             if effect in answer.effects and doubt.size in names}))
    return found


def _regions(form: Form, point: Point, named: bool) -> list[tuple[Parameter, float, float]]:
    """Return the sizes of an effect with the bounds that they have where it is named, or not."""
    if form.is_course:
        return []
    if not named:
        return [(p, -p.tolerance, p.tolerance) for p in form.sizes]
    most = max(form.sizes, key=lambda p: abs(point[p.name]) - p.tolerance)
    return [(most, most.tolerance, math.inf) if point[most.name] > 0.0 else
            (most, -math.inf, -most.tolerance)]


def within(values: FloatArray, known: FloatArray, place: int, low: float, high: float,
           ) -> tuple[FloatArray, FloatArray]:
    """
    Return the mean and the covariance of normal numbers, given that one is within bounds.

    The others follow it by regression (N. L. Johnson, S. Kotz, N. Balakrishnan, Continuous
    Univariate Distributions, volume 1, chapter 13, section 10.1). The bounds may be equal or
    infinite.
    """
    variance = known[place, place]
    if variance <= 0.0:
        return values, known
    deviation = math.sqrt(variance)
    a, b = (low - values[place]) / deviation, (high - values[place]) / deviation
    mean, spread = a, 0.0
    if a < b:
        with np.errstate(invalid='ignore'):
            mean, spread = (float(x) for x in truncnorm.stats(a, b))
    # rounding may leave them; and none is known for sure: the covariance is inverted
    mean, spread = min(max(mean, a), b), min(max(spread, _LEAST_VARIANCE), 1.0)
    along = known[:, place] / deviation
    return (np.asarray(values + along * mean),
            np.asarray(known - (1.0 - spread) * np.outer(along, along)))
