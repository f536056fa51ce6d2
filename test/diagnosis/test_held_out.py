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
"""How far a gap shrinks on withheld data, where the answer follows from the construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from antenna_drive.diagnosis import (
    Effect, Experiment, FloatArray, Form, Hypothesis, LeastSquares, Machine, Parameter, Point,
)
from antenna_drive.diagnosis.held_out import block_sums, explained_fraction, held_out
from hypothesis import given, strategies as st
import numpy as np
import pytest

TIME: FloatArray = np.arange(2000, dtype=np.float64) * 0.01
SIZE = Parameter('spring.rate.size', '1', -10.0, 10.0, 1e-3)
ZERO = Parameter('zero', '1', -1.0, 1.0, 1e-3, 0.5)
EFFECT = Effect('spring.rate', 'spring', '', '', (Form('', (SIZE,)),))


class Ramp(Machine):
    """A machine whose reading is size * t + zero, with another true size in each test."""

    def __init__(self, truths: Sequence[float], noise: float = 0.1) -> None:
        random = np.random.default_rng(3)
        super().__init__([Experiment(
            f'test {k}', TIME, ('y',), ('m',),
            (truth * TIME + noise * random.normal(size=TIME.size))[:, np.newaxis],
            np.full((TIME.size, 1), noise)) for k, truth in enumerate(truths)], [ZERO], [EFFECT])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the ramp."""
        return np.asarray(point.get(SIZE.name, 0.0) * TIME + point.get('zero', 0.0))[:, None]


def judged(machine: Machine) -> dict[str, object]:
    """Return the judgement of the one effect, fitted to all tests."""
    problem = LeastSquares(machine)
    none, best = (Hypothesis(effects, forms, problem.fit(problem.start(parameters, {}), 20))
                  for effects, forms, parameters in (
                      ((), (), [ZERO]), (('spring.rate',), EFFECT.forms, [ZERO, SIZE])))
    return held_out(problem, none, best)


def test_an_effect_that_is_the_same_in_every_test_explains_all() -> None:
    found = judged(Ramp([0.5, 0.5, 0.5]))
    fraction = found['explained_fraction']
    assert isinstance(fraction, dict)
    assert fraction['value'] == pytest.approx(1.0, abs=1e-3)
    assert found['after'] == pytest.approx(1.0, abs=0.03)
    # the rms of 5 t over 20 s less its mean is 5 * 20 / sqrt(12), as far as the zero may move
    assert found['before'] == pytest.approx(
        np.sqrt(np.mean((5.0 * TIME - 10.0) ** 2) + 1.0), rel=1e-3)


def test_an_effect_that_turns_its_sign_explains_less_than_nothing_elsewhere() -> None:
    """Each test is predicted with the sign that the other has."""
    fraction = judged(Ramp([0.5, -0.5]))['explained_fraction']
    assert isinstance(fraction, dict)
    assert fraction['value'] == -1.0 and fraction['ci95'][1] < 0.0


def test_one_recording_is_predicted_from_its_first_half() -> None:
    found = judged(Ramp([0.5]))
    assert 'second half' in str(found['held_out'])
    fraction = found['explained_fraction']
    assert isinstance(fraction, dict) and fraction['value'] == pytest.approx(1.0, abs=0.01)


def test_a_missing_reading_is_no_evidence() -> None:
    machine = Ramp([0.5, 0.5])
    holed = machine.experiments[0].measured.copy()
    holed[500:] = np.nan
    machine.experiments = (replace(machine.experiments[0], measured=holed),
                           machine.experiments[1])
    fraction = judged(machine)['explained_fraction']
    assert isinstance(fraction, dict) and fraction['value'] == pytest.approx(1.0, abs=2e-3)


@given(st.floats(1.0, 1e6), st.floats(0.0, 1e6), st.floats(0.1, 1e3))
def test_no_more_than_all_is_explained(before: float, after: float, noise: float) -> None:
    fraction = explained_fraction(np.array([before, after, noise]), 1e-3)
    assert fraction <= 1.0 + 1e-12
    if after <= noise and before > 1.1 * noise:
        assert fraction == pytest.approx(1.0)
    if after > before:
        assert fraction <= 0.0


def test_blocks_hold_the_energy_of_their_seconds() -> None:
    before, after = np.full((2000, 1), 2.0), np.full((2000, 1), 1.0)
    before[:50] = after[:50] = np.nan
    sums = block_sums(TIME, before, after, 1.0)
    assert sums.shape == (20, 3)
    np.testing.assert_allclose(sums[0], [4.0 * 50, 50.0, 50.0])
    np.testing.assert_allclose(sums[1:], np.tile([400.0, 100.0, 100.0], (19, 1)))
