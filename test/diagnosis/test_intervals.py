# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Intervals of fitted values, against covariances in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from simgap.fit.state import FitState
from simgap.machine.contract import Form, Parameter
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT
from simgap.verdict.doubts import Doubt, doubts
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
        fitted, deviations(fitted, lambda name: 1.0, SETTINGS))[tolerant.name]['ci95']
    assert high - low == pytest.approx(2.0 * 1.96 * 0.02 / 3.0 ** 0.5 * share, rel=0.01)


def test_no_value_is_surer_than_the_model() -> None:
    random = np.random.default_rng(2)
    fitted = Hypothesis(('part.effect',), (Form('', (CHANGE,)),),
                        state([1e6 * random.normal(size=4000)], (CHANGE,)))
    low, high = values_with_intervals(
        fitted, deviations(fitted, lambda name: 1.0, SETTINGS))[CHANGE.name]['ci95']
    assert high - low == pytest.approx(2.0 * 1.96 * SETTINGS.model_error * 0.01, rel=0.01)


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
        fitted, lambda name: 1.0, SETTINGS, {CHANGE.name: 0.2}))[CHANGE.name]['ci95']
    assert high - low == pytest.approx(2.0 * 1.96 * 0.2, rel=0.01)


def test_what_the_data_do_not_tell_may_be_anything_within_its_bounds() -> None:
    unseen = state([np.zeros(100)], (CHANGE,))
    fitted = Hypothesis(('part.effect',), (Form('', (CHANGE,)),), unseen)
    low, high = values_with_intervals(
        fitted, deviations(fitted, lambda name: 1.0, SETTINGS))[CHANGE.name]['ci95']
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


def with_sizes(*sizes: float) -> tuple[Hypothesis, dict[str, float]]:
    """Return a fit whose sizes exceed a tolerance of 0.1, with deviations of 0.1."""
    numbers = tuple(replace(CHANGE, name=f'part_{k}.effect.size', tolerance=0.1)
                    for k in range(len(sizes)))
    fit = Hypothesis(tuple(f'part_{k}.effect' for k in range(len(sizes))),
                     tuple(Form('', (number,)) for number in numbers),
                     replace(state([np.ones(4)] * len(sizes), numbers), x=np.array(sizes)))
    return fit, {number.name: 0.1 for number in numbers}


def shares(found: Mapping[str, Doubt]) -> dict[str, float]:
    return {effect: doubt.probability for effect, doubt in found.items()}


def doubted(*sizes: float, gained: float = 0.0) -> dict[str, float]:
    fit, deviating = with_sizes(*sizes)
    return shares(doubts(fit, deviating, gained, SETTINGS, SETTINGS.sure))


@pytest.mark.parametrize('size', [0.3, -0.3])
def test_doubt_of_an_effect_falls_with_its_excess_over_the_tolerance(size: float) -> None:
    """At the limit it is a half; from there its odds fall with a power of the excess."""
    at_limit = 0.1 * (1.0 + SETTINGS.sure)
    assert doubted(np.copysign(at_limit, size)) == {'part_0.effect': pytest.approx(0.5)}
    [twice] = doubted(np.copysign(0.1 * (1.0 + 2.0 * SETTINGS.sure), size)).values()
    assert twice / (1.0 - twice) == pytest.approx(2.0 ** -SETTINGS.sure_slope)


def test_the_strongest_effect_of_those_that_gain_much_is_named_however_wide_its_interval() -> None:
    assert doubted(0.2)['part_0.effect'] > 0.5
    assert doubted(0.2, gained=2.0 * SETTINGS.sure_by_gain)['part_0.effect'] < 0.2
    both = doubted(0.2, 0.15, gained=2.0 * SETTINGS.sure_by_gain)
    assert both['part_0.effect'] < 0.2 and both['part_1.effect'] > 0.5


def test_a_weaker_effect_that_gains_very_much_beside_the_strongest_is_named() -> None:
    fit, deviating = with_sizes(2.0, 0.2)

    def doubt(own: float) -> float:
        return doubts(fit, deviating, 0.0, SETTINGS, SETTINGS.sure,
                      {'part_1.effect': own})['part_1.effect'].probability

    limit = SETTINGS.partner_sure_by_gain
    assert doubt(0.0) > 0.9
    assert doubt(limit) == pytest.approx(0.5)
    assert doubt(10.0 * limit) < 0.01
    # what would do for the strongest is not enough
    assert doubt(SETTINGS.sure_by_gain) > 0.9


def test_a_weaker_effect_must_exceed_its_tolerance_by_more() -> None:
    between = 0.1 * (1.0 + 0.5 * (SETTINGS.sure + SETTINGS.sure_of_partner))
    fit, deviating = with_sizes(2.0, between)
    found = shares(doubts(fit, deviating, 0.0, SETTINGS, SETTINGS.sure))
    assert found['part_0.effect'] < 0.01 < 0.5 < found['part_1.effect']
    assert doubted(between)['part_0.effect'] < 0.5
    assert replace(fit, doubts=found).named == ('part_0.effect',)


@pytest.mark.parametrize('size, tolerance, beyond, expected', [
    (0.5, 0.1, 1.645, False), (0.5, 0.1, 4.1, True), (-0.5, 0.1, 3.9, False),
    (0.25, 0.1, 1.645, True)])
def test_an_effect_is_unsure_if_it_exceeds_its_tolerance_by_too_few_deviations(
        size: float, tolerance: float, beyond: float, expected: bool) -> None:
    number = replace(CHANGE, tolerance=tolerance)
    fitted = Hypothesis(('part.effect',), (Form('', (number,)),),
                        replace(state([np.ones(4)], (number,)), x=np.array([size])))
    judged = replace(fitted, doubts=shares(
        doubts(fitted, {number.name: 0.1}, 0.0, SETTINGS, beyond)))
    assert judged.unsure == (frozenset(['part.effect']) if expected else frozenset())
    assert judged.named == (() if expected else ('part.effect',))


def test_what_is_within_its_tolerance_is_no_matter_of_doubt() -> None:
    assert doubted(0.05) == {}
