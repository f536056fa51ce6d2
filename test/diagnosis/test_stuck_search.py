# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The search for single effects, where fits to all tests at once get stuck."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.search.search import Search

TIME = np.arange(0.0, 30.0, 0.02)
NOISE = 0.05
PARTS = 6


def effect(key: str) -> Effect:
    """Return an effect of one number."""
    return Effect(key, 'string', '', (Form('', (
        Parameter(f'{key}.size', '1', -1.0, 1.0, 1e-4),)),))


class String(Machine):
    """
    A string that is tuned too high: one test hears it, the other reads a dial of its tension.

    The sound has a minimum of the cost for each whole period, and its volume may seem wrong in
    any part of the time.
    """

    def __init__(self, tension: float, tests: tuple[str, ...]) -> None:
        random = np.random.default_rng(3)
        self._tests = tests
        super().__init__(
            [Experiment(test, TIME, ('y',), ('1',), np.zeros((TIME.size, 1)),
                        np.full((TIME.size, 1), NOISE)) for test in tests],
            [Parameter('zero', '1', -0.01, 0.01, 1e-4, 0.001)],
            [*(effect(f'volume.part_{k}') for k in range(PARTS)), effect('string.tension')])
        self.experiments = [
            replace(e, measured=self.predict({'string.tension.size': tension}, k)
                    + NOISE * random.normal(size=(TIME.size, 1)))
            for k, e in enumerate(self.experiments)]

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the closed form."""
        tension, zero = point.get('string.tension.size', 0.0), point.get('zero', 0.0)
        if self._tests[experiment] == 'dial':
            return np.full((TIME.size, 1), 0.4 * tension + zero)
        volume = np.array([point.get(f'volume.part_{k}.size', 0.0) for k in range(PARTS)])
        loud = 1.0 + volume[(PARTS * TIME / TIME[-1]).astype(int).clip(max=PARTS - 1)]
        return np.asarray(loud * np.sin(10.0 * math.pi * (1.0 + tension) * TIME)
                          + zero)[:, np.newaxis]


@pytest.mark.parametrize('tests', [('heard', 'dial'), ('dial', 'heard')])
def test_an_effect_that_one_test_shows_is_fitted_to_it_first(tests: tuple[str, ...]) -> None:
    found = Search(LeastSquares(String(0.23, tests)), lambda share, doing: None).run()
    assert found.best.effects == ('string.tension',)
    assert found.best.values[0][1] == pytest.approx(0.23, abs=1e-3)
    # what is left is noise of the size that was put in
    assert found.problem.loss(found.best.state.residual) == pytest.approx(
        0.5 * len(tests) * TIME.size, rel=0.1)
