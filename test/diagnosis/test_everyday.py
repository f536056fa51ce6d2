# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Everyday sizes: each effect is a little there, within its tolerance, and none of it is named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.machine.everyday import as_configured, EVERYDAY, taken_over, with_everyday
from simgap.machine.nuisances import Nuisances
from simgap.verdict.diagnosis import diagnose

TIME = np.arange(0.0, 20.0, 0.02)
NOISE = 0.01
TOLERANCE = 0.03
# what each effect does; those of two rates are told apart, but not by much
COURSES = {'gear.ripple': np.sin(3.0 * TIME), 'seal.drag': np.sin(3.2 * TIME),
           'load.creep': 0.1 * TIME}


def effect(key: str, tolerance: float = TOLERANCE) -> Effect:
    size = Parameter(f'{key}.size', 'm', -2.0, 2.0, 1e-3, tolerance=tolerance)
    return Effect(key, key.partition('.')[0], '', (Form('', (size,)),))


class Table(Machine):
    """A table whose place is the sum of what its effects do."""

    def __init__(self, truth: Mapping[str, float], tolerance: float = TOLERANCE) -> None:
        random = np.random.default_rng(3)
        measured = self.predict({f'{key}.size': value for key, value in truth.items()}, 0)
        measured = measured + NOISE * random.normal(size=measured.shape)
        super().__init__(
            [Experiment('moved', TIME, ('place',), ('m',), measured,
                        np.full_like(measured, NOISE))],
            [Parameter('zero', 'm', -0.1, 0.1, 1e-3, 0.05)],
            [effect(key, tolerance) for key in COURSES])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the place; names that it does not know do nothing."""
        return np.asarray(point.get('zero', 0.0) + sum(
            point.get(f'{key}.size', 0.0) * course for key, course in COURSES.items()))[:, None]


def test_each_size_has_a_nuisance_with_its_derivative() -> None:
    machine = with_everyday(Table({}))
    own = [p for p in machine.nuisances if p.name != 'zero']
    assert [p.prior_sigma for p in own] == [EVERYDAY * TOLERANCE] * 3
    for p, course in zip(own, COURSES.values(), strict=True):
        both = machine.predict({p.name: 0.02, 'zero': 0.01}, 0)
        assert both[:, 0] == pytest.approx(0.01 + 0.02 * course, abs=1e-7)
        [[simulated]] = machine.simulate([{p.name: 0.02, 'zero': 0.01}])
        assert np.array_equal(simulated, both)  # type: ignore[arg-type]


def test_an_everyday_size_stays_within_the_tolerance() -> None:
    """What is larger is left for its effect to explain."""
    machine = with_everyday(Table({'load.creep': 8.0 * TOLERANCE}))
    problem = LeastSquares(machine)
    state = problem.fit(problem.start(machine.nuisances, {}), 20)
    assert state.point()['everyday:load.creep.size'] == pytest.approx(TOLERANCE)
    assert problem.noise_level(state.residual) > 2.0


def test_the_machine_is_as_it_was_beneath() -> None:
    machine = Table({})
    assert as_configured(with_everyday(machine)) is machine
    assert as_configured(machine) is machine


def test_an_exact_machine_has_no_everyday_sizes() -> None:
    exact = Table({}, tolerance=0.0)
    assert with_everyday(exact) is exact


class OfOneNumber(Nuisances):
    """Nuisances of which the zero stands for the creep's number."""

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """Return the zero with what the creep had."""
        return {**point, 'zero': point.get('zero', 0.0) + removed.get('load.creep.size', 0.0)}


def test_a_number_that_has_a_nuisance_gets_no_second_one() -> None:
    machine = Table({})
    machine.nuisances = OfOneNumber(machine.nuisances)
    assert [p.name for p in with_everyday(machine).nuisances] == [
        'zero', 'everyday:gear.ripple.size', 'everyday:seal.drag.size']


def test_a_truncated_machine_has_the_first_part_of_each_response() -> None:
    machine = with_everyday(Table({}))
    [whole] = machine.experiments
    shorter = machine.with_experiments([replace(
        whole, time=TIME[:200], measured=whole.measured[:200], noise=whole.noise[:200])])
    assert shorter.simulate([{}])[0][0] is not None
    assert len(shorter.nuisances) == len(machine.nuisances)


@pytest.mark.parametrize('little', [0.5, -0.8])
def test_a_little_of_everything_is_no_gap_and_is_seen(little: float) -> None:
    """Each effect shows by twenty deviations and more of its size."""
    found = diagnose(Table(dict.fromkeys(COURSES, little * TOLERANCE)))
    assert found.word == 'no_gap'
    assert {item['effect'] for item in found.also_seen} >= {'gear.ripple', 'load.creep'}


@pytest.mark.parametrize('key', COURSES)
def test_what_is_larger_than_every_day_is_named_beside_a_little_of_the_others(key: str) -> None:
    truth = {**dict.fromkeys(COURSES, 0.5 * TOLERANCE), key: 8.0 * TOLERANCE}
    top = diagnose(Table(truth)).which[0]
    assert top.effects == [key]
    low, high = top.parameters[f'{key}.size']['ci95']
    assert low < 8.0 * TOLERANCE < high


def test_what_an_everyday_size_has_taken_goes_over_to_its_effect() -> None:
    """Nothing else changes: the prediction stays, and the size is free of its prior."""
    machine = with_everyday(Table({}))
    item = machine.catalogue['load.creep']
    before = {'zero': 0.01, 'everyday:load.creep.size': 1.2, 'everyday:seal.drag.size': 0.02}
    after = taken_over(machine.catalogue, item.id, item.forms[0], before)
    assert after == {**before, 'everyday:load.creep.size': 0.0, 'load.creep.size': 1.2}
    assert machine.predict(after, 0) == pytest.approx(machine.predict(before, 0))


class OfTwoForms(Table):
    """A table whose ripple has two forms, of which the second one takes the place of the first."""

    def __init__(self) -> None:
        super().__init__({})
        [ripple] = [item for item in self.catalogue.values() if item.id == 'gear.ripple']
        fast = Parameter('gear.ripple.fast', 'm', -2.0, 2.0, 1e-3, tolerance=TOLERANCE)
        self.catalogue = type(self.catalogue)([
            replace(ripple, forms=(*ripple.forms, Form('fast', (fast,)))),
            *(item for item in self.catalogue.values() if item is not ripple)])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the place."""
        if not (fast := point.get('gear.ripple.fast', 0.0)):
            return super().predict(point, experiment)
        rest = {name: value for name, value in point.items() if name != 'gear.ripple.size'}
        return np.asarray(super().predict(rest, experiment)
                          + fast * np.sin(30.0 * TIME)[:, None])


def test_an_everyday_size_is_no_way_to_take_another_form_of_its_effect_away() -> None:
    machine = with_everyday(OfTwoForms()).linearised_at({'gear.ripple.size': 1.0})
    name = 'everyday:gear.ripple.fast'
    added = machine.predict({name: 0.02}, 0) - machine.predict({}, 0)
    assert added[:, 0] == pytest.approx(0.02 * np.sin(30.0 * TIME), abs=1e-7)
