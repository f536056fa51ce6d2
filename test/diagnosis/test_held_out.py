# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How far a gap shrinks on withheld data, where the answer follows from the construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from hypothesis import given, strategies as st
import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import (
    Colour, Effect, Experiment, FloatArray, Form, Machine, Nuisances, Parameter, Point,
)
from simgap.search.hypothesis import Hypothesis
from simgap.verdict.held_out import block_sums, explained_fraction, held_out

TIME: FloatArray = np.arange(2000, dtype=np.float64) * 0.01
SIZE = Parameter('spring.rate.size', '1', -10.0, 10.0, 1e-3)
ZERO = Parameter('zero', '1', -1.0, 1.0, 1e-3, 0.5)
EFFECT = Effect('spring.rate', 'spring', '', (Form('', (SIZE,)),))


class Ramp(Machine):
    """
    A machine whose reading is size * shown(t) + zero, with another true size in each test.

    `shown` is t, times a number for each test that says how well it shows the effect.
    """

    def __init__(self, truths: Sequence[float], noise: float = 0.1,
                 shows: Sequence[FloatArray | float] = (1.0, 1.0, 1.0)) -> None:
        random = np.random.default_rng(3)
        self._shown = [np.asarray(show * TIME) for show in shows]
        super().__init__([Experiment(
            f'test {k}', TIME, ('y',), ('m',),
            (truth * self._shown[k] + noise * random.normal(size=TIME.size))[:, np.newaxis],
            np.full((TIME.size, 1), noise)) for k, truth in enumerate(truths)], [ZERO], [EFFECT])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the ramp."""
        return np.asarray(point.get(SIZE.name, 0.0) * self._shown[experiment]
                          + point.get('zero', 0.0))[:, None]


def judged(machine: Machine, found: float | None = None,
           parameters: Sequence[Parameter] = (SIZE,)) -> dict[str, Any]:
    """Return the judgement of the one effect, fitted to all tests, or with this size."""
    problem = LeastSquares(machine)
    effect = replace(EFFECT, forms=(Form('', tuple(parameters)),))
    none = Hypothesis((), (), problem.fit(problem.start([ZERO], {}), 20))
    state = problem.start([ZERO, *parameters], {} if found is None else {SIZE.name: found})
    if found is None:
        state = problem.fit(state, 20)
    return held_out(problem, none, Hypothesis((effect.id,), effect.forms, state))


def recorded(machine: Machine, truth: Point) -> Machine:
    """Return a machine whose tests were recorded with these values, and with noise of 0.1."""
    random = np.random.default_rng(4)
    return machine.with_experiments([replace(e, measured=machine.predict(
        truth, k) + 0.1 * random.normal(size=(TIME.size, 1)))
        for k, e in enumerate(machine.experiments)])


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
    assert isinstance(fraction, dict) and fraction['bounds'] == [-1.0, 1.0]
    assert fraction['value'] == -1.0 and fraction['ci95'][1] < 0.0


class Thrown(Ramp):
    """A ramp after a start that has two sides: from 0 no gradient leads to the true one."""

    true = -1.9
    starts = [Parameter(f'start {k}', '1', -3.0, 3.0, 1e-3, 2.0, experiment=k) for k in range(3)]

    def __init__(self) -> None:
        super().__init__([0.5, 0.5, 0.5])
        self.nuisances = Nuisances([ZERO, *self.starts])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the ramp, and for 0.4 s what a start on the other side does."""
        side = point.get(f'start {experiment}', 0.0) - self.true - 1.0
        wrong = 100.0 * ((side ** 2 - 1.0) ** 2 + 0.3 * (1.0 + side))
        return np.asarray(super().predict(point, experiment)
                          + wrong * (TIME < 0.4)[:, np.newaxis])


def test_a_start_in_which_a_fit_got_stuck_is_not_held_against_the_effect() -> None:
    machine = Thrown()
    problem = LeastSquares(machine)
    thrown = {p.name: machine.true for p in machine.starts}
    none = Hypothesis((), (), problem.fit(problem.start(machine.nuisances, thrown), 20))
    best = problem.fit(problem.start([*machine.nuisances, SIZE], {}), 20)
    assert all(best.point()[name] > -0.5 for name in thrown), 'on the other side'
    found = held_out(problem, none, Hypothesis((EFFECT.id,), EFFECT.forms, best))
    assert found['explained_fraction']['value'] == pytest.approx(1.0, abs=1e-3)


def test_a_share_names_the_effects_that_it_is_of() -> None:
    """What belongs to one test is never judged, and has no part in what the other explains."""
    machine = Ramp([0.5, 0.5, 0.5])
    own = Form('', (Parameter('clamp.play.size', '1', -1.0, 1.0, 1e-3, experiment=0),))
    problem = LeastSquares(machine)
    none = Hypothesis((), (), problem.fit(problem.start([ZERO], {}), 20))
    both = problem.fit(problem.start([ZERO, SIZE, *own.parameters], {}), 20)
    found = held_out(problem, none, Hypothesis(
        ('clamp.play', EFFECT.id), (own, *EFFECT.forms), both))
    assert found['judged'] == [EFFECT.id]
    assert found['cannot_be_judged'] == {'clamp.play': 'its numbers belong to one test alone'}
    assert found['explained_fraction']['value'] == pytest.approx(1.0, abs=1e-3)


def test_an_exact_correction_explains_all_within_its_interval() -> None:
    """Here a fit without noise ends at the truth; with it, the interval reaches one."""
    fraction = judged(Ramp([0.5, 0.5, 0.5]))['explained_fraction']
    low, high = fraction['ci95']
    assert 0.99 < low <= fraction['value'] <= high <= 1.0 and high > 0.9999
    assert fraction['reason'] is None


@pytest.mark.parametrize('found', [-8.0, 0.0, 3.0])
def test_what_the_whole_data_gave_is_not_used(found: float) -> None:
    """A test that is withheld decided the size of the whole fit; the others do not know it."""
    machine = Ramp([0.5, 0.5, -0.2])
    usual, other = judged(machine), judged(machine, found)
    assert other['after'] == pytest.approx(usual['after'], rel=1e-6)


def test_what_training_does_not_see_is_not_judged_there() -> None:
    """The one test that shows the effect cannot be predicted from the others, nor they by it."""
    found = judged(Ramp([0.5, 0.5, 0.5], shows=(1.0, 0.0, 0.0)))
    fraction = found['explained_fraction']
    assert fraction['value'] is None and fraction['ci95'] == [None, None]
    assert 'less than the price of a parameter' in fraction['reason']
    assert 'the withheld data do not show it' in fraction['reason']
    assert found['after'] is None and found['per_signal']['y']['after'] is None
    assert [fold['judged'] for fold in found['folds']] == [[], [], []]


def test_a_test_that_cannot_be_judged_does_not_count() -> None:
    """Two tests teach each other. The third shows nothing, and its noise is no gap."""
    found = judged(Ramp([0.5, 0.5, 0.5], shows=(1.0, 1.0, 0.0)))
    assert [fold['judged'] for fold in found['folds']] == [
        ['spring.rate'], ['spring.rate'], []]
    assert found['explained_fraction']['value'] == pytest.approx(1.0, abs=1e-3)
    alone = judged(Ramp([0.5, 0.5]))
    assert found['before'] == pytest.approx(alone['before'], rel=1e-2)


class Limited(Ramp):
    """A ramp that goes no further than 12 (1 + size)."""

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the ramp as far as the limit."""
        return np.asarray(np.minimum(self._shown[experiment], 12.0 * (
            1.0 + point.get(SIZE.name, 0.0))) + point.get('zero', 0.0))[:, None]


def test_a_limit_that_a_test_hardly_reaches_is_not_judged_there() -> None:
    """It ends 0.007 beyond the limit of 6; the derivative of its last samples is as of any."""
    machine = Limited([1.0, 1.0, 1.0], shows=(1.0, 1.0, 0.3005))
    found = judged(recorded(machine, {SIZE.name: -0.5}))
    assert [fold['judged'] for fold in found['folds']] == [
        ['spring.rate'], ['spring.rate'], []]
    assert found['folds'][2]['cannot_be_judged'] == {
        'spring.rate': 'the withheld data do not show it'}
    assert found['explained_fraction']['value'] == pytest.approx(1.0, abs=1e-3)


class Valleys(Ramp):
    """A ramp whose slope grows to either side, and that says which side by a ripple."""

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the ramp with its ripple, which the first test shows best."""
        size, ripple = point.get(SIZE.name, 0.0), 0.2 if experiment else 60.0
        return np.asarray((size + 0.5) ** 2 * self._shown[experiment]
                          + ripple * size * np.sin(3.0 * TIME) + point.get('zero', 0.0))[:, None]


@pytest.mark.parametrize('truth', [-2.0, 1.0])
def test_training_stays_on_the_side_that_all_tests_tell(truth: float) -> None:
    """
    A slope of 2.25 has a size of 1 or -2. From 0 and the slope alone, a fit goes to 1.

    Only the first test says by its ripple that it is -2.
    """
    found = judged(recorded(Valleys([0.0, 0.0, 0.0]), {SIZE.name: truth}), truth)
    assert [fold['values'].get(SIZE.name) for fold in found['folds']] == pytest.approx(
        [truth] * 3, abs=1e-2)
    assert found['explained_fraction']['value'] == pytest.approx(1.0, abs=1e-3)


class Placed(Ramp):
    """A slow ramp whose zero may be either of two places, until its size tells which."""

    def __init__(self, truths: Sequence[float], shows: Sequence[float]) -> None:
        super().__init__(truths, shows=shows)
        self.nuisances = Nuisances(self.nuisances, dict.fromkeys(
            range(len(truths)), [[{'zero': 0.5}, {'zero': -0.5}]]))

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the ramp, with a wave that grows with the size and turns with the zero."""
        size, zero = point.get(SIZE.name, 0.0), point.get('zero', 0.0)
        return np.asarray(size * self._shown[experiment] + zero ** 2 - 0.25
                          + 0.1 * size * zero * np.sin(3.0 * TIME))[:, None]


def test_a_place_that_only_the_size_tells_is_that_of_the_fit_to_all_tests() -> None:
    """At no size both places are alike, and the first is taken. The truth is the second."""
    truth = {SIZE.name: 1.0, 'zero': -0.5}
    size = replace(SIZE, low=-1e4, high=1e4)
    problem = LeastSquares(recorded(Placed([0.0] * 3, shows=[0.008] * 3), truth))
    found = held_out(
        problem, Hypothesis((), (), problem.fit(problem.start([ZERO], {}), 20)),
        Hypothesis((EFFECT.id,), (Form('', (size,)),), problem.start([ZERO, size], truth)))
    assert [fold['judged'] for fold in found['folds']] == [['spring.rate']] * 3
    assert found['explained_fraction']['value'] == pytest.approx(1.0, abs=0.02)


class Burst(Ramp):
    """A ramp whose zero moves ten readings of the last test far away, most of all near -0.85."""

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the ramp with its burst."""
        zero = point.get('zero', 0.0)
        burst = 100.0 * (experiment == 2) * ((TIME > 9.0) & (TIME < 9.1))
        moved = 0.5 * zero + 1.45 * np.exp(-((zero + 0.85) / 0.1) ** 2)
        return np.asarray(
            point.get(SIZE.name, 0.0) * self._shown[experiment] + moved * burst)[:, None]


def test_the_offsets_of_a_withheld_test_leave_a_local_minimum() -> None:
    """
    A zero of -0.9 makes the burst. From 0, a fit goes to the upper bound, which is too near.

    A robust level of what is left hardly sees the ten readings.
    """
    zero = Parameter('zero', '1', -1.0, 0.5, 1e-3, 0.5)
    truth = {SIZE.name: 0.5, 'zero': -0.9}
    problem = LeastSquares(recorded(Burst([0.0, 0.0, 0.0]), truth))
    found = held_out(
        problem, Hypothesis((), (), problem.fit(problem.start([zero], {}), 20)),
        Hypothesis((EFFECT.id,), EFFECT.forms, problem.start([zero, SIZE], truth)))
    assert [fold['judged'] for fold in found['folds']] == [['spring.rate']] * 3
    assert found['after'] == pytest.approx(1.0, abs=0.03)
    assert found['explained_fraction']['value'] == pytest.approx(1.0, abs=1e-3)


def test_numbers_of_one_test_alone_are_not_judged() -> None:
    own = [replace(SIZE, experiment=0)]
    fraction = judged(Ramp([0.5, 0.5]), parameters=own)['explained_fraction']
    assert fraction['value'] is None
    assert fraction['reason'] == 'spring.rate: its numbers belong to one test alone'


def test_the_interval_holds_what_training_leaves_open() -> None:
    """
    A test that hardly shows the effect teaches its size within a fifth.

    All of the withheld ramp is then off by that, and a bootstrap over time alone sees no spread.
    """
    machine = Ramp([0.5, 0.5], shows=(0.004, 1.0))
    found = judged(machine)
    assert [fold['judged'] for fold in found['folds']] == [['spring.rate'], ['spring.rate']]
    # the deviation of a slope that is fitted with a zero; the prior of the zero is wide
    deviation = 0.1 / 0.004 / np.sqrt(np.sum((TIME - TIME.mean()) ** 2))
    low, high = found['explained_fraction']['ci95']
    assert 0.1 < deviation / 0.5 < 0.3
    assert high > 0.99 and 1.0 - (4.0 * deviation / 0.5) ** 2 < low < 1.0 - (
        deviation / 0.5) ** 2


def test_each_signal_is_told_in_its_own_unit() -> None:
    signal = judged(Ramp([0.5, 0.5]))['per_signal']['y']
    assert signal['unit'] == 'm'
    assert signal['after_in_unit'] == pytest.approx(0.1 * signal['after'])
    assert signal['before_in_unit'] == pytest.approx(0.1 * signal['before'])


def test_its_own_unit_tells_the_gap_itself_whatever_the_colour_of_the_noise() -> None:
    """The whitened ramp is much smaller than the ramp; what a user sees is the ramp."""
    machine = Ramp([0.5, 0.5])
    slow = Colour(pole=0.98, gain=0.5, level=2.0)
    machine.experiments = tuple(replace(e, colours=(slow,)) for e in machine.experiments)
    signal = judged(machine)['per_signal']['y']
    assert signal['before'] < 10.0
    # a zero that is fitted to the whitened ramp is not its mean: the ramp from 0 to 10 m
    assert 10.0 / np.sqrt(12.0) < signal['before_in_unit'] < 10.0 / np.sqrt(3.0)
    assert signal['after_in_unit'] == pytest.approx(0.1, rel=0.1)


def test_a_half_that_does_not_show_the_effect_teaches_nothing() -> None:
    late = np.where(TIME > 12.0, 1.0, 0.0)
    found = judged(Ramp([0.5], shows=(late,)))
    assert found['explained_fraction']['value'] is None
    assert 'price of a parameter' in found['explained_fraction']['reason']


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
    fraction = explained_fraction(np.array([before, after, noise]))
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


class Zeros(Machine):
    """A reading that stays where the effect puts it, on the other side in the second test."""

    def __init__(self) -> None:
        random = np.random.default_rng(3)
        super().__init__([Experiment(
            f'test {k}', TIME, ('y',), ('m',),
            self.predict({SIZE.name: 0.3}, k) + 0.1 * random.normal(size=(TIME.size, 1)),
            np.full((TIME.size, 1), 0.1)) for k in range(3)], [ZERO], [EFFECT])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the place."""
        side = -1.0 if experiment == 1 else 1.0
        return np.full((TIME.size, 1), side * point.get(SIZE.name, 0.0) + point.get('zero', 0.0))


def test_what_no_test_shows_alone_cannot_be_judged_on_one() -> None:
    """A zero accounts for each test, and only all tests together tell that it is none."""
    found = judged(Zeros())
    fraction = found['explained_fraction']
    assert fraction['value'] is None and 'alone shows no gap' in fraction['reason']
