# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Other effects in the place of the best one: in its other places, and of other kinds."""

from __future__ import annotations


import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.machine.part import Part
from simgap.search.screening import same_effect
from simgap.search.search import Found, Search
from springs import effect, NOISE, Springs, TIME


def searched(machine: Machine) -> Found:
    """Return what a search finds."""
    return Search(LeastSquares(machine), lambda share, doing: None).run()


@pytest.mark.parametrize('left, right, truth, size', [
    (0.5, 0.5, 'both.pull', 0.5), (1.0, 0.0, 'left.pull', 1.0), (0.0, 1.0, 'right.pull', 1.0)])
def test_the_same_effect_in_other_places_is_tried(left: float, right: float, truth: str,
                                                  size: float) -> None:
    """They are told apart by a signal that a screening hardly sees."""
    best = searched(Springs(left, right)).best
    assert best.effects == (truth,)
    assert best.values[0][1] == pytest.approx(size, abs=0.01)


@pytest.mark.parametrize('left, right, place', [
    (0.0, 1.0, 'right.pull'), (1.0, 0.0, 'left.pull'), (0.5, 0.5, 'both.pull')])
def test_a_member_of_a_pair_is_tried_in_its_other_places(left: float, right: float,
                                                         place: str) -> None:
    """The other member stays."""
    found = searched(Springs(left, right, drift=0.1))
    assert set(found.best.effects) == {place, 'drift'}


def test_an_effect_in_two_places_with_two_sizes_is_one_in_each() -> None:
    """No hypothesis has an effect twice: beside that in both places there is none in one."""
    found = searched(Springs(1.5, -0.7))
    assert set(found.best.effects) == {'left.pull', 'right.pull'}
    assert {p.name: size for p, size in found.best.values} == pytest.approx(
        {'left.pull.pull': 1.5, 'right.pull.pull': -0.7}, abs=0.02)
    catalogue = found.problem.machine.catalogue
    assert not any(same_effect(catalogue, effect, [o for o in h.effects if o != effect])
                   for h in found.hypotheses for effect in h.effects)


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
            [Effect('scale.wave', 'scale', '', (Form('', wave),), simpler=('scale.zero',)),
             Effect('scale.zero', 'scale', '', (Form('', (
                 Parameter('scale.zero.size', 'm', -2e3, 2e3, 1e-2),)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what is read."""
        return np.asarray(point.get('scale.wave.sine', 0.0) * np.sin(self.order * TIME)
                          + point.get('scale.wave.cosine', 0.0) * np.cos(self.order * TIME)
                          + point.get('scale.zero.size', 0.0) + point.get('drift', 0.0) * TIME)[
                              :, np.newaxis]


def test_a_simpler_effect_is_named_where_it_does_as_much() -> None:
    """Far from zero; a wave of a slow order passes for it."""
    best = searched(Scale()).best
    assert best.effects == ('scale.zero',)
    # the noise of a mean, times three
    assert best.values[0][1] == pytest.approx(50.0, abs=3.0 * NOISE)
    assert best.cost < 0.6 * TIME.size


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
    best = searched(Tilted(2.0)).best
    assert best.effects == ('weight',)
    assert best.values[0][1] == pytest.approx(2.0, abs=0.01)


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
