# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Other effects in the place of the best one: in its other places, and of other kinds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.search.full_fits import FullFits
from simgap.search.hypothesis import Hypothesis
from simgap.search.search import Search
from simgap.search.training import begun, Part
from simgap.settings import DEFAULT

TIME = np.arange(0.0, 4.0, 0.01)
NOISE = 0.01


def effect(key: str, parts: tuple[str, ...] = ()) -> Effect:
    """Return an effect of one number."""
    number = Parameter(f'{key}.pull', 'N', -5.0, 5.0, 1e-3)
    return Effect(key, 'springs', '', '', (Form('', (number,)),), parts)


class Springs(Machine):
    """A body that both springs move alike; what they do apart is seen faintly."""

    def __init__(self, left: float, right: float) -> None:
        random = np.random.default_rng(4)
        made = moved(left, right) + NOISE * random.normal(size=(TIME.size, 2))
        super().__init__(
            [Experiment('pulled', TIME, ('together', 'apart'), ('m', 'm'), made,
                        np.full_like(made, NOISE))],
            [Parameter('offset', 'm', -0.02, 0.02, 1e-3, 0.01)],
            [effect('left.pull'), effect('right.pull'),
             effect('both.pull', ('left.pull', 'right.pull')), effect('drift')])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what is seen."""
        both = point.get('both.pull.pull', 0.0)
        return moved(point.get('left.pull.pull', 0.0) + both,
                     point.get('right.pull.pull', 0.0) + both) + point.get(
                         'offset', 0.0) + point.get('drift.pull', 0.0) * TIME[:, np.newaxis]


def moved(left: float, right: float) -> FloatArray:
    """Return what is seen of two pulls."""
    return np.column_stack([(left + right) * np.sin(TIME), 0.02 * (left - right) * np.cos(TIME)])


@pytest.mark.parametrize('left, right, leading, size', [
    (0.5, 0.5, 'left.pull', 1.0), (1.0, 0.0, 'both.pull', 0.5), (0.0, 1.0, 'left.pull', 1.0)])
def test_the_same_effect_in_other_places_is_tried(left: float, right: float, leading: str,
                                                  size: float) -> None:
    """Each begins at a size that does as much as what was found, and the true one wins."""
    machine = Springs(left, right)
    problem = LeastSquares(machine)
    search = Search(problem, lambda share, doing: None)
    form = machine.catalogue[leading].forms[0]
    start = problem.start([*machine.nuisances, *form.parameters], {f'{leading}.pull': size})
    singles = search._with_relatives([Hypothesis((leading,), (form,), problem.fit(start, 5))])
    assert {h.effects[0] for h in singles} == {'left.pull', 'right.pull', 'both.pull'}
    truth = {(0.5, 0.5): ('both.pull', 0.5), (1.0, 0.0): ('left.pull', 1.0),
             (0.0, 1.0): ('right.pull', 1.0)}[left, right]
    assert singles[0].effects == (truth[0],)
    assert singles[0].values[0][1] == pytest.approx(truth[1], abs=0.01)


def test_a_member_of_a_pair_is_tried_in_its_other_places() -> None:
    """The other member stays."""
    machine = Springs(0.0, 1.0)
    problem = LeastSquares(machine)
    search = Search(problem, lambda share, doing: None)
    forms = tuple(machine.catalogue[key].forms[0] for key in ('left.pull', 'drift'))
    start = problem.start([*machine.nuisances, *(p for form in forms for p in form.parameters)],
                          {'left.pull.pull': 1.0, 'drift.pull': 0.1})
    pairs = search._with_relatives([Hypothesis(('left.pull', 'drift'), forms,
                                               problem.fit(start, 5))])
    assert {h.effects for h in pairs} == {
        (key, 'drift') for key in ('left.pull', 'right.pull', 'both.pull')}
    assert pairs[0].effects == ('right.pull', 'drift')


def test_no_pair_has_one_effect_twice() -> None:
    """The other place of a member may be where its partner is."""
    machine = Springs(0.5, 0.2)
    problem = LeastSquares(machine)
    search = Search(problem, lambda share, doing: None)
    forms = tuple(machine.catalogue[key].forms[0] for key in ('left.pull', 'right.pull'))
    start = problem.start([*machine.nuisances, *(p for form in forms for p in form.parameters)],
                          {'left.pull.pull': 0.5, 'right.pull.pull': 0.2})
    pairs = search._with_relatives([Hypothesis(('left.pull', 'right.pull'), forms,
                                               problem.fit(start, 5))])
    assert {h.effects for h in pairs} == {
        ('left.pull', 'right.pull'), ('both.pull', 'right.pull'), ('left.pull', 'both.pull')}


def test_a_base_that_was_not_settled_is_given_partners_too() -> None:
    """A settled effect may pay more than before, and fall behind one without derivatives."""
    problem = LeastSquares(Springs(0.5, 0.5))
    search = Search(problem, lambda share, doing: None)
    none = search._nuisances_alone()
    search._take_sensitivities(none.state)
    form = problem.machine.catalogue['left.pull'].forms[0]
    start = search.problem.start([*problem.machine.nuisances, *form.parameters], {})
    bare = Hypothesis(('left.pull',), (form,), search.problem.fit(start, 5)).without_jacobian()
    assert {frozenset(h.effects) for h in search._pairs([bare])} >= {
        frozenset({'left.pull', 'drift'})}


class Scale(Machine):
    """A scale whose zero is off by five thousand standard deviations of its noise."""

    zero, order = 50.0, 0.1

    def __init__(self) -> None:
        random = np.random.default_rng(6)
        made = self.zero + NOISE * random.normal(size=(TIME.size, 1))
        wave = (Parameter('scale.wave.sine', 'm', -2e3, 2e3, 1e-2),
                Parameter('scale.wave.cosine', 'm', -2e3, 2e3, 1e-2))
        super().__init__(
            [Experiment('read', TIME, ('place',), ('m',), made, np.full_like(made, NOISE))],
            [Parameter('drift', 'm/s', -0.02, 0.02, 1e-3, 0.01)],
            [Effect('scale.wave', 'scale', '', '', (Form('', wave),), simpler=('scale.zero',)),
             Effect('scale.zero', 'scale', '', '', (Form('', (
                 Parameter('scale.zero.size', 'm', -2e3, 2e3, 1e-2),)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what is read."""
        return np.asarray(point.get('scale.wave.sine', 0.0) * np.sin(self.order * TIME)
                          + point.get('scale.wave.cosine', 0.0) * np.cos(self.order * TIME)
                          + point.get('scale.zero.size', 0.0) + point.get('drift', 0.0) * TIME)[
                              :, np.newaxis]


def of(problem: LeastSquares, ident: str, **at: float) -> Hypothesis:
    """Return a hypothesis with one effect, fitted from a point."""
    form = problem.machine.catalogue[ident].forms[0]
    start = problem.start([*problem.machine.nuisances, *form.parameters],
                          {f'{ident}.{name}': value for name, value in at.items()})
    return Hypothesis((ident,), (form,), problem.fit(start, 10))


def test_a_simpler_effect_begins_at_the_size_that_does_as_much() -> None:
    """From zero, a robust loss would not lead there."""
    problem = LeastSquares(Scale())
    fits = FullFits(problem, lambda share, doing: None)
    wave = of(problem, 'scale.wave', cosine=50.0)
    assert fits.simpler(wave) == [('scale.wave', 'scale.zero')]
    found = fits.exchanged(wave, 'scale.wave', 'scale.zero')
    assert found.effects == ('scale.zero',)
    # the noise of a mean, times three
    assert found.values[0][1] == pytest.approx(50.0, abs=3.0 * NOISE)
    assert found.cost < 0.6 * TIME.size
    assert fits.simpler(found) == []


def test_an_effect_that_is_left_out_takes_along_what_becomes_it() -> None:
    assert list(Scale().without(['scale.zero']).catalogue) == []
    assert list(Scale().without(['scale.wave']).catalogue) == ['scale.zero']
    assert list(Springs(0.0, 1.0).without(['left.pull']).catalogue) == ['right.pull', 'drift']


class Tilted(Machine):
    """A weight that is pushed at three tilts, where only one of two pushes depends on the tilt."""

    tilts = np.array([0.2, 0.8, 1.3])

    def __init__(self, weight: float) -> None:
        random = np.random.default_rng(5)
        super().__init__(
            [Experiment(f'tilt {tilt}', TIME, ('place',), ('m',),
                        self.place(weight * np.cos(tilt))
                        + NOISE * random.normal(size=(TIME.size, 1)),
                        np.full((TIME.size, 1), NOISE)) for tilt in self.tilts],
            [Parameter('offset', 'm', -0.02, 0.02, 1e-3, 0.01)],
            [effect('weight'), effect('push')])

    @staticmethod
    def place(force: float) -> FloatArray:
        """Return where the weight is: it sticks below a force."""
        moving = np.sign(force) * max(abs(force) - 0.3, 0.0)
        return moving * (1.0 - np.exp(-TIME))[:, np.newaxis]

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what is seen."""
        force = (point.get('push.pull', 0.0)
                 + point.get('weight.pull', 0.0) * np.cos(self.tilts[experiment]))
        return self.place(force) + point.get('offset', 0.0)


def test_an_effect_that_nothing_shows_where_a_fit_began_is_found_by_a_scan() -> None:
    """Where the weight sticks the derivatives by both pushes are nought."""
    machine = Tilted(2.0)
    problem = LeastSquares(machine)
    search = Search(problem, lambda share, doing: None)
    none = problem.start(machine.nuisances, {})
    search._take_sensitivities(none)
    form = machine.catalogue['push'].forms[0]
    start = problem.start([*machine.nuisances, *form.parameters], {'push.pull': 1.0})
    singles = search._exchanged([Hypothesis(('push',), (form,), problem.fit(start, 10))])
    assert singles[0].effects == ('weight',)
    assert singles[0].values[0][1] == pytest.approx(2.0, abs=0.01)


def test_a_wave_is_tried_out_in_every_phase_up_to_its_bounds() -> None:
    size = Parameter('sine', 'N m', -10.0, 10.0, 0.02)
    wave = Form('', (size, replace(size, name='cosine'),
                     replace(size, name='order', is_shape=True)), is_wave=True)
    sines, cosines = np.array([(p['sine'], p['cosine']) for p in wave.trials]).T
    amplitudes = np.unique(np.round(np.hypot(sines, cosines), 9))
    assert amplitudes[0] == pytest.approx(0.05)
    assert 4.0 < amplitudes[-1] <= 10.0
    assert np.all(amplitudes[1:] / amplitudes[:-1] < 3.0)
    # no wave is further from a trial than half the distance of two phases
    for phase in np.linspace(0.0, 2.0 * np.pi, 50):
        near = np.hypot(sines - np.sin(phase), cosines - np.cos(phase)).min()
        assert near < 0.7
    assert Form('', (size, replace(size, name='second'))).trials == []


def test_training_begins_at_a_size_that_its_own_tests_ask_for() -> None:
    """Where the weight sticks no derivative leads to it; the withheld test has no say."""
    machine = Tilted(2.0)
    part = Part(machine, [0, 1])
    form = machine.catalogue['weight'].forms[0]
    size = begun(part, [form], {}, DEFAULT)['weight.pull']
    others = [5.0 * share for share in (-0.9, -0.4, 0.0, 0.1, 0.9)]
    loss = LeastSquares(part).loss
    misfit = LeastSquares(part).residuals
    assert loss(misfit({'weight.pull': size})) < min(
        loss(misfit({'weight.pull': other})) for other in others)
    assert size == pytest.approx(2.0, abs=0.5)


def test_a_part_with_held_values_predicts_as_the_machine_at_them() -> None:
    """What is held need not be named again, in one experiment or in all."""
    machine = Tilted(2.0)
    held = Part(machine, [1, 2]).holding({'weight.pull': 1.5})
    for k, one in enumerate((1, 2)):
        whole = machine.predict({'weight.pull': 1.5, 'offset': 0.01}, one)
        assert np.array_equal(held.predict({'offset': 0.01}, k), whole)
        simulated = held.simulate([{'offset': 0.01}])[0][k]
        assert simulated is not None and np.array_equal(simulated, whole)
    assert np.array_equal(held.low_fidelity().predict({}, 0),
                          machine.predict({'weight.pull': 1.5}, 1))
