# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Rivals in planned tests: a T-optimal design of the literature, closed forms, and fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import json
import math

import numpy as np
import pytest
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.next_test.separation import Separation, separation
from simgap.search.rival import Rival

WIDE = 1e3


class Curves(Machine):
    """Two curves with three numbers each, read at some places; either one alone is the truth."""

    def __init__(self, x: FloatArray, sigma: float) -> None:
        self.x = x
        effects = [Effect(f'part.{name}', 'part', '', (Form('', tuple(
            Parameter(f'{name}_{k}', '1', -WIDE, WIDE, 0.01) for k in range(3))),))
            for name in ('waves', 'parabola')]
        super().__init__([Experiment(
            'one', np.arange(x.size, dtype=float), ('y',), ('1',), np.zeros((x.size, 1)),
            np.full((x.size, 1), sigma), model_error=np.zeros(1))], (), effects)

    def predict(self, point: Point, experiment: int) -> FloatArray:
        curves = {'waves': (np.ones_like(self.x), np.exp(self.x), np.exp(-self.x)),
                  'parabola': (np.ones_like(self.x), self.x, self.x ** 2)}
        return np.asarray(sum(
            point.get(f'{name}_{k}', 0.0) * column
            for name, columns in curves.items() for k, column in enumerate(columns)))[:, None]


def rival(name: str, values: Sequence[float], sigma: float, probability: float = 0.5) -> Rival:
    """Return a curve whose numbers are known to within sigma."""
    return Rival((f'part.{name}',), (f'part.{name}',), ('',), probability,
                 tuple(f'{name}_{k}' for k in range(3)), np.array(values, float),
                 sigma ** 2 * np.eye(3))


# A. C. Atkinson, V. V. Fedorov, Biometrika 62 (1975) 57, first example: the true curve is
# 4.5 - 1.5 exp(x) - 2 exp(-x), the rival a parabola, x from -1 to 1.
TRUE = (4.5, -1.5, -2.0)
POINTS, WEIGHTS, DELTA = (-1.0, -0.669, 0.144, 0.957), (0.253, 0.428, 0.247, 0.072), 1.087e-3
READINGS = 1000


def lack_at(x: FloatArray, sigma: float = 0.05) -> float:
    """Return the mean square by which the best parabola misses the true curve."""
    told = separation(Curves(x, sigma), [rival('waves', TRUE, 1e-6),
                                         rival('parabola', (0.0, 0.0, 0.0), 100.0)], 1.0)
    return float(told.lack[0, 1]) * 2.0 * sigma ** 2 / x.size


def test_the_published_t_optimal_design_has_the_published_lack_of_fit() -> None:
    x = np.repeat(POINTS, [round(READINGS * weight) for weight in WEIGHTS])
    # published to four digits
    assert lack_at(x) == pytest.approx(DELTA, rel=5e-4)


def test_no_other_design_has_a_greater_lack_of_fit() -> None:
    random = np.random.default_rng(1)
    designs = [np.linspace(-1.0, 1.0, READINGS), np.repeat([-1.0, -1 / 3, 1 / 3, 1.0], 250)]
    designs += [np.repeat(random.uniform(-1.0, 1.0, 5), 200) for _ in range(20)]
    best = lack_at(np.repeat(POINTS, [253, 428, 247, 72]))
    assert all(lack_at(x) < best for x in designs)


def test_two_constants_are_told_apart_as_the_prior_of_one_allows() -> None:
    # n readings of noise s: a is known, b only to within v; the mean of the readings has
    # variance v + f s^2 / n about b, if the cost is divided by f
    a, b, v, s, n, f = 0.3, 0.1, 0.04, 0.5, 400, 2.5
    machine = Curves(np.zeros(n), s)
    # at x = 0 only the first number of the parabola counts
    rivals = [rival('waves', (a, 0.0, 0.0), 1e-6), rival('parabola', (b, 0.0, 0.0), math.sqrt(v))]
    found = separation(machine, rivals, f)
    assert found.lack[0, 1] == pytest.approx((a - b) ** 2 / 2.0 / (v + f * s ** 2 / n), rel=1e-3)
    assert found.lack[0, 0] == found.lack[1, 1] == 0.0
    still = separation(machine, rivals, f, fitted=False)
    assert still.lack[0, 1] == pytest.approx((a - b) ** 2 * n / s ** 2 / 2.0 / f)


def test_fits_of_linear_curves_end_where_the_projection_says() -> None:
    # small differences: the robust loss of a fit is quadratic there
    x = np.linspace(-1.0, 1.0, 200)
    rivals = [rival('waves', TRUE, 0.02, 0.7), rival('parabola', (1.0, 0.0, -1.8), 0.2, 0.3)]
    machine = Curves(x, 0.5)
    powers = np.column_stack([np.ones_like(x), x, x ** 2])
    d = machine.predict(rivals[0].point, 0)[:, 0] - powers @ rivals[1].values
    # with d off it follows as regression does, with a prior of variance v
    v, noise = 0.2 ** 2, 1.6 * 0.5 ** 2
    step = np.linalg.solve(powers.T @ powers + noise / v * np.eye(3), powers.T @ d)
    lack = 0.5 * (np.sum((d - powers @ step) ** 2) / noise + step @ step / v)
    found = separation(machine, rivals, 1.6)
    assert found.lack[0, 1] == pytest.approx(lack, rel=2e-3)
    assert found.points[0, 1].keys() == {f'parabola_{k}' for k in range(3)}


class Tone(Machine):
    """A tone of a frequency, or none."""

    time: FloatArray = np.linspace(0.0, 5.0, 400)

    def __init__(self) -> None:
        super().__init__([Experiment(
            'one', self.time, ('y',), ('1',), np.zeros((400, 1)), np.ones((400, 1)),
            model_error=np.zeros(1))], (), [Effect('part.tone', 'part', '', (Form('', (
                Parameter('frequency', 'Hz', 0.0, 10.0, 1e-4),)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        return np.sin(2.0 * np.pi * point.get('frequency', 0.0) * self.time)[:, np.newaxis]


def lack_of_silence(deviation: float, order: int = 1) -> float:
    """Return by how much silence misses a tone whose frequency is known to a deviation [Hz]."""
    tone = Rival(('part.tone',), ('part.tone',), ('',), 0.5, ('frequency',), np.array([1.0]),
                 np.array([[deviation ** 2]]))
    silence = Rival((), (), (), 0.5, (), np.zeros(0), np.zeros((0, 0)))
    lack = separation(Tone(), [tone, silence][::order], 1.0).lack[::order, ::order]
    return float(lack[0, 1])


def test_what_a_fit_of_the_true_rival_may_miss_is_no_evidence() -> None:
    """From half a hertz away no gradient leads to a frequency that 5 s tell."""
    # half the sum of the squares of a sine
    assert lack_of_silence(1e-3) == pytest.approx(400 / 4, rel=0.02)
    assert lack_of_silence(0.5) < 0.1 * 400 / 4


@pytest.mark.parametrize('deviation', [0.02, 0.05, 0.1, 0.2])
def test_the_order_of_rivals_changes_nothing(deviation: float) -> None:
    assert lack_of_silence(deviation, -1) == pytest.approx(lack_of_silence(deviation), rel=1e-6)


def test_probabilities_after_a_test() -> None:
    told = Separation(np.array([0.7, 0.3]), np.array([[0.0, 1.0], [2.0, 0.0]]), {}, {})
    first, second = 0.7 / (0.7 + 0.3 * math.exp(-1.0)), 0.3 / (0.3 + 0.7 * math.exp(-2.0))
    assert np.diag(told.posterior()) == pytest.approx([first, second])
    assert told.information() == pytest.approx(
        0.7 * math.log(first / 0.7) + 0.3 * math.log(second / 0.3))
    assert told.expected() == pytest.approx(0.7 * first + 0.3 * second)
    assert told.surely(0.8) == pytest.approx(0.7)


def test_the_signals_that_tell_have_their_shares() -> None:
    x = np.linspace(-1.0, 1.0, 100)
    found = separation(Curves(x, 0.1), [rival('waves', TRUE, 0.1),
                                        rival('parabola', (1.0, 0.0, -1.8), 0.1)], 1.0)
    assert found.channels == {'y': 1.0}


def test_a_rival_survives_its_file() -> None:
    one = rival('waves', TRUE, 0.02, 0.7)
    back = Rival.of_data(json.loads(json.dumps(one.as_data())))
    assert back.named == one.named and back.names == one.names
    assert back.point == one.point
    assert back.covariance == pytest.approx(one.covariance)


@pytest.mark.parametrize('seed', range(8))
def test_the_digits_of_a_file_free_no_direction_and_hold_none(seed: int) -> None:
    """
    The parabola is known but for one direction; rounding makes its covariance indefinite.

    Off by d, it follows along the one curve c that is free with deviation one.
    """
    x, s = np.linspace(-1.0, 1.0, 200), 0.3
    free = np.random.default_rng(seed).uniform(0.3, 1.0, 3)
    centre = np.array([1.0, 0.2, -1.8])
    parabola = replace(rival('parabola', tuple(centre), 1.0),
                       covariance=np.outer(free, free) + 1e-9 * np.eye(3))
    machine = Curves(x, s)
    waves = rival('waves', TRUE, 1e-6)
    found = separation(machine, [waves, Rival.of_data(parabola.as_data())], 1.0)
    powers = np.column_stack([np.ones_like(x), x, x ** 2])
    d = machine.predict(waves.point, 0)[:, 0] - powers @ centre
    c = powers @ free
    step = (c @ d) / (c @ c + s ** 2)
    lack = 0.5 * (np.sum((d - step * c) ** 2) / s ** 2 + step ** 2)
    assert found.lack[0, 1] == pytest.approx(lack, rel=1e-2)
