# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The moves of the search: each makes another hypothesis of one, and fits it from where that ended.

An effect is added, dropped, exchanged for one in another place or of another form, split into its
parts or joined from them. A move takes fresh derivatives by the numbers of the effects alone;
those by the nuisances are those of the hypothesis that it began with.
"""

from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean

import numpy as np
from simgap.fit import starts
from simgap.fit.broyden import Jacobian
from simgap.fit.least_squares import LeastSquares
from simgap.machine import everyday
from simgap.machine.contract import Form, Point
from simgap.machine.part import Part
from simgap.search.hypothesis import Hypothesis
from simgap.search.screening import Sensitivity


def added(problem: LeastSquares, base: Hypothesis, item: Sensitivity,
          sizes: Point | None = None) -> Hypothesis:
    """Return a hypothesis with one effect more, from these sizes, or from zero."""
    point = {**base.state.point(), **item.form.start, **(sizes or {})}
    if sizes is None:
        point = everyday.taken_over(problem.machine.catalogue, item.effect, item.form, point)
    columns = item.jacobian if sizes is None else _columns(problem, [item.form], point)
    return _fitted(problem, (*base.effects, item.effect), (*base.forms, item.form),
                   base, range(len(base.state.parameters)), [item.form], columns, point)


def dropped(problem: LeastSquares, base: Hypothesis, effect: str) -> Hypothesis:
    """Return a hypothesis with one effect less; the nuisances take over what they can of it."""
    gone, values = base.parameters_of([effect]), base.state.point()
    point = problem.machine.nuisances.absorb(
        {name: value for name, value in values.items() if name not in gone},
        {name: values[name] for name in values if name in gone})
    return _replaced(problem, base, [effect], (), (), point)


def exchanged(problem: LeastSquares, base: Hypothesis, effect: str, other: str,
              form: Form) -> Hypothesis:
    """Return a hypothesis with a form of another effect, or another form, in an effect's place."""
    # the fit begins at the sizes that do most of what the former has done
    gone = base.parameters_of([effect])
    point = {name: value for name, value in base.state.point().items() if name not in gone}
    point.update(form.start)
    bare = problem.residuals(point)
    columns = problem.jacobian(point, form.parameters, bare, central=True)
    sizes = np.linalg.lstsq(columns.astype(float), bare - base.state.residual, rcond=None)[0]
    point.update({p.name: float(np.clip(size, p.low, p.high)) for p, size in zip(
        form.parameters, sizes, strict=True) if not p.is_shape})
    return _replaced(problem, base, [effect], [other], [form], point)


def split(problem: LeastSquares, base: Hypothesis, effect: str) -> Hypothesis:
    """Return a hypothesis in which an effect acts in each of its places with a size of its own."""
    catalogue = problem.machine.catalogue
    was, whole = base.forms[base.effects.index(effect)], catalogue[effect]
    forms = [catalogue.counterpart(was, whole, catalogue[part]) for part in whole.parts]
    point = base.state.point()
    for p, *own in zip(was.parameters, *(form.parameters for form in forms), strict=True):
        value = point.pop(p.name)
        point.update({part.name: value for part in own})
    return _replaced(problem, base, [effect], whole.parts, forms, point)


def joined(problem: LeastSquares, base: Hypothesis) -> Hypothesis | None:
    """Return one effect in all its places instead of one in each; None if they are not alike."""
    catalogue = problem.machine.catalogue
    whole = next((item for item in catalogue.values()
                  if item.parts and set(item.parts) <= set(base.effects)), None)
    if whole is None:
        return None
    parts = [base.forms[base.effects.index(part)] for part in whole.parts]
    form, *others = {catalogue.counterpart(own, catalogue[part], whole)
                     for own, part in zip(parts, whole.parts, strict=True)}
    if others:
        return None
    point = base.state.point()
    for p, *own in zip(form.parameters, *(part.parameters for part in parts), strict=True):
        point[p.name] = fmean(point.pop(item.name) for item in own)
    return _replaced(problem, base, whole.parts, [whole.id], [form], point)


def refitted(problem: LeastSquares, base: Hypothesis, anchor: Hypothesis,
             nuisances: Jacobian) -> Hypothesis:
    """Return a hypothesis fitted to another problem, with derivatives at an anchor's nuisances."""
    own = [p for form in base.forms for p in form.parameters]
    # what an effect does is not done again by the everyday sizes that the anchor has in its place
    at = base.state.point()
    sizes = {name: at[name] for effect, form in base.items
             for p, names in everyday.alike(problem.machine.catalogue, effect, form)
             for name in (p.name, *names) if name in at}
    # one of them may be in a local minimum
    points = [{**{p.name: values.get(p.name, 0.0) for p in problem.machine.nuisances}, **sizes}
              for values in (at, anchor.state.point())]
    point = min(points, key=lambda point: problem.loss(problem.residuals(point)))
    columns = np.column_stack([nuisances, _columns(problem, base.forms, point)])
    state = problem.start((*problem.machine.nuisances, *own), point, columns)
    return replace(base, state=problem.fit(state, problem.settings.search.iterations))


def settled(problem: LeastSquares, base: Hypothesis, passes: int) -> Hypothesis:
    """Go on with a fit while fresh derivatives, `passes` at most, gain much."""
    state = base.with_jacobian(problem).state
    return replace(base, state=starts.settled(problem, state, passes))


def led(problem: LeastSquares, base: Hypothesis) -> Hypothesis:
    """
    Return a fit that the test that fits best has led out of a local minimum, if that gains.

    Where motors stick and slip, a slow test holds the fit in one of many minima. The test that
    fits best, alone, leads all to its optimum.
    """
    state, point = base.state, base.state.point()
    loss = [problem.loss(state.residual[rows]) / max(problem.valid[rows].sum(), 1)
            for rows in map(problem.rows, range(len(problem.experiments)))]
    part = Part(problem.machine, [int(np.argmin(loss))])
    for one, numbers in ((problem.of(part), part.parameters(state.parameters)),
                         (problem, state.parameters)):
        begun = one.start(numbers, starts.with_initial_conditions(one, point))
        found = starts.settled(one, one.fit(begun, problem.settings.search.iterations), 1)
        point |= found.point()
    return replace(base, state=found) if found.cost < state.cost else base


def _replaced(problem: LeastSquares, base: Hypothesis, gone: Sequence[str], names: Sequence[str],
              forms: Sequence[Form], point: Point) -> Hypothesis:
    """Fit effects in the place of others, from a point."""
    left = [(effect, form) for effect, form in base.items if effect not in gone]
    kept = [j for j, p in enumerate(base.state.parameters)
            if p.name not in base.parameters_of(gone)]
    return _fitted(problem, (*(effect for effect, _ in left), *names),
                   (*(form for _, form in left), *forms), base, kept, forms,
                   _columns(problem, forms, point), point)


def _fitted(problem: LeastSquares, effects: Sequence[str], forms: Sequence[Form],
            base: Hypothesis, kept: Sequence[int], new: Sequence[Form], columns: Jacobian,
            point: Point) -> Hypothesis:
    """Fit some of a hypothesis' numbers and those of new forms, whose derivatives are given."""
    state, iterations = base.state, problem.settings.search.iterations
    start = problem.start(
        [*(state.parameters[j] for j in kept), *(p for form in new for p in form.parameters)],
        dict(point), np.column_stack([state.jacobian[:, kept], columns]))
    found = problem.fit(start, iterations)
    # where an effect is there, its shape has derivatives, and its sizes have others
    own = {p.name for form in forms for p in form.parameters}
    places = [j for j, p in enumerate(found.parameters) if p.name in own]
    if places:
        found = problem.fit(problem.with_columns(found, places, problem.jacobian(
            found.point(), [found.parameters[j] for j in places], found.residual, central=True)),
            iterations)
    return Hypothesis(tuple(effects), tuple(forms), found)


def _columns(problem: LeastSquares, forms: Sequence[Form], point: Point) -> Jacobian:
    """Return the derivatives by the numbers of forms at a point, shape (n, m)."""
    return problem.jacobian(dict(point), [p for form in forms for p in form.parameters], None,
                            central=True)
