# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The least size of an effect that shows, where it follows from a linear model."""

from __future__ import annotations

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.next_test.confusability import visibility
from simgap.settings import DEFAULT

TIME: FloatArray = np.linspace(-1.0, 1.0, 400)
STRONG = 1e6
PRICE = DEFAULT.evidence.shows
CURVE = Parameter('body.curve.size', '1', -10.0, 10.0, 1e-3)
SHIFT = Parameter('body.shift.size', 'm', -100.0, 100.0, 1e-3)


class Line(Machine):
    """A machine whose zero is known to two nuisances that are one and the same, and loud."""

    def __init__(self) -> None:
        super().__init__([Experiment(
            'line', TIME, ('y',), ('m',), np.zeros((TIME.size, 1)), np.ones((TIME.size, 1)))],
            [Parameter(name, '1', -1e3, 1e3, 1e-3, 300.0) for name in ('zero', 'same', 'slope')],
            [Effect('body.curve', 'body', '', (Form('', (CURVE,)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return a parabola."""
        values = (STRONG * (point.get('zero', 0.0) + (1.0 + 1e-9) * point.get('same', 0.0))
                  + point.get('slope', 0.0) * TIME + point.get(CURVE.name, 0.0) * TIME ** 2)
        return np.asarray(values[:, np.newaxis])


def test_the_least_size_is_that_of_the_part_that_nuisances_cannot_imitate() -> None:
    problem = LeastSquares(Line())
    state = problem.start(problem.machine.nuisances, {})
    # rounding has made the Hessian indefinite
    assert np.linalg.eigvalsh(state.hessian)[0] < 1.0
    found = visibility(problem, state)
    lines = np.stack([np.ones(TIME.size), TIME], axis=1)
    square = TIME ** 2
    rest = square - lines @ np.linalg.lstsq(lines, square, rcond=None)[0]
    sure = rest @ rest - DEFAULT.interval.derivative_error ** 2 * (square @ square)
    assert found.detectable == pytest.approx([np.sqrt(2.0 * PRICE / sure)], rel=0.01)


class Shifted(Machine):
    """A machine whose reading is off by a zero within bounds, or by an effect that looks alike."""

    def __init__(self, bound: float) -> None:
        super().__init__([Experiment(
            'line', TIME, ('y',), ('m',), np.zeros((TIME.size, 1)), np.ones((TIME.size, 1)))],
            [Parameter('zero', 'm', -bound, bound, 1e-3)],
            [Effect('body.shift', 'body', '', (Form('', (SHIFT,)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return a constant."""
        return np.full((TIME.size, 1), point.get('zero', 0.0) + point.get(SHIFT.name, 0.0))


@pytest.mark.parametrize(('bound', 'at'), [(0.5, 0.0), (40.0, 0.0), (0.5, 0.3)])
def test_nuisances_imitate_an_effect_as_far_as_their_bounds_allow(bound: float, at: float) -> None:
    problem = LeastSquares(Shifted(bound))
    found = visibility(problem, problem.start(problem.machine.nuisances, {'zero': at}))
    # a shift away from the further bound has the most room; a tenth of it may be an error:
    # (size - room)^2 - (size / 10)^2 = 2 price / count
    room, sure = bound + at, 1.0 - DEFAULT.interval.derivative_error ** 2
    rest = room ** 2 - 2.0 * PRICE / TIME.size
    assert found.detectable == pytest.approx(
        [(room + np.sqrt(room ** 2 - sure * rest)) / sure], rel=0.01)


def test_where_evidence_counts_less_more_can_hide() -> None:
    problem = LeastSquares(Line())
    state = problem.start(problem.machine.nuisances, {})
    plain, inflated = (visibility(problem, state, inflated=by).detectable for by in (1.0, 9.0))
    assert inflated == pytest.approx(3.0 * plain, rel=0.01)


def test_an_effect_that_no_size_shows_could_always_hide() -> None:
    problem = LeastSquares(Shifted(2.0 * SHIFT.high))
    found = visibility(problem, problem.start(problem.machine.nuisances, {}))
    assert found.detectable == [np.inf]
