# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Intervals of fitted values, against covariances in closed form."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from simgap.fit.state import FitState
from simgap.machine.contract import Form, Parameter
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT
from simgap.verdict.intervals import (
    covariance, deviations, inflation, jackknife, values_with_intervals,
)

SETTINGS = DEFAULT.interval
CHANGE = Parameter('part.effect.change', '1', -0.9, 0.9, 0.005)
TOLERANCE = Parameter('tolerance', '1', -0.02, 0.02, 0.006, prior_sigma=0.02 / 3.0 ** 0.5)
OTHER = Parameter('other', '1', -1.0, 1.0, 0.1)


def state(columns: list[np.ndarray], parameters: tuple[Parameter, ...]) -> FitState:
    jacobian = np.stack(columns, axis=1).astype(np.float32)
    blank = np.zeros(len(jacobian))
    return FitState(parameters, np.full(len(parameters), 0.01), blank, jacobian,
                    np.ones(len(jacobian)), 0.0)


def test_uncorrelated_values_have_the_textbook_variance() -> None:
    random = np.random.default_rng(0)
    one, other = 300.0 * random.normal(size=(2, 4000))
    exact = replace(SETTINGS, derivative_error=1e-3)
    found = covariance(state([one, other], (CHANGE, OTHER)), 1.0, exact)
    assert np.diag(found) == pytest.approx([1.0 / (one @ one), 1.0 / (other @ other)], rel=0.01)
    doubled = covariance(state([one, other], (CHANGE, OTHER)), 4.0, exact)
    assert np.diag(doubled) == pytest.approx(4.0 * np.diag(found), rel=0.01)


@pytest.mark.parametrize('lasts', [1, 25])
def test_noise_that_lasts_inflates_the_variance_by_its_length(lasts: int) -> None:
    """So many samples with one and the same noise tell as much as one of them."""
    random = np.random.default_rng(7)
    signs, noise = random.choice([-1.0, 1.0], 4000), random.normal(size=4000)
    column, z = (np.repeat(part, lasts) for part in (signs, noise))
    fitted = replace(state([column], (CHANGE,)), residual=z)
    time = np.arange(z.size) / lasts
    problem: Any = SimpleNamespace(
        settings=DEFAULT, machine=SimpleNamespace(time_scales=SimpleNamespace(block_s=1.0)),
        experiments=[SimpleNamespace(time=time, measured=z[:, np.newaxis])])
    assert inflation(problem, fitted) == pytest.approx([lasts], rel=0.08)


@pytest.mark.parametrize('seed', range(5))
def test_a_value_that_only_priors_tell_from_others_is_not_inflated(seed: int) -> None:
    """
    A gain in every test, and one of each test: the data see their sums alone, and exactly.

    What rounding leaves of the difference is no scatter, and may be negative.
    """
    random = np.random.default_rng(seed)
    parts = 2e5 * random.normal(size=(3000, 1)) * np.repeat(np.eye(3), 1000, axis=0)
    own = [replace(OTHER, name=f'zero {k}', prior_sigma=1e-4) for k in range(3)]
    common = replace(OTHER, name='zero.offset')
    fitted = replace(state([parts.sum(axis=1), *parts.T], (common, *own)),
                     residual=random.normal(size=3000))
    time = np.arange(3000) / 100.0
    problem: Any = SimpleNamespace(
        settings=DEFAULT, machine=SimpleNamespace(time_scales=SimpleNamespace(block_s=1.0)),
        experiments=[SimpleNamespace(time=time, measured=fitted.residual[:, np.newaxis])])
    found = inflation(problem, fitted)
    assert ((found >= 1.0) & (found < 10.0)).all()


@pytest.mark.parametrize('rounding', [0.0, 0.005, 0.05])
def test_a_change_is_no_surer_than_the_tolerance_of_its_number(rounding: float) -> None:
    """Rounded derivatives do not tell the two apart, however many samples there are."""
    random = np.random.default_rng(1)
    signal = 3000.0 * random.normal(size=4000)
    beside = signal * (1.0 + rounding * random.normal(size=4000))
    found = covariance(state([signal, beside], (CHANGE, TOLERANCE)), 1.0, SETTINGS)
    assert np.sqrt(found[0, 0]) == pytest.approx(TOLERANCE.prior_sigma, rel=0.05)


@pytest.mark.parametrize(('unit', 'share'), [('1', 1.01), ('V', 1.0)])
def test_a_change_and_a_tolerance_of_one_number_are_told_apart_by_nothing(
        unit: str, share: float) -> None:
    """Even if no nuisance stands for the number: a share is one of what is there."""
    tolerant = replace(CHANGE, unit=unit, tolerance=0.02)
    fitted = Hypothesis(('part.effect',), (Form('', (tolerant,)),), state(
        [1e6 * np.random.default_rng(4).normal(size=4000)], (tolerant,)))
    low, high = values_with_intervals(
        fitted, deviations(fitted, lambda name: 1.0, DEFAULT))[tolerant.name]['ci95']
    assert high - low == pytest.approx(2.0 * 1.96 * 0.02 / 3.0 ** 0.5 * share, rel=0.01)


def test_no_value_is_surer_than_the_model() -> None:
    random = np.random.default_rng(2)
    fitted = Hypothesis(('part.effect',), (Form('', (CHANGE,)),),
                        state([1e6 * random.normal(size=4000)], (CHANGE,)))
    low, high = values_with_intervals(
        fitted, deviations(fitted, lambda name: 1.0, DEFAULT))[CHANGE.name]['ci95']
    assert high - low == pytest.approx(2.0 * 1.96 * DEFAULT.noise.model_error * 0.01, rel=0.01)


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    """The closed form that it was made for."""
    values = np.random.default_rng(5).normal(size=7)
    without = [float(np.delete(values, k).mean()) for k in range(7)]
    assert jackknife(without) == pytest.approx(values.std(ddof=1) / 7.0 ** 0.5, rel=1e-12)
    assert jackknife(without[:1]) == jackknife([]) == 0.0


def test_an_interval_is_as_wide_as_the_values_of_the_tests_differ() -> None:
    random = np.random.default_rng(2)
    fitted = Hypothesis(('part.effect',), (Form('', (CHANGE,)),),
                        state([1e6 * random.normal(size=4000)], (CHANGE,)))
    low, high = values_with_intervals(fitted, deviations(
        fitted, lambda name: 1.0, DEFAULT, {CHANGE.name: 0.2}))[CHANGE.name]['ci95']
    assert high - low == pytest.approx(2.0 * 1.96 * 0.2, rel=0.01)


def test_what_the_data_do_not_tell_may_be_anything_within_its_bounds() -> None:
    unseen = state([np.zeros(100)], (CHANGE,))
    fitted = Hypothesis(('part.effect',), (Form('', (CHANGE,)),), unseen)
    low, high = values_with_intervals(
        fitted, deviations(fitted, lambda name: 1.0, DEFAULT))[CHANGE.name]['ci95']
    assert low < -0.85
    assert high == CHANGE.high


def test_a_nuisance_that_is_held_adds_nothing_to_the_intervals_of_others() -> None:
    random = np.random.default_rng(3)
    column = 300.0 * random.normal(size=4000)
    held = replace(TOLERANCE, low=0.0, high=0.0)
    beside = covariance(state([column, np.zeros(4000)], (CHANGE, held)), 1.0, SETTINGS)
    alone = covariance(state([column], (CHANGE,)), 1.0, SETTINGS)
    assert beside[0, 0] == pytest.approx(alone[0, 0])
    bare = replace(held, prior_sigma=0.0)
    assert np.isfinite(covariance(
        state([column, np.zeros(4000)], (CHANGE, bare)), 1.0, SETTINGS)).all()
