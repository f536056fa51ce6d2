# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Intervals of fitted values, by Laplace's approximation.

Difference quotients of a drive that sticks and slips are right to a tenth. A Hessian of them knows
nothing of directions in which two columns differ by less. There the priors alone count: without
that, a change of a number and the tolerance of the same number would be told apart by the error of
a difference quotient.
"""

from __future__ import annotations

from typing import Any

from antenna_drive.diagnosis.hypothesis import Hypothesis
from antenna_drive.diagnosis.least_squares import FitState, proper_precision
from antenna_drive.diagnosis.machine import FloatArray, Parameter
from antenna_drive.diagnosis.settings import IntervalSettings
import numpy as np

_TWO_SIDED_95 = 1.96


def covariance(state: FitState, left: float, settings: IntervalSettings) -> FloatArray:
    """
    Return the covariance of fitted values, shape (m, m).

    Parameters
    ----------
    state
        of a fit that has converged
    left
        mean square of the residual, in variances of the noise; above 1 it widens the intervals
    settings
        thresholds

    """
    known = state.hessian / max(left, 1.0)
    scale = np.sqrt(np.maximum(np.diag(known), 1e-30))
    values, vectors = np.linalg.eigh(known / np.outer(scale, scale))
    sure = np.maximum(values - settings.derivative_error ** 2, 0.0)
    total = np.outer(scale, scale) * ((vectors * sure) @ vectors.T)
    total += np.diag(proper_precision(state.parameters))
    unit = np.sqrt(np.diag(total))
    return np.asarray(np.linalg.inv(total / np.outer(unit, unit)) / np.outer(unit, unit))


def values_with_intervals(hypothesis: Hypothesis, left: float,
                          settings: IntervalSettings) -> dict[str, Any]:
    """Return the values of a hypothesis' effects with 95 percent intervals, for the JSON."""
    state = hypothesis.state
    sigma = np.sqrt(np.diag(covariance(state, left, settings)))
    names = [p.name for p in state.parameters]
    found = {}
    for parameter, value in hypothesis.values:
        half_width = _TWO_SIDED_95 * float(np.hypot(
            max(sigma[names.index(parameter.name)], _same_number(parameter, value)),
            settings.model_error * abs(value)))
        found[parameter.name] = {
            'value': value, 'ci95': [max(value - half_width, parameter.low),
                                     min(value + half_width, parameter.high)],
            'unit': parameter.unit}
    return found


def _same_number(parameter: Parameter, value: float) -> float:
    """Return the standard deviation that the tolerance of the same number adds to a change."""
    return parameter.tolerance / 3.0 ** 0.5 * (abs(1.0 + value) if parameter.unit == '1' else 1.0)
