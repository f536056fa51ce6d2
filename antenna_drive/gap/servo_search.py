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
What a servo's model lacks, one effect after the other, each judged on withheld tests.

Begun from a motor with Coulomb and viscous friction alone. In each round the numbers so far are
fitted, the generic search ranks what could be added, and the likeliest are tried out: fitted to
a part of the tests and judged on the rest, each gain and each trajectory withheld once. The best
stays if it lowers that error by more than `WORTH`; else the search is over. Nothing but the
given tests takes part in any choice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from antenna_drive.gap import servo_refit, verdict
from antenna_drive.gap.fit import Problem
from antenna_drive.gap.search import Candidate, Search
from antenna_drive.gap.servo_catalogue import BASE, vector
from antenna_drive.gap.servo_model import ServoModel, ServoTest
from antenna_drive.gap.servo_refit import Fit
import numpy as np

Progress = Callable[[float, str], None]
# Each round must lower the withheld error by such a share.
WORTH = 0.02
ROUNDS = 8
# What is tried out of the verdict's ranking, pairs among it, and of all single effects.
TRIED_RANKED, TRIED_SINGLES = 2, 7
TURNS = 5


@dataclass(frozen=True)
class Effort:
    """
    How long is searched.

    Attributes
    ----------
    runs : of all tests, for one global fit
    near_runs : of all tests, for a fit from where a simpler model is

    """

    runs: int = 2000
    near_runs: int = 600


@dataclass(frozen=True)
class Fold:
    """A part of the tests that is fitted, and the rest, on which the fit is judged."""

    fitted: tuple[ServoTest, ...]
    withheld: tuple[ServoTest, ...]


@dataclass(frozen=True)
class Found:
    """
    What a model lacked.

    Attributes
    ----------
    names : the numbers of the model that is reached
    fit : their values
    rounds : for each round its ranking and what was added, as plain data

    """

    names: tuple[str, ...]
    fit: Fit
    rounds: list[dict[str, Any]]


def folds(tests: Sequence[ServoTest]) -> list[Fold]:
    """Return folds that withhold each gain once and each trajectory once, where others are."""
    found = []
    for key in ('kp', 'trajectory'):
        levels = list(dict.fromkeys(getattr(test, key) for test in tests))
        for level in levels if len(levels) > 1 else []:
            found.append(Fold(tuple(t for t in tests if getattr(t, key) != level),
                              tuple(t for t in tests if getattr(t, key) == level)))
    return found


def lacking(tests: Sequence[ServoTest], effort: Effort, without: Sequence[str] = (),
            progress: Progress = lambda share, doing: None) -> Found:
    """
    Find what the model of a motor with Coulomb and viscous friction lacks.

    Parameters
    ----------
    tests
        of one servo, with two gains or trajectories at least
    effort
        how long is searched
    without
        effects that are not considered
    progress
        called with the share that is done, 0 to 1, and what is being done

    """
    parts = folds(tests)
    names: tuple[str, ...] = BASE
    fit = servo_refit.refit(tests, names, (), effort.runs)
    scale = _scale(tests, fit)
    kept = [settled(part.fitted, names, fit.values, scale) for part in parts]
    judged = _judged(parts, kept)
    rounds: list[dict[str, Any]] = []
    for turn in range(ROUNDS):
        progress(turn / ROUNDS, 'what the model lacks')
        scale = _scale(tests, fit)
        problem = Problem(ServoModel(tests, fit.values, names, without, scale))
        candidates = Search(problem, lambda share, doing: None).run()
        ranked = verdict.rank(candidates, 0.0)
        likeliest = _likeliest([r.candidate for r in ranked], _singles(problem))
        trials = [_tried(parts, kept, names, c, scale) for c in likeliest]
        errors = [_judged(parts, fits) for fits in trials]
        report: dict[str, Any] = {
            'withheld_mrad_before': 1e3 * judged,
            'ranked': [{'effects': list(r.candidate.effects), 'probability': r.probability}
                       for r in ranked[:6]],
            'confusable': verdict.confusable(candidates),
            'tried': [{'effects': list(c.effects), 'forms': [f.name for f in c.forms],
                       'withheld_mrad': 1e3 * e}
                      for c, e in zip(likeliest, errors, strict=True)],
            'added': None,
        }
        rounds.append(report)
        if not errors or min(errors) > (1.0 - WORTH) * judged:
            break
        k = int(np.argmin(errors))
        best = likeliest[k]
        judged, kept = errors[k], trials[k]
        start = {**fit.values, **_values(best)}
        names = (*names, *_new(names, best))
        fit = servo_refit.nearby(tests, names, start, effort.near_runs)
        report['added'] = list(best.effects)
        report['forms'] = [form.name for form in best.forms]
        report['withheld_mrad_after'] = 1e3 * judged
    progress(1.0, 'what the model lacks')
    return Found(names, fit, rounds)


def _scale(tests: Sequence[ServoTest], fit: Fit) -> list[float]:
    """Return the scale of what a fit leaves in position, speed and duty, a sensor's step at least."""
    row = vector(fit.values)
    left = np.concatenate([test.measured - test.readings(row) for test in tests])
    steps = np.max([test.steps for test in tests], axis=0)
    scale: list[float] = np.maximum(1.4826 * np.median(np.abs(left), axis=0), steps).tolist()
    return scale


def _singles(problem: Problem) -> list[Candidate]:
    """Return every single effect in its best form, after a few turns, the best first."""
    state = problem.fit(problem.start(problem.model.nuisances, {}), TURNS)
    found = []
    for effect in problem.model.effects.values():
        forms = []
        for form in effect.forms:
            values = [p.start for p in form.parameters]
            # what its shape does shows once the effect is there: a little of it
            point = {**state.point(), **{p.name: p.start if p.shape else 0.0
                                         for p in form.parameters}}
            columns = problem.columns(point, form.parameters, state.residual, central=False)
            wider = problem.widened(state, form.parameters, values, columns)
            forms.append(Candidate((effect.id,), (form,), problem.fit(wider, TURNS)))
        found.append(min(forms, key=lambda c: c.cost))
    return sorted(found, key=lambda c: c.cost)


def _likeliest(ranked: Sequence[Candidate], singles: Sequence[Candidate]) -> list[Candidate]:
    """Return what is tried out: the likeliest of the verdict, and the best single effects."""
    chosen = [c for c in ranked if c.effects][:TRIED_RANKED]
    known = {c.effects for c in chosen}
    return chosen + [c for c in singles if c.effects not in known][:TRIED_SINGLES]


def _new(names: Sequence[str], candidate: Candidate) -> tuple[str, ...]:
    added = [p.name for form in candidate.forms for p in form.parameters]
    return tuple(dict.fromkeys(name for name in added if name not in names))


def _values(candidate: Candidate) -> dict[str, float]:
    """Return where the candidate's own numbers came to lie."""
    point = candidate.state.point()
    return {p.name: point[p.name] for form in candidate.forms for p in form.parameters}


def _tried(parts: Sequence[Fold], kept: Sequence[Fit], names: Sequence[str],
           candidate: Candidate, scale: Sequence[float]) -> list[Fit]:
    """Fit a candidate to each fold, from where the fold's simpler model is."""
    everything = (*names, *_new(names, candidate))
    return [settled(part.fitted, everything, {**before.values, **_values(candidate)}, scale)
            for part, before in zip(parts, kept, strict=True)]


def settled(tests: Sequence[ServoTest], names: Sequence[str], start: Mapping[str, float],
            scale: Sequence[float]) -> Fit:
    """
    Fit numbers by robust least squares from where they are.

    Parameters
    ----------
    tests
        that are fitted
    names
        what is fitted
    start
        values of all of them
    scale
        that residuals are measured by, in position, speed and duty

    """
    model = ServoModel(tests, start, names, noise=scale)
    problem = Problem(model)
    state = problem.fit(problem.start(model.nuisances, {}), 2 * TURNS)
    state = problem.fit(problem.refreshed(state), TURNS)
    values = model.numbers(state.point())
    return Fit(values, servo_refit.error(tests, values))


def _judged(parts: Sequence[Fold], fits: Sequence[Fit]) -> float:
    """Return the mean error of folds on what they withheld [rad]."""
    return float(np.mean([servo_refit.error(part.withheld, fit.values)
                          for part, fit in zip(parts, fits, strict=True)]))


def plain(values: Mapping[str, float]) -> dict[str, float]:
    """Return values as plain data, in a stable order."""
    return {name: float(value) for name, value in sorted(values.items())}
