# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A force that is a function of something: it is found, as what it is, and noise is none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.catalogue import Catalogue
from simgap.machine.contract import (
    Course, DisturbanceInput, Effect, Experiment, FloatArray, Form, Learnable, Machine, Motion,
    Parameter, Point, TimeScales,
)
from simgap.machine.with_law import Law, walk
from simgap.search.evidence import Evidence
from simgap.search.hypothesis import Hypothesis
from simgap.search.search import Found, Search
from simgap.settings import DEFAULT
from simgap.verdict.diagnosis import diagnose
from simgap.verdict.law import predicted, quantities_of
from simgap.verdict.law_fit import lawful_fit, LawfulFit
from simgap.verdict.law_form import nearest_form
from simgap.verdict.unknown_input import places
from two_lags import TIME, TwoLags

ANGLE: FloatArray = np.sin(0.9 * TIME) + 0.6 * np.sin(1.7 * TIME + 0.4)
RATE: FloatArray = np.gradient(ANGLE, TIME)
LOAD: FloatArray = 1.0 + 0.8 * np.sin(2.9 * TIME)
NOTHING = 0.0 * TIME


class Turning(TwoLags):
    """Two lags beside something that turns under a load."""

    def motion(self, experiment: int) -> Motion:
        """Return how it turns."""
        return Motion(TIME, rate=RATE, angle=ANGLE, load=LOAD, units={'angle': 'rad'})


class Read(Turning):
    """The same, whose readings are its angle and its rate, in other units."""

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return both readings."""
        return np.column_stack([ANGLE + 1.0, 2.0 * RATE])


class Swing(Machine):
    """A mass on a spring that is shaken; a force on it acts in the loop."""

    disturbance_inputs = (DisturbanceInput('force on the mass', 'mass', unit='N'),)
    time_scales = TimeScales(1.0, 5.0, 0.15, 1.5, 1.0)

    def __init__(self, spring: Callable[[float], float]) -> None:
        angle = self._moved(spring, NOTHING)[:, np.newaxis]
        measured = angle + 0.005 * np.random.default_rng(3).normal(size=angle.shape)
        super().__init__([Experiment('one', TIME, ('angle',), ('rad',), measured,
                                     np.full_like(measured, 0.005))],
                         [Parameter('zero', 'rad', -0.01, 0.01, 1e-4, 0.005)])

    @staticmethod
    def _moved(spring: Callable[[float], float], force: FloatArray) -> FloatArray:
        """Return the angle, by semi-implicit steps."""
        angle, rate, found = 0.0, 0.0, []
        for push in (np.sin(1.3 * TIME) + np.sin(2.9 * TIME) + force).tolist():
            found.append(angle)
            rate += 0.01 * (push + spring(angle) - 3.0 * angle - 0.8 * rate)
            angle += 0.01 * rate
        return np.array(found)

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the angle."""
        return self._moved(lambda angle: 0.0, NOTHING)[:, np.newaxis] + point.get('zero', 0.0)

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        """Return the angle with a force."""
        return [self._moved(lambda angle: 0.0, course(TIME))[:, np.newaxis]
                + point.get('zero', 0.0) for course in courses]


class Learns(Swing):
    """The same, whose own equations have room for a spring."""

    at = np.linspace(-0.8, 0.8, 9)
    numbers = tuple(Parameter(f'mass.spring.{k}', 'N', -50.0, 50.0, 0.05) for k in range(9))
    learnable = (Learnable(Effect('mass.spring', 'mass', 'spring of the mass', (
        Form('angle', numbers, scanned=True),)), 'angle', 'rad', tuple(at.tolist())),)

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the angle."""
        force = walk(9) @ [point.get(p.name, 0.0) for p in self.numbers]
        return self._moved(lambda angle: float(np.interp(angle, self.at, force)), NOTHING)[
            :, np.newaxis] + point.get('zero', 0.0)


class Stiff(Learns):
    """The same, whose catalogue has a spring in proportion to the angle."""

    effects = (Effect('mass.stiffness', 'mass', 'spring of the mass', (
        Form('', (Parameter('mass.stiffness.k', 'N', -10.0, 10.0, 0.01),)),)),)

    def __init__(self, spring: Callable[[float], float]) -> None:
        super().__init__(spring)
        self.catalogue = Catalogue(self.effects)

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the angle."""
        force, k = walk(9) @ [point.get(p.name, 0.0) for p in self.numbers], point.get(
            'mass.stiffness.k', 0.0)
        return self._moved(lambda angle: float(np.interp(angle, self.at, force)) - k * angle,
                           NOTHING)[:, np.newaxis] + point.get('zero', 0.0)


class Pieces(Learns):
    """The same, whose catalogue has a spring of its own in each quarter of the way."""

    stiffness = (1.0, 5.0, 2.0, 4.0)  # of the machine that was measured

    def __init__(self, part: str) -> None:
        super().__init__(self._spring(self.stiffness))
        self.forms = [Form('', (Parameter(f'{part}.spring_{k}.k', 'N', -10.0, 10.0, 0.01),))
                      for k in range(len(self.stiffness))]
        self.catalogue = Catalogue(Effect(f'{part}.spring_{k}', part, 'spring', (form,))
                                   for k, form in enumerate(self.forms))

    @staticmethod
    def _spring(stiffness: Sequence[float]) -> Callable[[float], float]:
        ends = np.linspace(-0.8, 0.8, len(stiffness) + 1)
        force = -np.cumsum([0.0, *stiffness]) * (ends[1] - ends[0])
        middle = float(np.interp(0.0, ends, force))
        return lambda angle: float(np.interp(angle, ends, force)) - middle

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the angle."""
        own = self._spring([point.get(form.parameters[0].name, 0.0) for form in self.forms])
        force = walk(9) @ [point.get(p.name, 0.0) for p in self.numbers]
        return self._moved(lambda angle: own(angle) + float(np.interp(angle, self.at, force)),
                           NOTHING)[:, np.newaxis] + point.get('zero', 0.0)


def lawful(machine: Machine) -> LawfulFit:
    """Return the likeliest law in the fit of a machine."""
    problem = LeastSquares(machine)
    none = Hypothesis((), (), problem.fit(problem.start(machine.nuisances, {}), 5))
    found = Found(problem, [none], Evidence.among(problem, [none]))
    fit = lawful_fit(found, [] if machine.learnable else places(
        problem, none.state.point(), problem))
    assert fit is not None
    return fit


def likeliest(left: FloatArray) -> tuple[str, Law]:
    """Return the likeliest place of a force on the left, and its law."""
    problem = LeastSquares(Turning(left, NOTHING))
    first = places(problem, {}, problem)[0]
    assert first.law is not None
    return first.component, first.law


@pytest.mark.parametrize('by, times, force', [
    ('angle', {''}, np.where(ANGLE > 0.3, 2.0 * (ANGLE - 0.3), 0.0)),
    ('direction', {''}, 0.4 * np.sign(RATE)),
    # any function of a rate is one in proportion to its direction, too
    ('rate', {'', 'direction'}, 0.3 * RATE * np.abs(RATE)),
    ('time', {'load'}, 0.5 * LOAD * np.exp(-TIME / 10.0)),
])
def test_a_force_is_found_as_the_function_that_it_is(by: str, times: set[str],
                                                     force: FloatArray) -> None:
    component, law = likeliest(force)
    assert (component, law.by) == ('left', by) and law.times in times
    quantities = {'angle': ANGLE, 'direction': np.sign(RATE), 'rate': RATE, 'time': TIME}
    factor = {'': 1.0, 'direction': np.sign(RATE), 'load': LOAD}[law.times]
    drawn = factor * np.interp(quantities[by], law.at, law.values)
    assert np.corrcoef(drawn, force)[0, 1] > 0.95
    assert law.withheld is None


def test_noise_has_no_law() -> None:
    problem = LeastSquares(Turning(NOTHING, NOTHING))
    found = places(problem, {}, problem)
    assert max(place.law.evidence for place in found if place.law) < DEFAULT.evidence.shows


def test_a_law_that_noise_could_pass_for_is_no_noise() -> None:
    """A few steps of three deviations are slow noise to a filter, and follow the direction."""
    found = diagnose(Turning(0.15 * np.sign(RATE), NOTHING))
    assert (found.word, found.where[0]['signal']) == ('unknown_effect', 'seen left')
    assert diagnose(Turning(NOTHING, NOTHING)).word == 'no_gap'


def both(first: FloatArray, second: FloatArray) -> Machine:
    """Return a machine in two tests, in which a force on the left does the one and the other."""
    machine = Turning(first, NOTHING)
    return machine.with_experiments([*machine.experiments, replace(
        Turning(second, NOTHING).experiments[0], name='two')])


@pytest.mark.parametrize('other, low, high', [(1.0, 0.9, 1.0), (0.0, -1.0, 0.0)])
def test_a_law_is_tried_on_each_test_after_the_others(other: float, low: float,
                                                      high: float) -> None:
    """A spring takes nearly all off a test that has it too, and nothing off one without."""
    place = lawful(both(2.0 * ANGLE, 2.0 * other * ANGLE)).place
    assert place.law is not None and place.law.withheld is not None
    assert low <= place.law.withheld <= high


@pytest.mark.parametrize('cubic, told', [(0.0, False), (0.6, False), (3.0, True)])
def test_a_law_gains_more_than_an_error_of_form_of_what_is_named(cubic: float,
                                                                 told: bool) -> None:
    """A spring that stiffens a little keeps its name; what is no such spring is a law as well."""
    problem = LeastSquares(Stiff(lambda angle: -2.0 * angle - cubic * angle ** 3))
    found = Search(problem, lambda done, doing: None).run()
    assert found.best.effects == ('mass.stiffness',)
    fit = lawful_fit(found, [])
    assert (fit is not None and fit.gained > 0.0) == told


@pytest.mark.parametrize('part, told', [('mass', True), ('frame', False)])
def test_what_several_effects_of_a_part_do_together_may_be_one_law(part: str, told: bool) -> None:
    """Four springs fit what one curve fits as well, for a fourth of their prices."""
    problem = LeastSquares(machine := Pieces(part))
    none = Hypothesis((), (), problem.fit(problem.start(machine.nuisances, {}), 20))
    springs = [form.parameters[0] for form in machine.forms]
    best = Hypothesis(tuple(machine.catalogue), tuple(machine.forms), problem.fit(problem.start(
        [*machine.nuisances, *springs], dict(zip(
            (p.name for p in springs), machine.stiffness, strict=True))), 5))
    fit = lawful_fit(Found(problem, [best, none], Evidence.among(problem, [best, none])), [])
    assert (fit is not None and fit.gained > 0.0) == told
    if told and fit:
        assert fit.hypothesis.effects == ('mass.spring',) and fit.place.explained > 0.9


def test_of_two_places_the_one_whose_law_fits_better_counts() -> None:
    """Whichever promises more: a force of the spring, or a reading that is off by the angle."""
    problem = LeastSquares(Swing(lambda angle: -4.0 * angle ** 3))
    none = Hypothesis((), (), problem.fit(problem.start(problem.machine.nuisances, {}), 5))
    found = Found(problem, [none], Evidence.among(problem, [none]))
    promised = [place for place in places(problem, none.state.point(), problem) if place.law]
    assert {place.component for place in promised} == {'mass', 'angle'}
    for first in promised:
        evidence = [1e4 if place is first else 9e3 for place in promised]
        fit = lawful_fit(found, [replace(place, law=replace(place.law, evidence=value))
                                 for place, value in zip(promised, evidence, strict=True)
                                 if place.law])
        assert fit is not None and fit.place.component == 'mass'


def test_a_law_acts_in_the_simulation() -> None:
    """A force against the motion that it makes: the curve is the one that the machine has."""
    fit = lawful(Swing(lambda angle: -4.0 * angle ** 3))
    assert fit.gained > 1000.0 and fit.place.law is not None
    at, values = np.array(fit.place.law.at), np.array(fit.place.law.values)
    force = -4.0 * at ** 3
    # the mass does not get farther, and is seldom there
    assert at.size > 8 and np.abs(at).max() < 0.7
    often = np.abs(at) < 0.55
    np.testing.assert_allclose(values[often], force[often], atol=0.1 * np.abs(force).max())


def test_a_law_that_the_equations_have_room_for_is_learnt_within_them() -> None:
    """The curve is the force's where the mass has been, and level beyond; noise teaches none."""
    fit = lawful(Learns(lambda angle: -4.0 * angle ** 3))
    law = fit.place.law
    assert fit.gained > 1000.0 and law is not None
    assert (fit.place.name, fit.place.component, law.by) == ('spring of the mass', 'mass', 'angle')
    at = np.array(law.at)
    assert at.size >= 7
    np.testing.assert_allclose(law.values, -4.0 * at ** 3, atol=0.1 * 4.0 * 0.6 ** 3)
    # fitted, the machine leaves the noise of its sensor
    left = fit.machine.experiments[0].measured - fit.machine.predict(
        fit.hypothesis.state.point(), 0)
    assert float(np.sqrt(np.mean(left ** 2))) == pytest.approx(0.005, rel=0.05)
    with pytest.raises(AssertionError):
        lawful(Learns(lambda angle: 0.0))


def test_a_law_has_the_units_of_its_place_and_deviations_that_hold() -> None:
    """Nineteen of twenty values lie within two deviations of the force, in newtons."""
    machine = Turning(3.0 * np.sin(ANGLE), NOTHING)
    machine.disturbance_inputs = (DisturbanceInput(
        'force on the left', 'left', unit='mN', size=1000.0),)
    problem = LeastSquares(machine)
    [law] = (place.law for place in places(problem, {}, problem)
             if place.component == 'left' and place.law)
    assert (law.by, law.unit, law.by_unit) == ('angle', 'mN', 'rad')
    off = np.array(law.values) - 3000.0 * np.sin(law.at)
    off -= off.mean()
    assert np.mean(np.abs(off) < 2.0 * np.array(law.deviations) + 30.0) > 0.8
    assert nearest_form(law)[0] == 'a straight line' or nearest_form(law)[1] < 0.05


def test_a_reading_that_has_the_name_of_a_quantity_is_that_quantity() -> None:
    machine = Read(NOTHING, NOTHING)
    twice = machine.with_experiments([
        replace(e, name=name, channels=('angle', 'rate'))
        for e in machine.experiments for name in 'ab'])
    found = quantities_of(twice, predicted(twice, {}))
    assert [*map(len, (found['angle'].values, found['rate'].values))] == [2, 2]
    assert (found['angle'].unit, found['load'].unit) == ('m', '')
    np.testing.assert_array_equal(found['rate'].values[1], 2.0 * RATE)


@pytest.mark.parametrize('shape, form', [
    (lambda x: 2.0 * x, 'a straight line'),
    (lambda x: 0.5 * np.sign(x), 'a jump at zero (Coulomb friction)'),
    (lambda x: np.sign(x) * np.maximum(np.abs(x) - 1.2, 0.0), 'a spring with slack, none within'),
    (lambda x: np.sign(x) * (1.0 + np.exp(-(x / 0.75) ** 2)), 'Stribeck friction, within 0.75'),
    (lambda x: x * np.abs(x), 'its square with its sign'),
])
def test_the_nearest_form_is_the_one_that_it_is(shape: Callable[[FloatArray], FloatArray],
                                                form: str) -> None:
    at = np.linspace(-3.0, 3.0, 12)
    values = shape(at) + 0.02 * np.random.default_rng(1).normal(size=12)
    name, lacks = nearest_form(Law('rate', '', 99.0, tuple(at), tuple(values), (0.02,) * 12,
                                   'rad/s', 'N', 0.5, 1.0))
    assert name.startswith(form) and lacks < 0.02
