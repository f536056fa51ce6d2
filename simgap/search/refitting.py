# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A hypothesis at other noise, in whole tests, or without an effect, with shared derivatives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from simgap.fit.broyden import Jacobian
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import Form, Machine, Parameter, Point
from simgap.search.hypothesis import Hypothesis


@dataclass(frozen=True)
class SharedJacobian:
    """Derivatives by the nuisances, and by the parameters of each course."""

    nuisances: Jacobian
    courses: Mapping[Form, Jacobian]


def shared_jacobian(problem: LeastSquares, state: FitState,
                    hypotheses: Sequence[Hypothesis]) -> SharedJacobian:
    """Take the derivatives where a fit has ended, which several hypotheses share."""
    point, steps = state.point(), problem.local_steps(state)
    residual = problem.residuals(point)
    # a course has so many parameters that its derivatives are worth sharing, and the
    # prediction is nearly linear in them
    courses = {form for h in hypotheses for form in h.forms if form.is_course}
    return SharedJacobian(
        problem.jacobian(point, problem.machine.nuisances, residual, False, steps),
        {form: problem.jacobian(point, form.parameters, residual, False, steps)
         for form in courses})


def refitted(problem: LeastSquares, shared: SharedJacobian, iterations: int,
             hypothesis: Hypothesis) -> Hypothesis:
    """Fit a hypothesis to another problem, with shared derivatives."""
    courses = [form for form in hypothesis.forms if form in shared.courses]
    point, nuisances = taken_over(problem.machine, hypothesis.state.point(), hypothesis.forms,
                                  problem.machine.nuisances)
    state = problem.start_from(
        (*nuisances, *(p for form in courses for p in form.parameters)),
        np.column_stack([shared.nuisances, *(shared.courses[form] for form in courses)]),
        [p for form in hypothesis.forms if form not in courses for p in form.parameters],
        point)
    return replace(hypothesis, state=problem.fit(state, iterations))


def taken_over(machine: Machine, point: Point, forms: Sequence[Form],
               parameters: Sequence[Parameter]) -> tuple[dict[str, float], list[Parameter]]:
    """Return a point where effects alone stand for their numbers: twin nuisances are zero."""
    at, held = machine.nuisances.take_over(point, forms)
    return at, [replace(p, low=0.0, high=0.0) if p.name in held else p for p in parameters]


def dropped(machine: Machine, hypothesis: Hypothesis, effect: str) -> Hypothesis:
    """Return a hypothesis without one of its effects, not yet fitted."""
    gone = hypothesis.effects.index(effect)
    names = {p.name for p in hypothesis.forms[gone].parameters}
    state, values = hypothesis.state, hypothesis.state.point()
    free = {p.name: p for p in machine.nuisances}
    kept = [j for j, p in enumerate(state.parameters) if p.name not in names]
    own: list[Parameter] = [free.get(p.name, p) for p in (state.parameters[j] for j in kept)]
    point = machine.nuisances.absorb({p.name: values[p.name] for p in own},
                                     {name: values[name] for name in names})
    bare = replace(
        state.without_jacobian(), parameters=tuple(own),
        x=np.array([point[p.name] for p in own]),
        kept_hessian=None if state.kept_hessian is None
        else state.kept_hessian[np.ix_(kept, kept)])
    return Hypothesis(
        tuple(e for i, e in enumerate(hypothesis.effects) if i != gone),
        tuple(f for i, f in enumerate(hypothesis.forms) if i != gone), bare)
