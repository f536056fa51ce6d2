# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The evidence of a hypothesis, against marginal likelihoods in closed form and simulations."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
import math

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import multivariate_normal
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.search.evidence import Evidence, temperature
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT

NOISE = 0.3
# fits go on to the last digit
TO_THE_END = DEFAULT.changed('fit.least_gain', 1e-6)
NUMBERS = ('zero', 'a.size', 'b.size', 'c.size', 'd.size')
PRIORS = np.array([0.5, 2.0, 1.0, 3.0, 0.7])


class Linear(Machine):
    """Readings that are linear in all numbers, each with a Gaussian prior."""

    def __init__(self, measured: FloatArray, columns: FloatArray) -> None:
        self.columns = columns
        numbers = [Parameter(name, '1', -1e3, 1e3, 1e-2, sigma)
                   for name, sigma in zip(NUMBERS, PRIORS.tolist(), strict=True)]
        super().__init__(
            [Experiment('one', np.linspace(0.0, 1.0, measured.size), ('y',), ('1',),
                        measured[:, np.newaxis], np.full((measured.size, 1), NOISE))],
            numbers[:1], [Effect(p.name[0], 'part', '', (Form('', (p,)),))
                          for p in numbers[1:]])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the sum of the columns."""
        values = np.array([point.get(name, 0.0) for name in NUMBERS])
        return np.asarray(self.columns @ values)[:, np.newaxis]


def machine(seed: int, truth: dict[str, float], count: int = 60) -> Linear:
    """Return a machine with readings of some truth; no residual is an outlier."""
    random = np.random.default_rng(seed)
    columns = random.normal(size=(count, len(NUMBERS)))
    columns[:, 2] += columns[:, 1]
    clean = columns @ [truth.get(name, 0.0) for name in NUMBERS]
    return Linear(clean + NOISE * np.clip(random.normal(size=count), -2.0, 2.0), columns)


def fitted(problem: LeastSquares, effects: str) -> Hypothesis:
    """Return a hypothesis with effects of one letter, at its optimum."""
    forms = tuple(problem.machine.catalogue[effect].forms[0] for effect in effects)
    state = problem.start((*problem.machine.nuisances, *(f.parameters[0] for f in forms)), {})
    return Hypothesis(tuple(effects), forms, problem.refreshed(problem.fit(state, 20)))


def plain(problem: LeastSquares, tempered: float = 1.0, gain: float = 0.0) -> Evidence:
    """Return the evidence at a temperature."""
    return Evidence(problem.settings.evidence, problem.samples, tempered, gain)


def exact(model: Linear, effects: str) -> float:
    """Return the logarithm of the likelihood with all numbers integrated out."""
    used = [0, *(NUMBERS.index(f'{effect}.size') for effect in effects)]
    columns = model.columns[:, used]
    covariance = NOISE ** 2 * np.eye(len(columns)) + columns * PRIORS[used] ** 2 @ columns.T
    return float(multivariate_normal(np.zeros(len(columns)), covariance).logpdf(
        model.experiments[0].measured[:, 0]))


def without_nuisances(model: Linear) -> float:
    """Return what the determinant of the zero alone takes from the logarithm of a likelihood."""
    zero = model.columns[:, 0]
    return 0.5 * math.log(1.0 + float(zero @ zero) * (PRIORS[0] / NOISE) ** 2)


@pytest.mark.parametrize('seed', range(4))
def test_the_evidence_of_a_linear_model_is_its_marginal_likelihood(seed: int) -> None:
    model = machine(seed, {'zero': 0.2, 'a.size': 0.5, 'c.size': -1.0})
    problem = LeastSquares(model, settings=TO_THE_END)
    evidence = plain(problem)
    count, free = model.columns.shape[0], without_nuisances(model)
    for effects in ('ac', 'abc', 'abcd', 'acd'):
        hypothesis = fitted(problem, effects)
        marginal = evidence(hypothesis) + evidence.price(hypothesis.forms)
        assert marginal - count * math.log(NOISE * math.sqrt(2.0 * math.pi)) == pytest.approx(
            exact(model, effects) + free, abs=1e-2)


@pytest.mark.parametrize('bounds', [(-4.0, 4.0), (-400.0, 4.0)])
def test_a_size_without_a_prior_has_that_of_a_single_sample(bounds: tuple[float, float]) -> None:
    """Its bounds do not matter."""
    model = machine(3, {'a.size': 0.5})
    [form] = model.catalogue['a'].forms
    flat = replace(form.parameters[0], prior_sigma=0.0, low=bounds[0], high=bounds[1])
    model.catalogue['a'] = replace(model.catalogue['a'], forms=(Form('', (flat,)),))
    problem = LeastSquares(model, settings=TO_THE_END)
    hypothesis, evidence = fitted(problem, 'a'), plain(problem)
    zero, column = model.columns[:, 0], model.columns[:, 1]
    wide = 60 * NOISE ** 2 / float(column @ column)  # its variance
    measured = model.experiments[0].measured[:, 0]
    # at the optimum of a flat prior: the mean of the size is there, and what is left is Gaussian
    size = hypothesis.values[0][1]
    apart = NOISE ** 2 * np.eye(60) + PRIORS[0] ** 2 * np.outer(zero, zero)
    likelihood = float(multivariate_normal(np.zeros(60), apart).logpdf(measured - size * column))
    known = float(column @ np.linalg.solve(apart, column))
    wanted = likelihood - 0.5 * math.log(1.0 + wide * known) + without_nuisances(model)
    found = evidence(hypothesis) + evidence.price(hypothesis.forms) - 60 * math.log(
        NOISE * math.sqrt(2.0 * math.pi))
    assert found == pytest.approx(wanted, abs=0.02)


@pytest.mark.parametrize('times', [4, 25])
def test_samples_that_only_repeat_others_count_no_more(times: int) -> None:
    """Each sample so many times, at a temperature as high, is the sample once, but for prices."""
    one = machine(1, {'a.size': 0.5, 'c.size': -1.0})
    many = Linear(np.repeat(one.experiments[0].measured[:, 0], times),
                  np.repeat(one.columns, times, axis=0))
    found = []
    for model, tempered in ((one, 1.0), (many, float(times))):
        problem = LeastSquares(model, settings=TO_THE_END)
        evidence = plain(problem, tempered)
        fits = [fitted(problem, effects) for effects in ('ac', 'acd', 'abc')]
        found.append([evidence(fit) + evidence.price(fit.forms) for fit in fits])
    # the prior moves the optimum of the repeated samples less
    assert found[1] == pytest.approx(found[0], abs=0.1)


@pytest.mark.parametrize(('colour', 'level'), [(0.0, 1.0), (0.5, 1.0), (0.8, 1.0), (0.6, 1.5)])
def test_the_temperature_is_that_of_the_mean_of_a_first_order_process(colour: float,
                                                                      level: float) -> None:
    """The variance of a mean of n samples, times n, against many simulated means."""
    random = np.random.default_rng(8)
    drive = random.normal(size=(4000, 1000)) * math.sqrt(1.0 - colour ** 2)
    many = level * lfilter([1.0], [1.0, -colour], drive, axis=1)[:, 200:]
    wanted = many.shape[1] * float(np.var(many.mean(axis=1)))
    long = level * lfilter([1.0], [1.0, -colour], np.sqrt(1.0 - colour ** 2) * random.normal(
        size=60_000))[200:]
    model = Linear(NOISE * long, np.zeros((long.size, len(NUMBERS))))
    problem = LeastSquares(model)
    state = problem.start((), {})
    assert temperature(problem, state) == pytest.approx(wanted, rel=0.08)


def test_no_sample_counts_more_than_one_and_few_samples_tell_no_temperature() -> None:
    random = np.random.default_rng(8)
    for z in (0.2 * random.normal(size=4000), 3.0 * random.normal(size=20)):
        problem = LeastSquares(Linear(NOISE * z, np.zeros((z.size, len(NUMBERS)))))
        assert temperature(problem, problem.start((), {})) == 1.0


def test_each_effect_is_there_for_itself() -> None:
    """What several have to gain is the sum of theirs."""
    problem = LeastSquares(machine(0, {}))
    evidence, shows = plain(problem), DEFAULT.evidence.shows + (
        DEFAULT.evidence.form_error ** 2 * 0.5 * problem.samples)
    for count in range(4):
        for effects in combinations('abcd', count):
            assert evidence.price(fitted(problem, ''.join(effects)).forms) == pytest.approx(
                shows * count)


def test_an_order_that_was_sought_has_its_price() -> None:
    problem = LeastSquares(machine(0, {}))
    evidence, single = plain(problem), fitted(problem, 'a')
    sought = replace(single, forms=(replace(single.forms[0], scanned=True),))
    assert evidence(single) - evidence(sought) == pytest.approx(DEFAULT.evidence.sought)


class TwoSignals(Linear):
    """The same with two signals: the first half of the rows of its columns is the first one."""

    def __init__(self, measured: FloatArray, columns: FloatArray) -> None:
        super().__init__(measured, columns)
        half = measured.size // 2
        self.experiments = [Experiment(
            'one', np.linspace(0.0, 1.0, half), ('y', 'w'), ('1', '1'),
            measured.reshape(2, half).T.copy(), np.full((half, 2), NOISE))]

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the sum of the columns."""
        return super().predict(point, experiment).reshape(2, -1).T.copy()


@pytest.mark.parametrize('small', [0.35, 0.05])
def test_an_error_of_form_hides_an_effect_in_its_own_signals_alone(small: float) -> None:
    """A form wrong by a twentieth, what imitates the error, and an effect elsewhere."""
    random = np.random.default_rng(2)
    columns = random.normal(size=(1200, len(NUMBERS)))
    columns[600:, :3], columns[:600, 3:] = 0.0, 0.0
    clean = columns @ [0.0, 10.0, 0.5, small, 0.0]
    problem = LeastSquares(TwoSignals(clean + NOISE * random.normal(size=1200), columns),
                           settings=TO_THE_END.changed('fit.outlier', 1e3))
    none, single, imitated, elsewhere = hypotheses = [
        fitted(problem, effects) for effects in ('', 'a', 'ab', 'ac')]
    evidence = Evidence.among(problem, hypotheses)
    error = DEFAULT.evidence.form_error ** 2 * (none.cost - single.cost)
    for further in (imitated, elsewhere):
        assert single.cost - further.cost < error
    named = elsewhere if small == 0.35 else single
    assert single.cost - imitated.cost > single.cost - elsewhere.cost
    assert evidence.ranked(hypotheses)[0] is named


def test_hypotheses_are_ranked_by_their_evidence() -> None:
    """The truth leads; what is not there and what is left out cost."""
    problem = LeastSquares(machine(2, {'a.size': 1.0, 'c.size': -1.0}))
    hypotheses = [fitted(problem, effects) for effects in ('', 'a', 'c', 'acd', 'ac', 'abc')]
    evidence = Evidence.among(problem, hypotheses)
    ranked = evidence.ranked(hypotheses)
    assert ranked[0].effects == ('a', 'c')
    assert sorted(map(evidence, hypotheses), reverse=True) == [evidence(h) for h in ranked]
