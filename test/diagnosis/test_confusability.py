# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The least size of an effect that shows, where it follows from a linear model."""

from __future__ import annotations

from antenna_drive.diagnosis import (
    DEFAULT, Effect, Experiment, FloatArray, Form, LeastSquares, Machine, Parameter, Point,
)
from antenna_drive.diagnosis.confusability import visibility
import numpy as np
import pytest

TIME: FloatArray = np.linspace(-1.0, 1.0, 400)
STRONG = 1e6
CURVE = Parameter('body.curve.size', '1', -10.0, 10.0, 1e-3)


class Line(Machine):
    """A machine whose zero is known to two nuisances that are one and the same, and loud."""

    def __init__(self) -> None:
        super().__init__([Experiment(
            'line', TIME, ('y',), ('m',), np.zeros((TIME.size, 1)), np.ones((TIME.size, 1)))],
            [Parameter(name, '1', -1e3, 1e3, 1e-3, 300.0) for name in ('zero', 'same', 'slope')],
            [Effect('body.curve', 'body', '', '', (Form('', (CURVE,)),))])

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
    price = DEFAULT.penalty.effect + DEFAULT.penalty.parameter
    assert found.detectable == pytest.approx([np.sqrt(2.0 * price / (rest @ rest))], rel=0.01)
