# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a servo's model lacks: forward selection of effects, judged by cross-validation.

The search starts from a motor with Coulomb and viscous friction. In each round the numbers are
fitted, the engine ranks the effects that could be added, and the likeliest are tried: fitted to a
part of the logs and judged on the rest, so that each log is withheld once. The best is added if
it lowers the withheld error by more than its price. Effects that it makes superfluous are
removed. The search ends when no effect is worth its price. No other log takes part in any choice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lab.servo import refit as servo_refit
from lab.servo.catalogue import BASE, catalogue, vector
from lab.servo.log import ServoLog
from lab.servo.machine import ServoMachine
from lab.servo.ranking import rank_hypotheses
from lab.servo.refit import Fit
import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.search.hypothesis import Hypothesis

Progress = Callable[[float, str], None]
# The effects of a model with the names of their forms, in the order in which they were added.
Structure = tuple[tuple[str, str], ...]
# Share of the withheld error by which each new number must lower it.
PRICE_PER_NUMBER = 0.01
ROUNDS = 7
# How many hypotheses of the ranking (pairs among them) and how many single effects are tried.
TRIED_RANKED, TRIED_SINGLES = 2, 7
ITERATIONS = 5


@dataclass(frozen=True)
class FitEffort:
    """How long is searched."""

    runs: int = 2400        # of all tests, for one global fit
    near_runs: int = 500    # of all tests, for a fit from where a simpler model is


@dataclass(frozen=True)
class Fold:
    """The logs that are fitted, and the others, on which the fit is judged."""

    fitted: tuple[ServoLog, ...]
    withheld: tuple[ServoLog, ...]


@dataclass(frozen=True)
class Found:
    """What a model lacked."""

    effects: tuple[str, ...]        # what was added and stayed
    names: tuple[str, ...]          # the numbers of the model that is reached
    fit: Fit                        # their values
    rounds: list[dict[str, Any]]    # of each its ranking and what was added, as plain data


def folds(tests: Sequence[ServoLog]) -> list[Fold]:
    """Return folds that withhold each test once, with none of its gain or trajectory beside it."""
    gains = sorted({test.kp for test in tests})
    trajectories = sorted({test.trajectory for test in tests})
    count = max(len(gains), len(trajectories), 2)
    turn = [(gains.index(test.kp) + trajectories.index(test.trajectory)) % count for test in tests]
    parts = [Fold(tuple(t for t, k in zip(tests, turn, strict=True) if k != i),
                  tuple(t for t, k in zip(tests, turn, strict=True) if k == i))
             for i in range(count)]
    return [part for part in parts if part.fitted and part.withheld]


def lacking(tests: Sequence[ServoLog], effort: FitEffort, without: Sequence[str] = (),
            progress: Progress = lambda share, doing: None) -> Found:
    """
    Find what the model of a motor with Coulomb and viscous friction lacks.

    Tests are of one servo, with two gains or trajectories at least. Effects in `without` are not
    considered. `progress` gets the share that is done, 0 to 1, and what is being done.
    """
    parts = folds(tests)
    structure: Structure = ()
    fit = servo_refit.refit(tests, BASE, (), effort.runs)
    rounds: list[dict[str, Any]] = []
    for turn in range(ROUNDS):
        progress(turn / ROUNDS, 'what the model lacks')
        scale = _scale(tests, fit)
        judged = _judged(parts, structure, fit.values, scale)
        problem = LeastSquares(ServoMachine(tests, fit.values, numbers(structure), without, scale))
        ranking = rank_hypotheses(problem.machine)
        likeliest = _likeliest([answer.hypothesis for answer in ranking.answers],
                               _singles(problem))
        trials = [_Trial.of(c, structure, fit.values, parts, scale) for c in likeliest]
        rounds.append({
            'withheld_mrad': 1e3 * judged,
            'ranked': [{'effects': list(answer.effects),
                        'probability': answer.probability} for answer in ranking.answers[:6]],
            'confusable': ranking.confusable,
            'tried': [{'effects': list(c.effects), 'forms': [f.name for f in c.forms],
                       'withheld_mrad': 1e3 * trial.judged}
                      for c, trial in zip(likeliest, trials, strict=True)],
            'added': [], 'dropped': [],
        })
        if not trials:
            break
        best = min(trials, key=lambda trial: trial.priced)
        if best.priced > judged:
            break
        before, structure = structure, best.structure
        rounds[-1]['added'] = [effect for effect, _ in structure[len(before):]]
        fit = servo_refit.nearby(tests, numbers(structure), best.values, effort.near_runs)
        structure, rounds[-1]['dropped'] = _shortened(parts, structure, fit.values, scale)
        if rounds[-1]['dropped']:
            fit = servo_refit.nearby(tests, numbers(structure), fit.values, effort.near_runs)
        if set(structure) <= set(before):
            break
    progress(1.0, 'what the model lacks')
    return Found(tuple(effect for effect, _ in structure), numbers(structure), fit, rounds)


@dataclass(frozen=True)
class _Trial:
    """A model with a candidate's effects, judged on what folds withhold."""

    structure: Structure        # all its effects
    values: dict[str, float]    # of its numbers, where a fit may begin
    judged: float               # mean error on what was withheld [rad]
    priced: float               # the same with the price of what is new [rad]

    @classmethod
    def of(cls, candidate: Hypothesis, structure: Structure, values: Mapping[str, float],
           parts: Sequence[Fold], scale: Sequence[float]) -> _Trial:
        point = candidate.state.point()
        own = {p.name: point[p.name] for form in candidate.forms for p in form.parameters}
        wider = (*structure, *zip(candidate.effects, (form.name for form in candidate.forms),
                                  strict=True))
        start = {**values, **own}
        judged = _judged(parts, wider, start, scale)
        return cls(wider, start, judged, judged * (1.0 + PRICE_PER_NUMBER * len(own)))


def numbers(structure: Structure) -> tuple[str, ...]:
    """Return the numbers of a model with these effects."""
    effects = catalogue()
    own = [p.name for effect, form in structure
           for known in effects[effect].forms if known.name == form for p in known.parameters]
    return tuple(dict.fromkeys((*BASE, *own)))


def _judged(parts: Sequence[Fold], structure: Structure, start: Mapping[str, float],
            scale: Sequence[float]) -> float:
    """Return the mean error of the folds on their withheld logs [rad]."""
    names = numbers(structure)
    return float(np.mean([servo_refit.error(
        part.withheld, settled(part.fitted, names, start, scale).values) for part in parts]))


def _shortened(parts: Sequence[Fold], structure: Structure, values: Mapping[str, float],
               scale: Sequence[float]) -> tuple[Structure, list[str]]:
    """Return the effects that are worth their numbers, and the names of those dropped."""
    worth, dropped = _judged(parts, structure, values, scale), []
    for piece in structure:
        shorter = tuple(p for p in structure if p != piece)
        price = 1.0 + PRICE_PER_NUMBER * (len(numbers(structure)) - len(numbers(shorter)))
        bare = _judged(parts, shorter, values, scale)
        if bare <= price * worth:
            dropped.append(piece[0])
            structure, worth = shorter, bare
    return structure, dropped


def _scale(tests: Sequence[ServoLog], fit: Fit) -> list[float]:
    """Return the scale of the residual in each channel, at least a step of the sensor."""
    row = vector(fit.values)
    left = np.concatenate([test.measured - test.readings(row) for test in tests])
    steps = np.max([test.steps for test in tests], axis=0)
    scale: list[float] = np.maximum(1.4826 * np.median(np.abs(left), axis=0), steps).tolist()
    return scale


def _singles(problem: LeastSquares) -> list[Hypothesis]:
    """Return every single effect in its best form, after a few iterations, the best first."""
    state = problem.fit(problem.start(problem.machine.nuisances, {}), ITERATIONS)
    found = []
    for effect in problem.machine.catalogue.values():
        forms = []
        for form in effect.forms:
            # the derivatives are taken where every size is zero, and shapes are at their start
            point = {**state.point(), **form.start}
            columns = problem.jacobian({**state.point(), **{
                p.name: p.start if p.is_shape else 0.0 for p in form.parameters}},
                form.parameters, state.residual, central=False)
            wider = problem.start((*state.parameters, *form.parameters), point,
                                  np.column_stack([state.jacobian, columns]))
            forms.append(Hypothesis((effect.id,), (form,), problem.fit(wider, ITERATIONS)))
        found.append(min(forms, key=lambda c: c.cost))
    return sorted(found, key=lambda c: c.cost)


def _likeliest(ranked: Sequence[Hypothesis], singles: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the hypotheses to try: the likeliest ones, and the best single effects."""
    chosen = [c for c in ranked if c.effects][:TRIED_RANKED]
    known = {c.effects for c in chosen}
    return chosen + [c for c in singles if c.effects not in known][:TRIED_SINGLES]


def settled(tests: Sequence[ServoLog], names: Sequence[str], start: Mapping[str, float],
            scale: Sequence[float]) -> Fit:
    """
    Fit the numbers `names` by robust least squares from `start`.

    Residuals in position, speed and duty are measured by `scale`.
    """
    model = ServoMachine(tests, {name: start[name] for name in names}, names, noise=scale)
    problem = LeastSquares(model)
    state = problem.fit(problem.start(model.nuisances, {}), ITERATIONS)
    state = problem.fit(problem.refreshed(state), ITERATIONS)
    values = model.numbers(state.point())
    return Fit(values, servo_refit.error(tests, values))


def plain(values: Mapping[str, float]) -> dict[str, float]:
    """Return values as plain data, in a stable order."""
    return {name: float(value) for name, value in sorted(values.items())}
