# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Functions that a machine's own equations have room for, fitted as effects are.

Such a law acts within the loop: a friction that it adds can stick, and what it is a function of
follows from it. Its values are thought to be as large as makes what is left likeliest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Machine
from simgap.machine.with_law import Law
from simgap.search import moves
from simgap.search.hypothesis import Hypothesis
from simgap.search.screening import Sensitivity
from simgap.search.search import Found
from simgap.verdict.input_evidence import InputEvidence
from simgap.verdict.unknown_input import Place

# So many of the likeliest are fitted beside the best hypothesis, and beside none.
_FITTED = 2
# No value is farther off than so many times what it was thought to be.
_FARTHEST = 30.0


def promised(problem: LeastSquares, base: Hypothesis) -> Iterator[tuple[Place, Sensitivity]]:
    """Yield the laws that may act beside a hypothesis, each with what its derivatives promise."""
    point, count = base.state.point(), len(problem.experiments)
    evidence = InputEvidence.at(problem, point)
    for item in problem.machine.learnable:
        [form], effect = item.effect.forms, item.effect
        columns = problem.jacobian(point, form.parameters, base.state.residual, central=False)
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
        numbers = tuple(replace(p, low=-_FARTHEST * spread, high=_FARTHEST * spread,
                                step=0.1 * spread, prior_sigma=spread, start=step * factor)
                        for p, factor in zip(form.parameters, found.factors.tolist(), strict=True))
        yield Place(effect.cause, effect.component, found.evidence,
                    evidence.net(found.evidence), law), Sensitivity(
                        effect.id, replace(form, parameters=numbers), columns)


def learnt(found: Found) -> tuple[Machine, Place, Hypothesis] | None:
    """Return the law that fits best, beside the best hypothesis or none; None if none pays."""
    problem, evidence, tried = found.problem, found.evidence, []
    for base in [found.best, found.none][:1 + bool(found.best.effects)]:
        whole = base.with_jacobian(problem)
        for place, item in sorted(promised(problem, whole), key=lambda law: -law[0].evidence)[
                :_FITTED]:
            if place.evidence > evidence.price([item.form]):
                # where it is strong, its derivatives at nothing say little
                begin = min((dict.fromkeys(item.form.start, 0.0), item.form.start),
                            key=lambda sizes: problem.loss(problem.residuals(
                                {**whole.state.point(), **sizes})))
                tried.append((problem.machine, place, moves.added(problem, whole, item, begin)))
    return min(tried, key=lambda law: law[2].cost + evidence.price(law[2].forms), default=None)
