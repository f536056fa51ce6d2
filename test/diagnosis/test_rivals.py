# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a verdict knows of its rivals, and what the next test is to be for."""

from __future__ import annotations

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.next_test.design import objective_for
from simgap.next_test.rivals import Findings, rivals_of
from simgap.next_test.separation import separation
from simgap.search.hypothesis import Hypothesis
from simgap.search.rival import Rival
from simgap.settings import DEFAULT
from simgap.verdict.verdict import Answer

TOLERANCE = 0.02


class Gauge(Machine):
    """A gauge with a gain that deviates by a tolerance: y = (1 + gain) t + zero."""

    def __init__(self, gain: float, sigma: float) -> None:
        time = np.linspace(0.0, 1.0, 200)
        size = Parameter('gauge.gain', '1', -1.0, 1.0, 0.01, tolerance=TOLERANCE)
        noise = np.random.default_rng(3).normal(0.0, sigma, time.size)
        super().__init__(
            [Experiment('one', time, ('y',), ('m',), ((1.0 + gain) * time + noise)[:, np.newaxis],
                        np.full((time.size, 1), sigma), model_error=np.zeros(1))],
            [Parameter('zero', 'm', -1.0, 1.0, 0.01, 0.05)],
            [Effect('gauge.gain', 'gauge', '', (Form('', (size,)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        time = self.experiments[experiment].time
        y = (1.0 + point.get('gauge.gain', 0.0)) * time + point.get('zero', 0.0)
        return np.asarray(y[:, np.newaxis])


def answers_of(machine: Machine) -> list[Rival]:
    """Return the effect and nothing, each with its fit."""
    problem = LeastSquares(machine)
    [form] = machine.catalogue['gauge.gain'].forms
    answers = []
    for effects, forms, probability in ((('gauge.gain',), (form,), 0.7), ((), (), 0.25)):
        numbers = [*machine.nuisances, *(p for form in forms for p in form.parameters)]
        state = problem.fit(problem.start(numbers, {}), 20)
        answers.append(Answer(Hypothesis(effects, forms, state), probability))
    return rivals_of(answers, 1.0, DEFAULT)


@pytest.mark.parametrize('gain', [0.3, -0.3])
def test_an_answer_is_known_as_regression_with_its_priors_knows_it(gain: float) -> None:
    sigma = 0.03
    machine = Gauge(gain, sigma)
    effect, none = answers_of(machine)
    assert (effect.named, effect.effects, none.named) == (('gauge.gain',), ('gauge.gain',), ())
    assert (effect.probability, none.probability) == (0.7, 0.25)
    assert effect.names == ('zero', 'gauge.gain') and none.names == ('zero',)
    time = machine.experiments[0].time
    columns = np.column_stack([np.ones_like(time), time]) / sigma
    # the gain has the spread of one that is even within its bounds
    known = columns.T @ columns + np.diag([1.0 / 0.05 ** 2, 3.0])
    seen = (machine.experiments[0].measured[:, 0] - time) / sigma
    exact = np.linalg.solve(columns.T @ columns + np.diag([1.0 / 0.05 ** 2, 0.0]),
                            columns.T @ seen)
    assert effect.values == pytest.approx(exact, abs=0.2 * sigma)
    # derivatives that may be wrong by a tenth widen it by a few percent
    assert np.sqrt(np.diag(effect.covariance)) == pytest.approx(
        np.sqrt(np.diag(np.linalg.inv(known))), rel=0.1)


def test_an_answer_that_is_as_good_as_impossible_is_no_rival() -> None:
    problem = LeastSquares(Gauge(0.0, 0.03))
    none = Hypothesis((), (), problem.start(problem.machine.nuisances, {}))
    sure = [Answer(none, probability) for probability in (0.9, 0.1, 0.001)]
    assert [r.probability for r in rivals_of(sure, 1.0, DEFAULT)] == [0.9, 0.1]
    many = [Answer(none, 0.1)] * 10
    assert len(rivals_of(many, 1.0, DEFAULT)) == DEFAULT.verdict.largest_group


def test_a_more_precise_test_tells_them_apart() -> None:
    rivals = answers_of(Gauge(0.024, sigma=0.03))
    coarse, fine = (separation(Gauge(0.0, sigma), rivals, 1.0).information()
                    for sigma in (0.3, 0.003))
    assert fine > 0.1
    assert fine > 3.0 * coarse


@pytest.mark.parametrize(('known', 'objective'), [
    ([], 'detect'), ([0.64], 'detect'), ([0.95], 'detect'),
    ([0.5, 0.45], 'separate'), ([0.89, 0.06], 'separate'), ([0.4, 0.3], 'separate'),
    ([0.92, 0.03], 'detect'),
    # one answer and `unknown`: the rest has next to nothing
    ([0.64, 0.012], 'detect'), ([0.012, 0.64], 'detect'),
    # something without a name is likelier than each answer
    ([0.31, 0.17], 'detect'), ([0.4, 0.21], 'separate')])
def test_the_next_test_looks_beyond_what_is_as_good_as_one_answer(
        known: list[float], objective: str) -> None:
    rivals = [Rival((), (), (), probability, (), np.zeros(0), np.zeros((0, 0)))
              for probability in known]
    assert objective_for(Findings(rivals)) == objective
