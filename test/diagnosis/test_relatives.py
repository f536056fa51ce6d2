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
"""An effect in its other places, on a machine of two springs that pull at one body."""

from __future__ import annotations

from antenna_drive.diagnosis import (
    Effect, Experiment, FloatArray, Form, Hypothesis, LeastSquares, Machine, Parameter, Point,
)
from antenna_drive.diagnosis.search import Search
import numpy as np
import pytest

TIME = np.arange(0.0, 4.0, 0.01)
NOISE = 0.01


def effect(key: str, parts: tuple[str, ...] = ()) -> Effect:
    """Return an effect of one number."""
    number = Parameter(f'{key}.pull', 'N', -5.0, 5.0, 1e-3)
    return Effect(key, 'springs', '', '', (Form('', (number,)),), parts)


class Springs(Machine):
    """A body that both springs move alike; what they do apart is seen faintly."""

    def __init__(self, left: float, right: float) -> None:
        random = np.random.default_rng(4)
        made = moved(left, right) + NOISE * random.normal(size=(TIME.size, 2))
        super().__init__(
            [Experiment('pulled', TIME, ('together', 'apart'), ('m', 'm'), made,
                        np.full_like(made, NOISE))],
            [Parameter('offset', 'm', -0.02, 0.02, 1e-3, 0.01)],
            [effect('left.pull'), effect('right.pull'),
             effect('both.pull', ('left.pull', 'right.pull'))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what is seen."""
        both = point.get('both.pull.pull', 0.0)
        return moved(point.get('left.pull.pull', 0.0) + both,
                     point.get('right.pull.pull', 0.0) + both) + point.get('offset', 0.0)


def moved(left: float, right: float) -> FloatArray:
    """Return what is seen of two pulls."""
    return np.column_stack([(left + right) * np.sin(TIME), 0.02 * (left - right) * np.cos(TIME)])


@pytest.mark.parametrize('left, right, leading, size', [
    (0.5, 0.5, 'left.pull', 1.0), (1.0, 0.0, 'both.pull', 0.5), (0.0, 1.0, 'left.pull', 1.0)])
def test_the_same_effect_in_other_places_is_tried(left: float, right: float, leading: str,
                                                  size: float) -> None:
    """Each begins at a size that does as much as what was found, and the true one wins."""
    machine = Springs(left, right)
    problem = LeastSquares(machine)
    search = Search(problem, lambda share, doing: None)
    form = machine.effects[leading].forms[0]
    start = problem.start([*machine.nuisances, *form.parameters], {f'{leading}.pull': size})
    singles = search._with_relatives([Hypothesis((leading,), (form,), problem.fit(start, 5))])
    assert {h.effects[0] for h in singles} == set(machine.effects)
    truth = {(0.5, 0.5): ('both.pull', 0.5), (1.0, 0.0): ('left.pull', 1.0),
             (0.0, 1.0): ('right.pull', 1.0)}[left, right]
    assert singles[0].effects == (truth[0],)
    assert singles[0].values[0][1] == pytest.approx(truth[1], abs=0.01)
