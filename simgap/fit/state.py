# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where a fit is: values, residuals, and what is known of their derivatives and priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from simgap.fit.broyden import Jacobian, updated, updated_product
from simgap.machine.contract import FloatArray, Parameter


@dataclass(frozen=True)
class FitState:
    """Where a fit is."""

    parameters: tuple[Parameter, ...]  # what is fitted, m of them
    x: FloatArray  # their values, shape (m,)
    residual: FloatArray  # in standard deviations, shape (n,); zero where nothing was measured
    # of the prediction [deviations per unit] as last taken, shape (n, m), float32
    base_jacobian: Jacobian
    weight: FloatArray  # of each residual in iteratively reweighted least squares, shape (n,)
    cost: float  # robust losses (half a chi-square if all are small) and priors
    broyden_errors: tuple[FloatArray, ...] = ()  # of the Jacobian's rank-one updates, (n,) each
    broyden_directions: tuple[FloatArray, ...] = ()  # of the same updates, (m,) each
    kept_hessian: FloatArray | None = None  # of a state that has dropped its Jacobian

    @property
    def jacobian(self) -> Jacobian:
        """Return the derivative of the prediction, shape (n, m); not kept, to save memory."""
        return updated(self.base_jacobian, self.broyden_errors, self.broyden_directions)

    @cached_property
    def hessian(self) -> FloatArray:
        """Return the Gauss-Newton Hessian without the priors, shape (m, m)."""
        if self.kept_hessian is not None:
            return self.kept_hessian
        return updated_product(self.base_jacobian, self.broyden_errors,
                               self.broyden_directions, self.weight)

    def without_jacobian(self) -> FitState:
        """Return the state without its Jacobian, which takes most of the memory."""
        return FitState(self.parameters, self.x, self.residual, np.empty((0, 0), np.float32),
                        self.weight, self.cost, kept_hessian=self.hessian)

    def point(self) -> dict[str, float]:
        """Return the values by name."""
        return point_of(self.parameters, self.x)


def point_of(parameters: Sequence[Parameter], x: FloatArray) -> dict[str, float]:
    """Return values by the names of their parameters."""
    return dict(zip((p.name for p in parameters), x.tolist(), strict=True))


def prior_precision(parameters: Sequence[Parameter]) -> FloatArray:
    """Return 1 / prior_sigma^2 of each parameter, 0 without a prior, shape (m,)."""
    return np.array([1.0 / p.prior_sigma ** 2 if p.prior_sigma > 0.0 else 0.0 for p in parameters])


def proper_precision(parameters: Sequence[Parameter]) -> FloatArray:
    """Return the prior precision; without a prior that of an even spread within the bounds."""
    prior = prior_precision(parameters)
    # one that is held has no width
    even = np.array([12.0 / max(p.high - p.low, 1e-30) ** 2 for p in parameters])
    return np.where(prior > 0.0, prior, even)
