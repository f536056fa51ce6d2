# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Answers of an earlier verdict, fitted to more tests than it has seen."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import settled, with_initial_conditions
from simgap.next_test.rivals import Rival
from simgap.search.hypothesis import Hypothesis


def continued(problem: LeastSquares, rivals: Sequence[Rival],
              concurrently: Callable[..., Iterable[Any]] = map) -> list[Hypothesis]:
    """Return the known answers of an earlier verdict, fitted to all tests, each fit once."""
    unique = {(rival.effects, rival.forms): rival for rival in rivals
              if rival.is_known_to(problem.machine)}
    return list(concurrently(lambda rival: _continued(problem, rival), unique.values()))


def _continued(problem: LeastSquares, rival: Rival) -> Hypothesis:
    machine, options = problem.machine, problem.settings.search
    forms = tuple(rival.forms_of(machine))
    parameters = (*machine.nuisances, *(p for form in forms for p in form.parameters))
    names = {p.name for p in parameters}
    point = {name: value for name, value in rival.point.items() if name in names}
    point = with_initial_conditions(problem, point)
    if problem.noise_level(problem.residuals(point)) > options.continued_noise:
        noisy = problem.at_scale(options.continued_noise)
        state = noisy.fit(noisy.start(parameters, point), options.settling_iterations)
        point = with_initial_conditions(problem, state.point())
    state = problem.fit(problem.start(parameters, point), options.settling_iterations)
    return Hypothesis(rival.effects, forms, settled(
        problem, state, options, options.settling_passes, options.settling_iterations))
