# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A hypothesis: effects that were fitted together with all nuisances, and what they pay."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress, product
import math

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState, proper_precision
from simgap.machine.contract import Form, Parameter, Point
from simgap.settings import PenaltySettings


@dataclass(frozen=True)
class Hypothesis:
    """Effects that were fitted together with all nuisances."""

    effects: tuple[str, ...]  # their ids; none for the nuisances alone
    forms: tuple[Form, ...]  # one for each effect
    state: FitState  # where the fit ended
    # probability that an effect is within tolerance
    doubts: Mapping[str, float] = field(default_factory=dict)

    @property
    def cost(self) -> float:
        """Return half a chi-square, robust, with the priors."""
        return self.state.cost

    @property
    def values(self) -> list[tuple[Parameter, float]]:
        """Return the parameters of the effects with their values."""
        point = self.state.point()
        return [(p, point[p.name]) for form in self.forms for p in form.parameters]

    @property
    def named(self) -> tuple[str, ...]:
        """Return the effects that exceed their tolerances and are not unsure."""
        return tuple(effect for effect in self.beyond_tolerance if effect not in self.unsure)

    @property
    def beyond_tolerance(self) -> tuple[str, ...]:
        """Return the effects that are larger, as fitted, than on a machine in good order."""
        point = self.state.point()
        return tuple(effect for effect, form in zip(self.effects, self.forms, strict=True)
                     if any(abs(point[p.name]) > p.tolerance for p in form.sizes))

    @property
    def unsure(self) -> frozenset[str]:
        """Return the effects that are more probably within their tolerances than not."""
        return frozenset(effect for effect, doubt in self.doubts.items() if doubt > 0.5)

    def may_name(self) -> Iterator[tuple[tuple[str, ...], float]]:
        """Yield the sets of effects that may be real, each with its probability."""
        effects = self.beyond_tolerance
        doubts = [self.doubts.get(effect, 0.0) for effect in effects]
        for kept in product((True, False), repeat=len(effects)):
            chance = math.prod(1.0 - doubt if keep else doubt
                               for keep, doubt in zip(kept, doubts, strict=True))
            if chance > 0.0:
                yield tuple(compress(effects, kept)), chance

    def parameters_of(self, effects: Collection[str]) -> set[str]:
        """Return the names of the parameters of some of its effects."""
        return {p.name for effect, form in zip(self.effects, self.forms, strict=True)
                if effect in effects for p in form.parameters}

    @property
    def has_course(self) -> bool:
        """Return whether one of the effects is a course over time."""
        return any(form.is_course for form in self.forms)

    def penalised(self, settings: PenaltySettings) -> float:
        """Return the cost with the penalty of the effects."""
        return self.state.cost + penalty(self.forms, self.state.point(), settings)

    def loss_without(self, effect: str) -> float:
        """Return what the fit would lose without an effect, were it quadratic."""
        # Half of Wald's statistic: the square of the sizes beyond tolerance, which a nuisance may
        # take over, in the metric of their own precision, with the nuisances following.
        form = self.forms[self.effects.index(effect)]
        sizes = {p.name for p in form.sizes}
        places = [j for j, p in enumerate(self.state.parameters) if p.name in sizes]
        beyond = np.array([max(abs(self.state.x[j]) - self.state.parameters[j].tolerance, 0.0)
                           * np.sign(self.state.x[j]) for j in places])
        precision = self.state.hessian + np.diag(proper_precision(self.state.parameters))
        unit = np.sqrt(np.diag(precision))
        # what rounding leaves undetermined has no curvature of its own
        covariance = np.linalg.pinv(precision / np.outer(unit, unit), 1e-6, hermitian=True)
        scaled = beyond * unit[places]
        return 0.5 * float(scaled @ np.linalg.pinv(
            covariance[np.ix_(places, places)], hermitian=True) @ scaled)

    def with_jacobian(self, problem: LeastSquares) -> Hypothesis:
        """Return the hypothesis with a Jacobian, taken where its fit ended if it has none."""
        if self.state.base_jacobian.size:
            return self
        return replace(self, state=problem.start(self.state.parameters, self.state.point()))

    def without_jacobian(self, keep_hessian: bool = False) -> Hypothesis:
        """Return the hypothesis without its Jacobian, which takes most of the memory."""
        return replace(self, state=self.state.without_jacobian(keep_hessian))


def penalty(forms: Sequence[Form], point: Point, settings: PenaltySettings) -> float:
    """Return the penalty of effects in these forms with these values [half chi-square]."""
    # An effect as small as its number's tolerance is that tolerance, and pays for it; the payment
    # falls to zero as the effect outgrows the tolerance.
    total = 0.0
    for form in forms:
        total += settings.effect + settings.scanned * form.scanned
        for p in form.parameters:
            total += settings.prior_parameter if p.prior_sigma else settings.parameter
            if p.tolerance:
                total += settings.tolerated * max(0.0, 1.0 - abs(point[p.name]) / p.tolerance)
    return total
