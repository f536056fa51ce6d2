# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A small machine with one effect in two places, and hypotheses of it, for tests of the search."""

from __future__ import annotations

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.search.hypothesis import Hypothesis

TIME = np.arange(0.0, 4.0, 0.01)
NOISE = 0.01


def effect(key: str, parts: tuple[str, ...] = ()) -> Effect:
    """Return an effect of one number."""
    number = Parameter(f'{key}.pull', 'N', -5.0, 5.0, 1e-3)
    return Effect(key, 'springs', '', (Form('', (number,)),), parts)


class Springs(Machine):
    """A body that both springs move alike; what they do apart is seen faintly."""

    def __init__(self, left: float, right: float, drift: float = 0.0) -> None:
        random = np.random.default_rng(4)
        made = moved(left, right) + drift * TIME[:, np.newaxis] + NOISE * random.normal(
            size=(TIME.size, 2))
        super().__init__(
            [Experiment('pulled', TIME, ('together', 'apart'), ('m', 'm'), made,
                        np.full_like(made, NOISE))],
            [Parameter('offset', 'm', -0.02, 0.02, 1e-3, 0.01)],
            [effect('left.pull'), effect('right.pull'),
             effect('both.pull', ('left.pull', 'right.pull')), effect('drift')])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what is seen."""
        both = point.get('both.pull.pull', 0.0)
        return moved(point.get('left.pull.pull', 0.0) + both,
                     point.get('right.pull.pull', 0.0) + both) + point.get(
                         'offset', 0.0) + point.get('drift.pull', 0.0) * TIME[:, np.newaxis]


def moved(left: float, right: float) -> FloatArray:
    """Return what is seen of two pulls."""
    return np.column_stack([(left + right) * np.sin(TIME), 0.02 * (left - right) * np.cos(TIME)])


def fitted(problem: LeastSquares, sizes: Point) -> Hypothesis:
    """Return a hypothesis with effects by id, each fitted from a first size."""
    forms = tuple(problem.machine.catalogue[key].forms[0] for key in sizes)
    start = problem.start(
        [*problem.machine.nuisances, *(p for form in forms for p in form.parameters)],
        {form.parameters[0].name: size for form, size in zip(forms, sizes.values())})
    return Hypothesis(tuple(sizes), forms, problem.fit(start, 10))
