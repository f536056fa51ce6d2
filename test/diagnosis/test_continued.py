# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What an earlier verdict has left open is fitted to further tests from where it had ended."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.search.hypothesis import Hypothesis
from simgap.search.rival import Rival
from simgap.search.search import Search

TIME = np.arange(0.0, 30.0, 0.02)
NOISE = 0.05
TRUE = {'string.tension.at_first': 0.23, 'string.tension.gained': 0.05, 'string.volume.size': 0.1}


def effect(key: str, *sizes: str) -> Effect:
    """Return an effect of some sizes."""
    return Effect(key, 'string', '', (Form('', tuple(
        Parameter(f'{key}.{size}', '1', -1.0, 1.0, 1e-4) for size in sizes)),))


class String(Machine):
    """A string whose tension is too high and grows, a little louder than its model; its sound."""

    def __init__(self) -> None:
        random = np.random.default_rng(3)
        super().__init__(
            [Experiment('heard', TIME, ('y',), ('1',), np.zeros((TIME.size, 1)),
                        np.full((TIME.size, 1), NOISE))],
            [Parameter('zero', '1', -0.01, 0.01, 1e-4, 0.001)],
            [effect('string.tension', 'at_first', 'gained'), effect('string.volume', 'size')])
        clean = self.predict(TRUE, 0)
        self.experiments = [replace(self.experiments[0], measured=clean + NOISE * random.normal(
            size=clean.shape))]

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the closed form: its misfit has a minimum for each whole period."""
        zero, at_first, gained, volume = (point.get(name, 0.0) for name in ('zero', *TRUE))
        turns = 5.0 * TIME * (1.0 + at_first + 0.5 * gained * TIME / TIME[-1])
        return np.asarray((1.0 + volume) * np.sin(2.0 * math.pi * turns)
                          + zero)[:, np.newaxis]


def answer(*effects: str, form: str = '') -> Rival:
    """Return an answer of a verdict that has read the tension roughly and never heard it."""
    known = {'zero': 0.0, 'string.tension.at_first': 0.231, 'string.tension.gained': 0.049,
             'string.volume.size': 0.0}
    names = [name for name in known if name == 'zero' or name.rpartition('.')[0] in effects]
    return Rival(effects, effects, (form,) * len(effects), 0.5, tuple(names),
                 np.array([known[name] for name in names]), 1e-4 * np.eye(len(names)))


def searched(*earlier: Rival) -> tuple[Hypothesis, float]:
    """Return what a search finds best, and its loss at the noise of the data sheet."""
    problem = LeastSquares(String())
    best = Search(problem, lambda share, doing: None, earlier=earlier).run().best
    return best, problem.loss(problem.residuals(best.state.point()))


def test_from_the_model_alone_the_search_sticks() -> None:
    # without this the next test would show nothing
    _, loss = searched()
    assert loss > 10.0 * 0.5 * TIME.size


@pytest.mark.parametrize('effects', [
    ('string.tension',), ('string.tension', 'string.volume')])
def test_the_search_begins_where_an_earlier_answer_had_ended(effects: tuple[str, ...]) -> None:
    best, loss = searched(answer(*effects))
    assert {p.name: value for p, value in best.values} == pytest.approx(TRUE, abs=0.01)
    # what is left is noise of the size that was put in
    assert loss == pytest.approx(0.5 * TIME.size, rel=0.1)


@pytest.mark.parametrize('unknown', [answer('string.rust'), answer('string.tension', form='old')])
def test_an_answer_that_the_machine_does_not_know_changes_nothing(unknown: Rival) -> None:
    best, loss = searched(unknown)
    alone, same = searched()
    assert (best.effects, loss) == (alone.effects, same)
