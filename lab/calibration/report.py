# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a fit has found, as a configuration, and how well it determines the parameters.

Near the best candidate each target's miss, in tolerances, is taken as linear in the
parameters. The uncertainty of a parameter is the move that makes the targets miss by one
tolerance: alone (conditional), or while all other parameters compensate for it (marginal).
"""

from collections.abc import Callable, Sequence
from itertools import count
import math
from typing import Any

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters.loading import find
from antenna_drive.yaml_text import dump_yaml
from lab.calibration.problem import CalibrationProblem
from lab.calibration.search import FitCandidate, SearchResult
import numpy as np
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import nearest, ParameterError

# Half the step of the difference quotient, as a share of the bounds; wider than the jumps of
# settling times.
_HALF_STEP = 0.01
# Distances of the profile's points from the best candidate, as shares of the bounds.
_PROFILE = (-0.1, -0.05, -0.02, 0.02, 0.05, 0.1)
# A direction is flat if the targets change by fewer tolerances than this over the whole range.
_FLAT = 0.3
# Marginal uncertainty, as a share of the bounds, up to which a parameter counts as determined.
_DETERMINED = 0.05
# Correlations from this size on are reported.
_CORRELATED = 0.8
_TRADE_OFF_POINTS = 12
# Candidates that cost this many times the least are left out of a trade-off.
_HOPELESS = 30.0
# Significant digits of a fitted number: more than any figure determines.
_DIGITS = 7


def report(problem: CalibrationProblem, found: SearchResult, trade_offs: Sequence[str] = (),
           progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """
    Report the best candidate and how well its parameters are determined.

    problem : the fit
    found : result of the search
    trade_offs : target figures for which to show the cost of the other targets
    progress : called with the share that is done, 0 to 1

    Returns a mapping of cost, candidates, targets, parameters, correlations, flat_directions,
    trade_offs.

    Raises ParameterError: a trade-off names a figure that is not a target.
    """
    known = tuple(target.figure for target in problem.targets)
    for figure in trade_offs:
        if figure not in known:
            raise ParameterError(f'--trade-off {figure}: no such target{nearest(figure, known)}')
    best, size = found.best, len(problem.free)
    total, done = 2 * size + size * len(_PROFILE), count(1)

    def evaluated(shares: FloatArray) -> Any:
        evaluation = problem.evaluate([float(share) for share in shares])
        if progress:
            progress(next(done) / total)
        return evaluation

    slopes = _slopes(problem, best, evaluated)
    conditional, marginal, correlation, flat = _uncertainties(slopes)
    return {
        'cost': best.evaluation.cost,
        'start_cost': found.candidates[0].evaluation.cost,
        'candidates': len(found.candidates) - 1,
        'targets': _targets(problem, best, found.candidates[0]),
        'parameters': [
            {'name': item.name, 'unit': item.unit, 'value': item.at(share),
             'conditional': _spread(item, share, conditional[i]),
             'marginal': _spread(item, share, marginal[i]),
             'determined': bool(marginal[i] <= _DETERMINED),
             'at_bound': bool(min(share, 1.0 - share) < 0.01),
             'profile': _profile(item, i, best, slopes, evaluated)}
            for i, (item, share) in enumerate(zip(problem.free, best.shares, strict=True))],
        **_common([item.name for item in problem.free], correlation, flat),
        'trade_offs': {figure: _trade_off(problem, found.candidates, figure)
                       for figure in trade_offs},
    }


def _common(names: Sequence[str], correlation: FloatArray, flat: FloatArray) -> dict[str, Any]:
    """Return which parameters are correlated, and which combinations the targets do not see."""
    return {
        'correlations': [
            {'first': names[i], 'second': names[j], 'correlation': correlation[i, j]}
            for i in range(len(names)) for j in range(i)
            if abs(correlation[i, j]) >= _CORRELATED],
        'flat_directions': [
            {names[i]: float(direction[i]) for i in np.argsort(-np.abs(direction))[:4]}
            for direction in flat]}


def _targets(problem: CalibrationProblem, best: FitCandidate, start: FitCandidate,
             ) -> list[dict[str, Any]]:
    rows = []
    for target in problem.targets:
        obtained = best.evaluation.figures[target.figure]
        rows.append({
            'figure': target.figure, 'unit': problem.figure(target.figure).unit,
            'kind': target.kind, 'aim': target.number, 'tolerance': target.tolerance,
            'start': start.evaluation.figures[target.figure], 'obtained': obtained,
            'met': bool(abs(target.residual(obtained)) <= 1.0)})
    return rows


def _misses(problem: CalibrationProblem, figures: Any) -> FloatArray:
    """
    Return each target's signed miss in tolerances, times the root of its weight.

    A bound that is kept counts as no miss.
    """
    return np.array([math.sqrt(target.weight) * target.residual(figures[target.figure])
                     for target in problem.targets])


def _slopes(problem: CalibrationProblem, best: FitCandidate,
            evaluated: Callable[[FloatArray], Any]) -> FloatArray:
    """Return the slopes of the misses at the best candidate, per share of the bounds."""
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
    return np.column_stack(columns)


def _uncertainties(slopes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return conditional and marginal uncertainty, correlation, and the flat directions."""
    _, strengths, directions = np.linalg.svd(slopes)
    strengths = np.pad(strengths, (0, slopes.shape[1] - strengths.size))
    norms = np.linalg.norm(slopes, axis=0)
    conditional = 1.0 / np.maximum(norms, 1.0)
    # only the bounds limit a direction that does not affect the targets
    variance = 1.0 / np.maximum(strengths, 1.0) ** 2
    covariance = (directions.T * variance) @ directions
    marginal = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(marginal, marginal)
    return conditional, marginal, correlation, directions[strengths < _FLAT]


def _spread(item: Any, share: float, uncertainty: float) -> list[float]:
    return [item.at(share - uncertainty), item.at(share + uncertainty)]


def _profile(item: Any, i: int, best: FitCandidate, slopes: FloatArray,
             evaluated: Callable[[FloatArray], Any]) -> list[list[float]]:
    """
    Return cost against one parameter while the others compensate by the linear model.

    Each point is one simulation, after one damped step of the other parameters.
    """
    points = [[item.at(best.shares[i]), best.evaluation.cost]]
    others = [j for j in range(len(best.shares)) if j != i]
    of_others = slopes[:, others]
    normal = of_others.T @ of_others + np.eye(len(others))
    for offset in _PROFILE:
        share = best.shares[i] + offset
        if 0.0 <= share <= 1.0:
            shares = np.array(best.shares)
            shares[i] = share
            shares[others] -= np.linalg.solve(normal, of_others.T @ (slopes[:, i] * offset))
            points.append([item.at(share), evaluated(np.clip(shares, 0.0, 1.0)).cost])
    return sorted(points)


def _trade_off(problem: CalibrationProblem, candidates: Sequence[FitCandidate], figure: str,
               ) -> list[dict[str, Any]]:
    """
    Return the least cost of the other targets for each level of one figure.

    The curve is an upper bound from all candidates tried; more candidates lower it.
    """
    others = [target for target in problem.targets if target.figure != figure]
    wanted = {target.figure for target in problem.targets}
    tried = [item.evaluation.figures for item in candidates
             if wanted <= item.evaluation.figures.keys()
             and math.isfinite(item.evaluation.figures[figure])]
    costs = np.array([sum(target.cost(figures[target.figure]) for target in others)
                      for figures in tried])
    # hopeless levels would only stretch the curve
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


def configuration(problem: CalibrationProblem, shares: Sequence[float], start: str) -> str:
    """
    Return a candidate as a configuration file that overrides the start of the fit.

    problem : the fit
    shares : the candidate, as shares of the bounds
    start : configuration that the fit started from; its other parameters are kept
    """
    content: dict[str, Any] = {}
    if find(start) != find('reference'):
        content = dict(read_yaml(find(start)) or {})
    units = {item.key: item.unit for item in problem.free}
    for key, value in problem.parameters(shares).items():
        section, _, entry = key.partition('.')
        numbers = [_rounded(item) for item in value] if isinstance(value, tuple) else (
            _rounded(value))
        body = dict(content.get(section) or {})
        body[entry] = {'value': numbers, 'unit': units[key], 'source': 'fitted'}
        content[section] = body
    return dump_yaml(content, default_flow_style=None, width=10_000)


def _rounded(value: float) -> float:
    return float(f'{value:.{_DIGITS}g}')
