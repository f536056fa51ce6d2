# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How far the numbers of the model carry from one recording to the next: their reproducibility.

By how much days and specimens are off is fitted with all else, within a usual spread. The spread
itself is fitted by expectation maximisation (Dempster, Laird and Rubin, J. R. Stat. Soc. B 39, 1,
1977) about the best answer, where all is linear; the usual one counts as much as two days.
"""

from collections.abc import Iterable, Mapping, Sequence
import math
from typing import Any

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState, prior_precision, proper_precision
from simgap.machine.by_label import DAY, spread_of
from simgap.machine.contract import FloatArray, Parameter
from simgap.machine.everyday import everyday_of
from simgap.search.hypothesis import Hypothesis
from simgap.verdict.intervals import ci95, inflation, inverse, known_hessian
from simgap.verdict.spoken import number, with_interval

_USUAL_DAYS, _ROUNDS = 2.0, 50


def reproducibility(problem: LeastSquares, best: Hypothesis) -> list[dict[str, Any]]:
    """Return what is known of each number of the model, for the JSON."""
    fit = _LinearFit(problem, best.state)
    effects = {p.name for form in best.forms for p in form.parameters}
    return [fit.told(j, p) for j, p in enumerate(best.state.parameters)
            if not (p.label or p.name in effects or everyday_of(p.name))]


class _LinearFit:
    """A fit as a linear model, in which the spreads of numbers may change."""

    def __init__(self, problem: LeastSquares, state: FitState) -> None:
        self._state, self._settings = state, problem.settings
        self._known = known_hessian(state, problem.settings.interval)
        self._prior, self._inflated = prior_precision(state.parameters), inflation(problem, state)
        # where deviations are, by number and label, by value of the label
        self._places: dict[tuple[str, str], dict[str, int]] = {}
        for j, p in enumerate(state.parameters):
            if p.of and p.label:
                self._places.setdefault((p.of, p.label[0]), {})[p.label[1]] = j
        self._spreads = usual = {key: state.parameters[min(own.values())].prior_sigma
                                 for key, own in self._places.items()}
        for _ in range(_ROUNDS if usual else 0):
            values, covariance = self._with(self._spreads, float(self._inflated.mean()))
            second = values ** 2 + np.diag(covariance)
            self._spreads = {key: math.sqrt(
                (_USUAL_DAYS * usual[key] ** 2 + sum(second[j] for j in own.values()))
                / (_USUAL_DAYS + len(own))) for key, own in self._places.items()}

    def _with(self, spreads: Mapping[tuple[str, str], float],
              inflated: float) -> tuple[FloatArray, FloatArray]:
        """Return values, shape (m,), and their covariance, with other spreads of some numbers."""
        x, precision = self._state.x, self._prior.copy()
        for key, spread in spreads.items():
            precision[list(self._places[key].values())] = spread ** -2
        covariance = inverse(self._known / inflated, np.where(
            precision > 0.0, precision, proper_precision(self._state.parameters)))
        # the pulls of data and priors cancel where the fit has ended
        return x + covariance @ ((self._prior / inflated - precision) * x), covariance

    def told(self, place: int, p: Parameter) -> dict[str, Any]:
        """Return an entry of the JSON: a number of the model."""
        own = {key: places for (name, key), places in self._places.items() if name == p.name}
        inflated = float(self._inflated[[place, *(
            j for places in own.values() for j in places.values())]].max())
        values, covariance = self._with(self._spreads, inflated)
        spread = self._spreads.get((p.name, DAY), spread_of(p, DAY))
        # without labels, all tests are of one day
        once = 0.0 if DAY in own else spread

        def stated(places: Sequence[int], beyond: float = 0.0) -> dict[str, Any]:
            value = float(values[places].sum())
            return _stated(p, p.configured + value, math.hypot(
                math.sqrt(max(covariance[np.ix_(places, places)].sum(), 0.0)), beyond,
                self._settings.noise.model_error * value))

        apart = {key: self._apart(p, key, inflated) for key in own}
        owners = {1.0: 'machine' if p.experiment is None else 'test',
                  **{clear: key for key, (clear, *_) in apart.items()}}
        return {
            'number': p.name, 'belongs_to': owners[max(owners)],
            **stated([place], once), 'spread': spread,
            'another_day': stated([place], math.hypot(once, spread))['ci95'],
            'by': {key: {value: stated([place, j]) for value, j in places.items()}
                   for key, places in own.items()},
            'differs': {key: entry for key, (_, ratio, entry) in apart.items() if ratio > 1.0}}

    def _apart(self, p: Parameter, key: str, inflated: float) -> tuple[float, float, Any]:
        """Return how clearly a number is off under a value, and beyond days, above 1, and that."""
        # estimated freely, beside all others within their spreads
        values, covariance = self._with({(p.name, key): p.high - p.low}, inflated)
        usual = spread_of(p, DAY) if key == DAY or (p.name, DAY) not in self._places else 0.0
        # each comparison is one of many
        many = math.log(sum(map(len, self._places.values())))
        worth = 2.0 * (self._settings.evidence.number + many)
        own, found = self._places[p.name, key], []
        for value, j in own.items():
            contrast = np.where(np.arange(values.size) == j, 1.0, 0.0)
            contrast[[i for i in own.values() if i != j]] = -1.0 / (len(own) - 1)
            off = float(contrast @ values)
            variance = max(float(contrast @ covariance @ contrast), 1e-12 * (p.high - p.low) ** 2)
            beyond = variance + usual ** 2 * float(contrast @ contrast)
            found.append((off ** 2 / variance / worth, off ** 2 / beyond / worth,
                          {'under': value, **_stated(p, off, math.sqrt(variance))}))
        # of two values the later one is off the other
        return max(reversed(found), key=lambda item: item[0])


def _stated(p: Parameter, value: float, deviation: float) -> dict[str, Any]:
    return {'value': value, 'unit': p.unit, 'ci95': ci95(value, deviation)}


def contradictions(entries: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return in what recordings contradict each other, a clause for each number."""
    return [f'{item["number"]} is off by {with_interval(one)} under {key} '
            f'{one["under"] or "not given"}'
            for item in entries for key, one in item['differs'].items()]


def lines(entries: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return whose the numbers are, as people read it; nothing without days and specimens."""
    return [f'{item["number"]}, of the {item["belongs_to"]}: {with_interval(item)}, '
            f'on another day {" to ".join(map(number, item["another_day"]))}'
            for item in entries if item['by']]
