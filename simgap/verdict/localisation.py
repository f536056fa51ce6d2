# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where a gap lies: parts (of the effects, or of an unknown input), signals and regimes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import FloatArray
from simgap.settings import DEFAULT, LocalisationSettings
from simgap.verdict.verdict import Answer

Located = dict[str, Any]
# Places of a test at which what is loud may begin or end: their pairs are all tried.
_PLACES = 800


def of_effects(problem: LeastSquares, answers: Sequence[Answer], none: FitState,
               best: FitState) -> list[Located]:
    """Return where the effects of a verdict lie, the largest share first."""
    parts: dict[str, float] = {}
    for answer in answers:
        for effect in answer.effects:
            part = problem.machine.catalogue[effect].component
            share = answer.probability / len(answer.effects)
            parts[part] = parts.get(part, 0.0) + share
    return _located(problem, parts, lambda k: problem.of_test(none.residual, k) ** 2
                    - problem.of_test(best.residual, k) ** 2)


def of_the_unknown(problem: LeastSquares, none: FitState,
                   parts: Mapping[str, float]) -> list[Located]:
    """Return where something lies that no effect names, given how likely each part is."""
    # what slow noise could pass for is judged as it was read
    read = problem.as_stated()
    gaps = np.where(read.valid, read.residuals(none.point()), 1.0)
    found = _located(problem, parts, lambda k: gaps[read.rows(k)].reshape(
        problem.experiments[k].measured.shape) ** 2 - 1.0)
    acts = {signal: list(_acts(problem, none, signal))
            for signal in dict.fromkeys(item['signal'] for item in found)}
    return [{**item, 'acts': acts[item['signal']]} for item in found]


def _acts(problem: LeastSquares, none: FitState, signal: str) -> Iterator[dict[str, Any]]:
    """Yield when a signal's residual is loud, of tests in which that begins or ends."""
    for k, experiment in enumerate(problem.experiments):
        residual = problem.of_test(none.residual, k)[:, experiment.channels.index(signal)]
        there, regimes = np.isfinite(residual), problem.machine.motion(k).regimes()
        moves = np.array([name != 'stick' for name in regimes.names])[regimes.labels]
        span = loud_span(residual[there], moves[there], problem.settings.localisation)
        if span:
            time, (first, last) = experiment.recorded_time[there], span
            yield {'test': experiment.name, 'from_s': float(time[first]) if first else None,
                   'until_s': float(time[last]) if last < time.size else None}


def loud_span(residual: FloatArray, able: NDArray[np.bool_],
              settings: LocalisationSettings = DEFAULT.localisation) -> tuple[int, int] | None:
    """
    Return where a residual, shape (n,), begins to be loud and where that ends; None for nowhere.

    It maximises the likelihood of two variances, in the span and outside (C. Inclan, G. C. Tiao,
    JASA 89, 1994, with both ends at once). Enough of what is quiet has to be `able` to be loud.
    """
    count = residual.size
    edges = np.append(np.arange(0, count, max(-(-count // _PLACES), 1)), count)
    inside, loud, busy = (np.subtract.outer(x, x).T for x in (
        edges, *(np.append(0.0, np.cumsum(y))[edges] for y in (residual ** 2, able))))
    outside, quiet, idle = (x[0, -1] - x for x in (inside, loud, busy))
    fits = ((np.minimum(inside, idle) > settings.least_span * count)
            & (loud * outside > settings.louder * quiet * inside))
    if not fits.any():
        return None
    cost = np.full(fits.shape, np.inf)
    cost[fits] = (inside[fits] * np.log(loud[fits] / inside[fits])
                  + outside[fits] * np.log(np.maximum(quiet[fits], 1e-30) / outside[fits]))
    first, last = np.unravel_index(np.argmin(cost), cost.shape)
    return int(edges[first]), int(edges[last])


def _located(problem: LeastSquares, parts: Mapping[str, float],
             energy: Callable[[int], FloatArray]) -> list[Located]:
    """Return the shares of parts, signals and regimes, given the energy of each sample."""
    total = sum(parts.values())
    if not total:
        return []
    least = problem.settings.verdict.least_probability
    shares: dict[tuple[str, str], float] = {}
    for k, experiment in enumerate(problem.experiments):
        regimes = problem.machine.motion(k).regimes()
        sample = np.nan_to_num(energy(k))
        for c, channel in enumerate(experiment.channels):
            for r, name in enumerate(regimes.names):
                key = (channel, name)
                shares[key] = shares.get(key, 0.0) + float(sample[regimes.labels == r, c].sum())
    positive = {key: max(value, 0.0) for key, value in shares.items()}
    whole = sum(positive.values()) or 1.0
    found: list[Located] = [
        {'component': part, 'signal': signal, 'regime': regime,
         'share': weight / total * share / whole}
        for part, weight in parts.items() for (signal, regime), share in positive.items()]
    found.sort(key=lambda item: -float(item['share']))
    return [item for item in found if float(item['share']) > least]
