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
What a fit determines and what it leaves open: sensitivity, correlation, profile, trade-off.

Near the best candidate each target's miss, in tolerances, is taken as linear in the
parameters. A parameter is determined as far as the targets would be missed by a tolerance if it
moved alone (conditional) or with all others making up for it as well as they can (marginal).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from typing import Any

from antenna_drive.calibration.problem import CalibrationProblem
from antenna_drive.calibration.search import FitCandidate, SearchResult
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters.schema import nearest, ParameterError
import numpy as np

# Half the distance between the two candidates that a sensitivity is taken from, as a share of
# the bounds: wide enough to step over the jumps that settling times have.
_HALF_STEP = 0.01
# Where the profile is taken, as shares of the bounds away from the best candidate.
_PROFILE = (-0.1, -0.05, -0.02, 0.02, 0.05, 0.1)
# A direction in which the targets change by less than this many tolerances over the whole range
# is not determined at all; it would only make the others look undetermined.
_FLAT = 0.3
# Marginal uncertainty, as a share of the bounds, up to which a parameter counts as determined.
_DETERMINED = 0.05
# Correlations that are worth telling.
_CORRELATED = 0.8
_TRADE_OFF_POINTS = 12
# Others that cost this many times the least are left out of a trade-off.
_HOPELESS = 30.0


@dataclass(frozen=True)
class _Local:
    """The misses near the best candidate: at it, and their slopes per share of the bounds."""

    misses: FloatArray
    slopes: FloatArray


def report(problem: CalibrationProblem, found: SearchResult, trade_offs: Sequence[str] = (),
           progress: Callable[[float], None] | None = None,
           also: Sequence[FitCandidate] = ()) -> dict[str, Any]:
    """
    Tell what was found and how far it is determined.

    Parameters
    ----------
    problem
        the fit
    found
        what the search found
    trade_offs
        figures of targets whose price in the other targets is to be shown
    progress
        told the share that is done
    also
        candidates of other searches with the same figures, for the trade-offs

    Returns
    -------
    mapping of cost, candidates, targets, parameters, correlations, flat_directions, trade_offs

    Raises
    ------
    ParameterError : a trade-off is asked for a figure that is no target

    """
    known = tuple(target.figure for target in problem.targets)
    for figure in trade_offs:
        if figure not in known:
            raise ParameterError(f'--trade-off {figure}: no such target{nearest(figure, known)}')
    best = found.best
    size = len(problem.free)
    total = 2 * size + size * len(_PROFILE)
    done = 0

    def evaluated(shares: FloatArray) -> Any:
        nonlocal done
        evaluation = problem.evaluate([float(share) for share in shares])
        done += 1
        if progress:
            progress(done / total)
        return evaluation

    local = _slopes(problem, best, evaluated)
    conditional, marginal, correlation, flat = _uncertainties(local)
    parameters = []
    for i, item in enumerate(problem.free):
        value = item.at(best.shares[i])
        parameters.append({
            'name': item.name, 'unit': item.unit, 'value': value,
            'conditional': _spread(item, best.shares[i], conditional[i]),
            'marginal': _spread(item, best.shares[i], marginal[i]),
            'determined': bool(marginal[i] <= _DETERMINED),
            'at_bound': bool(min(best.shares[i], 1.0 - best.shares[i]) < 0.01),
            'profile': _profile(item, i, best, local, evaluated),
        })
    names = [item.name for item in problem.free]
    return {
        'cost': best.evaluation.cost,
        'start_cost': found.candidates[0].evaluation.cost,
        'candidates': len(found.candidates) - 1,
        'targets': _targets(problem, best, found.candidates[0]),
        'parameters': parameters,
        'correlations': [
            {'first': names[i], 'second': names[j], 'correlation': correlation[i, j]}
            for i in range(size) for j in range(i) if abs(correlation[i, j]) >= _CORRELATED],
        'flat_directions': [
            {names[i]: float(direction[i]) for i in np.argsort(-np.abs(direction))[:4]}
            for direction in flat],
        'trade_offs': {figure: _trade_off(problem, (*found.candidates, *also), figure)
                       for figure in trade_offs},
    }


def _targets(problem: CalibrationProblem, best: FitCandidate, start: FitCandidate,
             ) -> list[dict[str, Any]]:
    told = []
    for target in problem.targets:
        obtained = best.evaluation.figures[target.figure]
        told.append({
            'figure': target.figure, 'unit': problem.figure(target.figure).unit,
            'kind': target.kind, 'aim': target.number, 'tolerance': target.tolerance,
            'start': start.evaluation.figures[target.figure], 'obtained': obtained,
            'met': bool(abs(target.residual(obtained)) <= 1.0)})
    return told


def _misses(problem: CalibrationProblem, figures: Any) -> FloatArray:
    """
    Return each target's miss in tolerances, with the sign, also where a bound is kept.

    A kept bound carries no information as long as it stays kept; it counts with its weight only
    near the bound.
    """
    return np.array([math.sqrt(target.weight) * target.residual(figures[target.figure])
                     for target in problem.targets])


def _slopes(problem: CalibrationProblem, best: FitCandidate,
            evaluated: Callable[[FloatArray], Any]) -> _Local:
    centre = np.array(best.shares)
    columns = []
    for i in range(centre.size):
        ends = []
        for side in (-1.0, 1.0):
            shares = centre.copy()
            shares[i] = min(max(shares[i] + side * _HALF_STEP, 0.0), 1.0)
            ends.append((shares[i], _misses(problem, evaluated(shares).figures)))
        (low, before), (high, after) = ends
        columns.append((after - before) / (high - low))
    return _Local(_misses(problem, best.evaluation.figures), np.column_stack(columns))


def _uncertainties(local: _Local) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return conditional and marginal uncertainty, correlation, and the flat directions."""
    _, strengths, directions = np.linalg.svd(local.slopes)
    size = local.slopes.shape[1]
    strengths = np.pad(strengths, (0, size - strengths.size))
    norms = np.linalg.norm(local.slopes, axis=0)
    conditional = 1.0 / np.maximum(norms, 1.0)
    # along a direction that the targets do not feel, the bounds are all that is known
    variance = 1.0 / np.maximum(strengths, 1.0) ** 2
    covariance = (directions.T * variance) @ directions
    marginal = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(marginal, marginal)
    return conditional, marginal, correlation, directions[strengths < _FLAT]


def _spread(item: Any, share: float, uncertainty: float) -> list[float]:
    return [item.at(share - uncertainty), item.at(share + uncertainty)]


def _profile(item: Any, i: int, best: FitCandidate, local: _Local,
             evaluated: Callable[[FloatArray], Any]) -> list[list[float]]:
    """
    Return cost against one parameter, the others making up for it along the linear model.

    Each point is a simulation; the others follow in one damped step, not in a search.
    """
    points = [[item.at(best.shares[i]), best.evaluation.cost]]
    others = [j for j in range(len(best.shares)) if j != i]
    slopes = local.slopes[:, others]
    normal = slopes.T @ slopes + np.eye(len(others))
    for offset in _PROFILE:
        share = best.shares[i] + offset
        if 0.0 <= share <= 1.0:
            shares = np.array(best.shares)
            shares[i] = share
            shares[others] -= np.linalg.solve(normal, slopes.T @ (local.slopes[:, i] * offset))
            points.append([item.at(share), evaluated(np.clip(shares, 0.0, 1.0)).cost])
    return sorted(points)


def _trade_off(problem: CalibrationProblem, candidates: Sequence[FitCandidate], figure: str,
               ) -> list[dict[str, Any]]:
    """
    Return what the other targets cost at best, for each level of one figure.

    Taken from everything that was tried: the more, the closer to the true curve.
    """
    others = [target for target in problem.targets if target.figure != figure]
    wanted = {target.figure for target in problem.targets}
    tried = [item.evaluation.figures for item in candidates
             if wanted <= item.evaluation.figures.keys()
             and math.isfinite(item.evaluation.figures[figure])]
    costs = np.array([sum(target.cost(figures[target.figure]) for target in others)
                      for figures in tried])
    # levels at which the others are hopeless say nothing, and would stretch the curve
    usable = np.flatnonzero(costs <= _HOPELESS * max(1.0, costs.min()))
    levels = np.array([tried[k][figure] for k in usable])
    edges = np.linspace(levels.min(), levels.max(), _TRADE_OFF_POINTS + 1)
    curve = []
    for low, high in zip(edges, edges[1:]):
        inside = usable[(levels >= low) & (levels <= high)]
        if inside.size:
            k = inside[np.argmin(costs[inside])]
            missed = [target.figure for target in others
                      if abs(target.residual(tried[k][target.figure])) > 1.0]
            curve.append({'level': tried[k][figure], 'cost_of_the_others': costs[k],
                          'missed': missed, 'figures': dict(tried[k])})
    return curve
