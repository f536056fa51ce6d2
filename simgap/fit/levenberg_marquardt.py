# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Levenberg-Marquardt within a box, with iteratively reweighted residuals."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from simgap.fit.box_qp import box_constrained_step
from simgap.fit.broyden import BroydenModel
from simgap.fit.state import FitState, point_of, prior_precision
from simgap.machine.contract import FloatArray
from simgap.settings import FitSettings


@dataclass(frozen=True)
class LevenbergMarquardt:
    """The solver of a least-squares problem."""

    residuals: Callable[[dict[str, float]], FloatArray]  # at a point, shape (n,)
    weights: Callable[[FloatArray], FloatArray]  # of residuals, shape (n,)
    # losses and priors, from residuals, values and precisions
    cost: Callable[[FloatArray, FloatArray, FloatArray], float]
    settings: FitSettings  # thresholds

    def minimised(self, state: FitState, iterations: int) -> FitState:
        """Run iterations until they gain nothing, or this many of them."""
        options = self.settings
        low = np.array([p.low for p in state.parameters])
        high = np.array([p.high for p in state.parameters])
        prior = prior_precision(state.parameters)
        x, residual, cost, weight = state.x, state.residual, state.cost, state.weight
        model = BroydenModel(state.jacobian, state.hessian, weight, residual, options)
        damping = options.damping
        for _ in range(iterations):
            gradient = model.gradient(weight * residual, prior * x)
            hessian = model.hessian + np.diag(prior)
            diagonal = np.diag(hessian).copy()
            step = box_constrained_step(hessian + damping * np.diag(diagonal + 1e-12), gradient,
                                        low - x, high - x)
            expected = float(gradient @ step - 0.5 * step @ hessian @ step)
            if not np.any(step) or expected < options.least_gain:
                break
            trial = np.clip(x + step, low, high)
            after = self.residuals(point_of(state.parameters, trial))
            trial_cost = self.cost(after, trial, prior)
            gained = cost - trial_cost
            # a failed step corrects the Jacobian, too
            model.update(step, diagonal, residual - after, weight)
            if gained > 0.0:
                x, residual, cost = trial, after, trial_cost
                weight = self.weights(residual)
                model.reweight(weight, weight * residual)
                damping = max(damping / options.damping_factor, options.damping)
            else:
                damping *= options.damping_factor
        return FitState(state.parameters, x, residual, model.jacobian, weight, cost,
                        tuple(model.errors), tuple(model.directions))
