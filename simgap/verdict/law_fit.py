# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A law as a hypothesis: it acts in the simulation, and is judged as an effect of the catalogue is.

A function that the machine's own equations have room for acts within the loop: a friction that it
adds can stick. It is fitted as an effect is, beside the best hypothesis and beside none. Any other
law is a course of an input, computed again from the motion that it makes, and fitted at white
noise, because slow noise takes a gap for its own. The one that fits best is compared with the best
hypothesis at the noise that the better of them leaves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from simgap.fit.broyden import Jacobian
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_model_error, with_noise_left
from simgap.machine.contract import Learnable, Machine, Point
from simgap.machine.with_law import FARTHEST, Law, WithLaw
from simgap.search import moves
from simgap.search.evidence import Evidence
from simgap.search.hypothesis import Hypothesis
from simgap.search.screening import Sensitivity
from simgap.search.search import Found
from simgap.settings import IntervalSettings
from simgap.verdict.held_out import held_out
from simgap.verdict.input_evidence import InputEvidence
from simgap.verdict.intervals import covariance
from simgap.verdict.law import predicted, quantities_of, REACHED
from simgap.verdict.unknown_input import Place, readings_of

# A law moves the machine, and so what it is a function of.
_ROUNDS = 2
# So many of the likeliest laws are fitted beside each hypothesis.
_FITTED = 2

_Tried = tuple[Machine, Place, Hypothesis]  # a law that was fitted, as the last effect


@dataclass(frozen=True)
class LawfulFit:
    """The likeliest law beside the best hypothesis, and how much more it makes likely."""

    place: Place  # with the law as it was fitted, where the motion reaches it
    gained: float  # evidence beyond the best of the catalogue and what shows a law
    law: Law  # with all its places, as it was begun with
    machine: Machine
    hypothesis: Hypothesis  # the best one with the law, whose values are those of its last form


def lawful_fit(found: Found, places: Sequence[Place], threads: int = 1) -> LawfulFit | None:
    """Return the likeliest law of all places, in the fit; None if none promises its price."""
    settings, price = found.problem.settings, found.evidence.price
    tried = _learnt(found) if found.problem.machine.learnable else _entering(found, places)
    best = min(tried, key=lambda law: law[2].cost + price(law[2].forms), default=None)
    if best is None:
        return None
    machine, place, law = best
    # all are compared at the noise that the law leaves, with the error that every model has
    left = with_noise_left(machine, law.state.point(), settings.noise,
                           settings.noise.greatest_level)
    problem = LeastSquares(left.with_experiments(with_model_error(
        left.experiments, settings.noise)), settings=settings)
    law = replace(law, state=problem.fit(problem.start(
        law.state.parameters, law.state.point()), settings.search.iterations))
    for effect in law.effects[:-1]:  # what the law does is not done again
        law = max((law, moves.dropped(problem, law, effect)), key=Evidence.among(problem, [law]))
    slopes = law.state.jacobian[:, :len(problem.machine.nuisances)]
    rivals = [moves.refitted(problem, h, law, slopes) for h in (
        [found.best, found.none] if found.best.effects else [found.best])]
    evidence = Evidence.among(problem, [law, *rivals])
    gained = evidence(law) - max(map(evidence, rivals)) - settings.evidence.shows
    withheld = held_out(problem, rivals[-1], law, threads)['explained_fraction']['value'] if (
        gained > 0.0) else None
    # beside what is named a law explains what is left of the gap, in its place the gap
    without = rivals[0] if set(found.best.effects) < set(law.effects) else rivals[-1]
    assert place.law is not None
    return LawfulFit(replace(
        place, evidence=place.law.evidence, explained=max(1.0 - law.cost / without.cost, 0.0),
        law=_as_fitted(place.law, law, machine, gained, withheld, settings.interval)),
        gained, place.law, machine, law)


def _promised(problem: LeastSquares, base: Hypothesis, point: Point,
              learnable: Sequence[tuple[Learnable, Jacobian]]) -> list[tuple[Place, Sensitivity]]:
    """Return the laws that may act at a point of a hypothesis, the likeliest first."""
    evidence, count = InputEvidence.at(problem, point, base.state.jacobian[
        :, :len(problem.machine.nuisances)]), len(problem.experiments)
    laws = []
    for item, columns in learnable:
        [form], effect = item.effect.forms, item.effect
        scaled = columns.astype(float) * (step := form.parameters[0].step)
        square, slope = evidence.reduced([scaled[problem.rows(k)] for k in range(count)])
        same = np.tile(np.eye(len(form.parameters)), (count, 1))  # its values in all tests
        square, slope = same.T @ square @ same, same.T @ slope
        if (size := float(np.trace(square)) / len(square)) <= 0.0:
            continue
        found = evidence.weighed(square, slope, size)
        spread = max(found.spread, 1e-9) * step
        law = Law(item.by, '', found.evidence, item.at, (), (), item.by_unit,
                  form.parameters[0].unit, item.at[1] - item.at[0], spread, walks=True)
        numbers = tuple(replace(p, low=-FARTHEST * spread, high=FARTHEST * spread,
                                step=0.1 * spread, prior_sigma=spread, start=step * factor)
                        for p, factor in zip(form.parameters, found.factors.tolist(), strict=True))
        laws.append((Place(effect.cause, effect.component, found.evidence,
                           evidence.net(found.evidence), law),
                     Sensitivity(effect.id, replace(form, parameters=numbers), columns)))
    return sorted(laws, key=lambda law: -law[0].evidence)


def _learnt(found: Found) -> Iterator[_Tried]:
    """Yield the likeliest laws within the loop: beside the best and none, and for its effects."""
    problem, machine, evidence = found.problem, found.problem.machine, found.evidence
    best = found.best.with_jacobian(problem)
    point = best.state.point()
    learnable = [(item, problem.jacobian(
        point, item.effect.forms[0].parameters, best.state.residual, central=False))
        for item in machine.learnable]
    for base in [best, found.none][:1 + bool(best.effects)]:
        base = base.with_jacobian(problem)
        # a fit may exceed its promise, as in the search
        least = (evidence(best) - evidence(base)) / problem.settings.search.hope
        for place, item in _promised(problem, base, base.state.point(), learnable)[:_FITTED]:
            if place.evidence > max(evidence.price([item.form]), least):
                # where it is strong, its derivatives at nothing say little
                begin = min((dict.fromkeys(item.form.start, 0.0), item.form.start),
                            key=lambda sizes: problem.loss(problem.residuals(
                                {**base.state.point(), **sizes})))
                yield machine, place, moves.added(problem, base, item, begin)
    for effect in best.effects if best.effects[1:] else ():  # a law pays one price for several
        gone, part = best.parameters_of([effect]), machine.catalogue[effect].component
        rest = {name: value for name, value in point.items() if name not in gone}
        for place, item in _promised(problem, best, rest, [
                law for law in learnable if law[0].effect.component == part])[:1]:
            law = moves.exchanged(problem, best, effect, item.effect, item.form)
            yield machine, place, moves.settled(problem, law, problem.settings.search.passes)


def _entering(found: Found, places: Sequence[Place]) -> Iterator[_Tried]:
    """Yield the likeliest laws of inputs that pay, fitted beside the best hypothesis."""
    problem, price = found.problem.as_stated(), found.evidence.price
    problem = problem.at_noise(problem.noise_level(problem.residuals(found.best.state.point())))
    laws = [(place.law, place) for place in places if place.law]
    for law, place in sorted(laws, key=lambda item: -item[0].evidence)[:_FITTED]:
        if law.evidence >= price([law.as_form()]):
            yield _entered(problem, found.best, place, law)


def _entered(problem: LeastSquares, best: Hypothesis, place: Place, law: Law) -> _Tried:
    """Return a law of an input, fitted beside the best hypothesis."""
    source = next(item for item in (*problem.machine.disturbance_inputs, *readings_of(problem))
                  if item.name == place.name)
    effect = law.as_effect(source)
    form, lawful, state = effect.forms[0], problem, problem.start(
        best.state.parameters, best.state.point())
    begun, point = state, {**state.point(), **form.start}
    for _ in range(_ROUNDS):
        machine = WithLaw(problem.machine, effect, source, [
            own / source.size for own in law.weights(quantities_of(
                lawful.machine, predicted(lawful.machine, state.point())))])
        lawful = problem.of(machine, problem.scale)
        # one-sided: each difference runs all tests
        columns = lawful.jacobian(point, form.parameters, lawful.residuals(point), central=False)
        state = lawful.fit(lawful.start(
            (*begun.parameters, *form.parameters), point,
            np.column_stack([begun.jacobian, columns])), problem.settings.search.iterations)
        point = state.point()
    return machine, place, Hypothesis(
        (*best.effects, effect.id), (*best.forms, form), state)


def _as_fitted(law: Law, found: Hypothesis, machine: Machine, gained: float,
               withheld: float | None, settings: IntervalSettings) -> Law:
    """Return a law as it was fitted, where the motion that it makes has reached it."""
    state, shapes = found.state, law.shapes
    own = np.flatnonzero([p in found.forms[-1].parameters for p in state.parameters])
    known = covariance(state, 1.0, settings)[np.ix_(own, own)]
    values, spread = shapes @ state.x[own], np.sqrt(np.sum((shapes @ known) * shapes, axis=1))
    reached = machine.reached if isinstance(machine, WithLaw) else (
        np.abs(state.base_jacobian[:, own]).max(axis=0))
    there = np.ones(len(values), bool) if law.orders else reached > REACHED * reached.max()
    return replace(law, evidence=gained, at=tuple(np.array(law.at)[there].tolist()),
                   values=tuple(values[there].tolist()),
                   deviations=tuple(spread[there].tolist()), withheld=withheld)
