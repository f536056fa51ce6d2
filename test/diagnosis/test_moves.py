# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The moves of the search on a small machine: which effects each reaches, and with what size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Form, Nuisances, Parameter, Point
from simgap.search import moves
from simgap.search.hypothesis import Hypothesis
from simgap.search.screening import jacobian_of_form, Sensitivity
from springs import fitted, NOISE, Springs, TIME

# three deviations of the size of a pull, from the sum of squares of a sine
CLOSE = 3.0 * NOISE / float(np.sqrt(np.sum(np.sin(TIME) ** 2)))
# the same of a difference of two pulls, seen fiftyfold fainter
FAINT = 3.0 * NOISE / 0.02 / float(np.sqrt(np.sum(np.cos(TIME) ** 2)))


def sensitivity(problem: LeastSquares, base: Hypothesis, effect: str) -> Sensitivity:
    """Return the derivative by an effect that a hypothesis lacks."""
    form = problem.machine.catalogue[effect].forms[0]
    return Sensitivity(effect, form, jacobian_of_form(problem, base.state, form))


def sizes(hypothesis: Hypothesis) -> dict[str, float]:
    """Return the sizes of the effects by name."""
    return {p.name: size for p, size in hypothesis.values}


def is_at_its_optimum(problem: LeastSquares, found: Hypothesis) -> bool:
    """Return whether a fit from the values that it has, with fresh derivatives, gains nothing."""
    fresh = problem.start(found.state.parameters, found.state.point())
    return problem.fit(fresh, 10).cost > found.cost - 0.5


@pytest.mark.parametrize('begin', [None, {'left.pull.pull': 3.0}])
def test_an_added_effect_has_the_size_that_is_there(begin: Point | None) -> None:
    problem = LeastSquares(Springs(1.0, 0.0))
    none = fitted(problem, {})
    found = moves.added(problem, none, sensitivity(problem, none, 'left.pull'), begin)
    assert found.effects == ('left.pull',)
    assert sizes(found) == pytest.approx({'left.pull.pull': 1.0}, abs=CLOSE)
    assert is_at_its_optimum(problem, found)


def test_an_effect_is_added_beside_others() -> None:
    problem = LeastSquares(Springs(1.0, 0.0, drift=-0.2))
    base = fitted(problem, {'left.pull': 1.0})
    found = moves.added(problem, base, sensitivity(problem, base, 'drift'))
    assert found.effects == ('left.pull', 'drift')
    assert sizes(found) == pytest.approx({'left.pull.pull': 1.0, 'drift.pull': -0.2}, abs=CLOSE)
    assert is_at_its_optimum(problem, found)


class Shifted(Nuisances):
    """Nuisances whose offset can take over some of a drift."""

    removed: Point = {}

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """Return the offset with the mean of the drift, as far as its bounds allow."""
        self.removed = removed
        offset = point['offset'] + 2.0 * removed['drift.pull']
        return {**point, 'offset': min(max(offset, -0.02), 0.02)}


def test_where_an_effect_is_dropped_the_others_and_the_nuisances_follow() -> None:
    machine = Springs(1.0, 0.0, drift=0.005)
    machine.nuisances = nuisances = Shifted(machine.nuisances)
    problem = LeastSquares(machine)
    found = moves.dropped(problem, fitted(problem, {'left.pull': 1.0, 'drift': 0.0}), 'drift')
    assert nuisances.removed == pytest.approx({'drift.pull': 0.005}, abs=CLOSE)
    alone = fitted(problem, {'left.pull': 1.0})
    assert found.effects == ('left.pull',)
    assert found.state.parameters == alone.state.parameters
    assert is_at_its_optimum(problem, found)
    assert found.state.point() == pytest.approx(alone.state.point(), abs=CLOSE)


@pytest.mark.parametrize('was, other, size', [
    ('left.pull', 'right.pull', 1.0), ('both.pull', 'right.pull', 1.0),
    ('right.pull', 'both.pull', 0.5), ('left.pull', 'both.pull', 0.5)])
def test_an_exchanged_effect_begins_at_the_size_that_does_as_much(was: str, other: str,
                                                                  size: float) -> None:
    """The drift beside it stays."""
    truth = Springs(0.5, 0.5, 0.1) if other == 'both.pull' else Springs(0.0, 1.0, 0.1)
    problem = LeastSquares(truth)
    base = fitted(problem, {was: 1.0, 'drift': 0.0})
    form = problem.machine.catalogue[other].forms[0]
    found = moves.exchanged(problem, base, was, other, form)
    assert set(found.effects) == {other, 'drift'}
    assert sizes(found) == pytest.approx({f'{other}.pull': size, 'drift.pull': 0.1}, abs=CLOSE)
    assert is_at_its_optimum(problem, found)


def test_another_form_takes_the_place_of_a_form() -> None:
    """With other numbers for the same effect, here twice as large."""
    class Doubled(Springs):
        def predict(self, point: Point, experiment: int) -> np.ndarray:
            half = 0.5 * point.get('left.doubled', 0.0)
            return super().predict({**point, 'left.pull.pull': point.get(
                'left.pull.pull', 0.0) + half}, experiment)

    machine = Doubled(1.0, 0.0)
    doubled = Form('doubled', (Parameter('left.doubled', 'N', -9.0, 9.0, 1e-3),))
    machine.catalogue['left.pull'] = replace(machine.catalogue['left.pull'], forms=(
        *machine.catalogue['left.pull'].forms, doubled))
    problem = LeastSquares(machine)
    found = moves.exchanged(
        problem, fitted(problem, {'left.pull': 1.0}), 'left.pull', 'left.pull', doubled)
    assert found.forms == (doubled,)
    assert sizes(found) == pytest.approx({'left.doubled': 2.0}, abs=2.0 * CLOSE)


def test_an_effect_is_split_into_one_in_each_place_with_its_own_size() -> None:
    problem = LeastSquares(Springs(1.5, -0.7, 0.1))
    found = moves.split(problem, fitted(problem, {'both.pull': 0.4, 'drift': 0.0}), 'both.pull')
    assert set(found.effects) == {'left.pull', 'right.pull', 'drift'}
    assert sizes(found) == pytest.approx(
        {'left.pull.pull': 1.5, 'right.pull.pull': -0.7, 'drift.pull': 0.1}, abs=FAINT)
    assert is_at_its_optimum(problem, found)


def test_one_in_each_place_is_joined_to_one_in_both_of_the_mean_size() -> None:
    problem = LeastSquares(Springs(0.5, 0.5, 0.1))
    base = fitted(problem, {'left.pull': 0.6, 'drift': 0.0, 'right.pull': 0.4})
    found = moves.joined(problem, base)
    assert found is not None and set(found.effects) == {'both.pull', 'drift'}
    assert sizes(found) == pytest.approx({'both.pull.pull': 0.5, 'drift.pull': 0.1}, abs=CLOSE)
    assert is_at_its_optimum(problem, found)


@pytest.mark.parametrize('effects', [
    {'left.pull': 1.0, 'drift': 0.0}, {'left.pull': 1.0}, {}])
def test_what_is_not_in_all_places_is_not_joined(effects: Point) -> None:
    problem = LeastSquares(Springs(0.5, 0.5))
    assert moves.joined(problem, fitted(problem, effects)) is None


def test_a_hypothesis_is_fitted_to_another_problem_from_where_it_has_ended() -> None:
    """There the noise is four times as large, and the pull another one."""
    louder = LeastSquares(Springs(0.8, 0.0), scale=4.0)
    base = fitted(LeastSquares(Springs(1.0, 0.0)), {'left.pull': 1.0})
    nuisances = louder.jacobian(base.state.point(), louder.machine.nuisances,
                                louder.residuals(base.state.point()), central=True)
    found = moves.refitted(louder, base, base, nuisances)
    assert found.effects == ('left.pull',)
    assert sizes(found) == pytest.approx({'left.pull.pull': 0.8}, abs=CLOSE)
    assert is_at_its_optimum(louder, found)
    assert found.cost == pytest.approx(TIME.size / 16.0, rel=0.1)


def test_a_hypothesis_is_settled_without_the_derivatives_that_it_has_dropped() -> None:
    problem = LeastSquares(Springs(1.0, 0.0))
    base = fitted(problem, {'left.pull': 1.0})
    away = problem.start(base.state.parameters, {'left.pull.pull': 0.7})
    found = moves.settled(problem, replace(base, state=away.without_jacobian()), 3)
    assert sizes(found) == pytest.approx({'left.pull.pull': 1.0}, abs=CLOSE)
    assert is_at_its_optimum(problem, found)
