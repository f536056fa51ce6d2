# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where a fit begins and goes on past minima that derivatives do not lead out of."""

from collections.abc import Sequence

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState


def settled(problem: LeastSquares, state: FitState, passes: int) -> FitState:
    """Go on with a fit while fresh derivatives, `passes` at most, gain much."""
    options = problem.settings.search
    for _ in range(passes):
        before = state.cost
        state = problem.fit(problem.refreshed(state), options.iterations)
        if before - state.cost < options.settled * before:
            break
    return state


def least_cost(problem: LeastSquares, trials: Sequence[dict[str, float]], experiment: int,
               until: float) -> tuple[float, dict[str, float]]:
    """Return the least cost in an experiment until a time [s], and the first point with it."""
    here = problem.experiments[experiment]
    early = (here.time - here.time[0] < until)[:, np.newaxis]
    best, least = trials[0], np.inf
    chunk = problem.settings.fit.batch
    for first in range(0, len(trials), chunk):
        part = trials[first:first + chunk]
        results = problem.machine.simulate(part, [experiment] * len(part), until)
        for trial, result in zip(part, results, strict=True):
            # a row that was not simulated counts as measured; whitening would spread its NaN
            seen = np.where(early, np.asarray(result[experiment]), here.measured)
            if (cost := problem.loss(problem.standardised(experiment, seen))) < least:
                best, least = trial, cost
    return least, best


def with_initial_conditions(problem: LeastSquares, point: dict[str, float]) -> dict[str, float]:
    """Return a point with the initial conditions that fit the first moments best."""
    until = problem.machine.time_scales.start_s
    for k, initial in problem.machine.nuisances.initial_conditions.items():
        for trials in initial:
            _, point = least_cost(
                problem, [point, *({**point, **trial} for trial in trials)], k, until)
    return point
