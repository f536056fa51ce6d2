# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Intervals of fitted values, by Laplace's approximation with a cluster-robust variance."""

from collections.abc import Callable, Mapping, Sequence
import math
from types import MappingProxyType
from typing import Any

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState, proper_precision
from simgap.machine.contract import FloatArray, Parameter
from simgap.search.hypothesis import Hypothesis
from simgap.settings import IntervalSettings, Settings

TWO_SIDED_95 = 1.96
# Share of a variance that data of single precision can account for.
_BY_DATA = 1e-6


def inflation(problem: LeastSquares, state: FitState) -> FloatArray:
    """Return each value's variance over that with independent noise, 1 or more, shape (m,)."""
    posterior = covariance(state, 1.0, problem.settings.interval)
    return _inflation(problem, state, posterior)


def contrast_deviation(problem: LeastSquares, state: FitState, contrast: FloatArray) -> float:
    """Return the robust standard deviation of fitted values times `contrast`, shape (m,)."""
    settings = problem.settings.interval
    along = covariance(state, 1.0, settings) @ contrast[:, np.newaxis]
    [inflated] = _inflation(problem, state, along)
    return float(np.sqrt(contrast @ covariance(state, float(inflated), settings) @ contrast))


def _inflation(problem: LeastSquares, state: FitState, posterior: FloatArray) -> FloatArray:
    """Return the inflation along the columns of a product with the covariance, shape (k,)."""
    jacobian, weight = state.jacobian, state.weight
    block_s = problem.machine.time_scales.block_s
    labels = np.concatenate([
        k * 1e6 + np.repeat(np.floor(e.time / block_s), e.measured.shape[1])
        for k, e in enumerate(problem.experiments)])
    starts = np.flatnonzero(np.diff(labels, prepend=-1.0))
    scores = np.add.reduceat(
        jacobian * (weight * state.residual).astype(np.float32)[:, np.newaxis], starts, axis=0)
    found = np.sum(np.square(scores.astype(float) @ posterior), axis=0)
    independent = np.sum((state.hessian @ posterior) * posterior, axis=0)
    prior = proper_precision(state.parameters) @ np.square(posterior)
    # a value that priors alone determine has no scatter to compare
    by_data = independent > _BY_DATA * (independent + prior)
    return np.where(by_data, np.maximum(found / np.where(by_data, independent, 1.0), 1.0), 1.0)


def covariance(state: FitState, inflated: float, settings: IntervalSettings) -> FloatArray:
    """Return the covariance of converged values, shape (m, m); `inflated` is of the variance."""
    return inverse(known_hessian(state, settings) / inflated, proper_precision(state.parameters))


def inverse(known: FloatArray, precision: FloatArray) -> FloatArray:
    """Return the covariance by what data, shape (m, m), and priors, shape (m,), determine."""
    total = known + np.diag(precision)
    unit = np.sqrt(np.diag(total))
    return np.asarray(np.linalg.inv(total / np.outer(unit, unit)) / np.outer(unit, unit))


def known_hessian(state: FitState, settings: IntervalSettings) -> FloatArray:
    """Return the Hessian without the directions that derivatives do not determine."""
    scale = np.sqrt(np.maximum(np.diag(state.hessian), 1e-30))
    values, vectors = np.linalg.eigh(state.hessian / np.outer(scale, scale))
    sure = np.maximum(values - settings.derivative_error ** 2, 0.0)
    return np.asarray(np.outer(scale, scale) * ((vectors * sure) @ vectors.T))


def ci95(value: float, deviation: float) -> list[float]:
    """Return the interval of 95 percent."""
    return [value - TWO_SIDED_95 * deviation, value + TWO_SIDED_95 * deviation]


def jackknife(values: Sequence[float]) -> float:
    """Return the standard deviation of an estimate from those without each test; 0 from one."""
    count = len(values)
    return math.sqrt((count - 1) * float(np.var(values))) if count > 1 else 0.0


def deviations(hypothesis: Hypothesis, inflated: Callable[[str], float],
               settings: Settings,
               between_tests: Mapping[str, float] = MappingProxyType({})) -> dict[str, float]:
    """Return robust standard deviations of the effects of a converged hypothesis, by name."""
    state = hypothesis.state
    names = [p.name for p in state.parameters]
    known = known_hessian(state, settings.interval)
    prior = proper_precision(state.parameters)
    found = {}
    for parameter, value in hypothesis.values:
        place = names.index(parameter.name)
        variance = inverse(known / inflated(parameter.name), prior)[place, place]
        found[parameter.name] = math.hypot(
            max(float(variance) ** 0.5, between_tests.get(parameter.name, 0.0)),
            _same_number(parameter, value), settings.noise.model_error * value)
    return found


def values_with_intervals(hypothesis: Hypothesis,
                          deviating: Mapping[str, float]) -> dict[str, Any]:
    """Return a hypothesis' effect values with 95 percent intervals, for the JSON."""
    return {p.name: {'value': value, 'unit': p.unit, 'ci95': np.clip(
        ci95(value, deviating[p.name]), p.low, p.high).tolist()} for p, value in hypothesis.values}


def _same_number(parameter: Parameter, value: float) -> float:
    """Return the deviation from the tolerance of a number that the effect has taken over."""
    return parameter.tolerance / 3.0 ** 0.5 * (abs(1.0 + value) if parameter.unit == '1' else 1.0)
