# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One fit of the search: an effect is added to a hypothesis, moved to another place, or split."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from simgap.fit.broyden import Jacobian
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import Effect, Form, Point
from simgap.search.hypothesis import Hypothesis
from simgap.search.screening import Sensitivity

Item = TypeVar('Item')


def added(problem: LeastSquares, base: Hypothesis, item: Sensitivity,
          columns: Jacobian, iterations: int) -> Hypothesis:
    """Fit an effect on top of a hypothesis, with these derivatives."""
    state = problem.extended(
        base.state, item.form.parameters, [p.start for p in item.form.parameters], columns)
    return Hypothesis((*base.effects, item.effect), (*base.forms, item.form),
                      problem.fit(state, iterations))


def added_at(problem: LeastSquares, base: Hypothesis, item: Sensitivity,
             sizes: Point) -> Hypothesis:
    """Fit an effect on top of a hypothesis, from sizes that a scan has found."""
    form = item.form
    state = problem.start_from(
        base.state.parameters, base.state.jacobian, form.parameters,
        {**base.state.point(), **form.start, **sizes})
    return Hypothesis((*base.effects, item.effect), (*base.forms, form),
                      problem.fit(state, problem.settings.search.iterations))


def gone_on(problem: LeastSquares, hypothesis: Hypothesis, iterations: int) -> Hypothesis:
    """Go on with a fit; where the effect is there, its shape has derivatives of its own."""
    state, own = hypothesis.state, hypothesis.forms[-1].parameters
    if any(p.is_shape for p in own):
        names = {p.name for p in own}
        indices = [j for j, p in enumerate(state.parameters) if p.name in names]
        state = problem.with_columns(state, indices, problem.jacobian(
            state.point(), own, state.residual, central=True))
    return replace(hypothesis, state=problem.fit(state, iterations))


def moved(problem: LeastSquares, base: Hypothesis, place: int, effect: Effect,
          factor: float) -> Hypothesis:
    """Fit an effect in the place of one of a hypothesis', from its size times a factor."""
    was = base.forms[place]
    catalogue = problem.machine.catalogue
    form = catalogue.counterpart(was, catalogue[base.effects[place]], effect)
    point = base.state.point()
    for old, new in zip(was.parameters, form.parameters, strict=True):
        point[new.name] = point.pop(old.name) * (1.0 if new.is_shape else factor)
    return Hypothesis(
        _put(base.effects, place, effect.id), _put(base.forms, place, form),
        _in_place_of(problem, base, was, (form,), point))


def _in_place_of(problem: LeastSquares, base: Hypothesis, was: Form, forms: Sequence[Form],
                 point: dict[str, float]) -> FitState:
    """Fit effects in the place of one of a hypothesis', from a point."""
    state, kept = base.state, others_than(base, was)
    start = problem.start_from(
        [state.parameters[j] for j in kept], state.jacobian[:, kept],
        [p for form in forms for p in form.parameters], point)
    return problem.fit(start, problem.settings.search.iterations)


def split(problem: LeastSquares, base: Hypothesis) -> list[Hypothesis]:
    """Return an effect that acts in several places as one effect in each, or nothing."""
    catalogue = problem.machine.catalogue
    effect = catalogue[base.effects[0]]
    if not effect.parts:
        return []
    forms = tuple(catalogue.counterpart(base.forms[0], effect, catalogue[part])
                  for part in effect.parts)
    point = base.state.point()
    whole = base.forms[0].parameters
    for p, *own in zip(whole, *(form.parameters for form in forms), strict=True):
        value = point.pop(p.name)
        point.update({part.name: value for part in own})
    state = _in_place_of(problem, base, base.forms[0], forms, point)
    return [Hypothesis(effect.parts, forms, state)]


def others_than(hypothesis: Hypothesis, form: Form) -> list[int]:
    """Return which of a hypothesis' parameters are not a form's."""
    return [j for j, p in enumerate(hypothesis.state.parameters) if p not in form.parameters]


def _put(items: tuple[Item, ...], place: int, item: Item) -> tuple[Item, ...]:
    return (*items[:place], item, *items[place + 1:])
