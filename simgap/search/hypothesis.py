# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A hypothesis: effects that were fitted together with all nuisances."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import Form, Parameter


@dataclass(frozen=True)
class Hypothesis:
    """Effects that were fitted together with all nuisances."""

    effects: tuple[str, ...]  # their ids; none for the nuisances alone
    forms: tuple[Form, ...]  # one for each effect
    state: FitState  # where the fit ended

    @property
    def cost(self) -> float:
        """Return half a chi-square, robust, with the priors."""
        return self.state.cost

    @property
    def items(self) -> list[tuple[str, Form]]:
        """Return the effects with their forms."""
        return list(zip(self.effects, self.forms, strict=True))

    @property
    def values(self) -> list[tuple[Parameter, float]]:
        """Return the parameters of the effects with their values."""
        point = self.state.point()
        return [(p, point[p.name]) for form in self.forms for p in form.parameters]

    @property
    def named(self) -> tuple[str, ...]:
        """Return the effects that are larger than on a machine in good order."""
        point = self.state.point()
        return tuple(effect for effect, form in self.items
                     if any(abs(point[p.name]) > p.tolerance for p in form.sizes))

    def parameters_of(self, effects: Collection[str]) -> set[str]:
        """Return the names of the parameters of some of its effects."""
        return {p.name for effect, form in self.items if effect in effects
                for p in form.parameters}

    def with_jacobian(self, problem: LeastSquares) -> Hypothesis:
        """Return the hypothesis with a Jacobian, taken where its fit ended if it has none."""
        if self.state.base_jacobian.size:
            return self
        return replace(self, state=problem.start(self.state.parameters, self.state.point()))
