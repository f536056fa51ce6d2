# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where a gap lies, on a machine whose parts, signals and regimes are laid out beforehand."""

from __future__ import annotations

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import DisturbanceInput, FloatArray
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT
from simgap.verdict.diagnosis import diagnose
from simgap.verdict.localisation import of_effects, of_the_unknown
from simgap.verdict.unknown_input import components, courses, Place, places
from simgap.verdict.verdict import Answer
from two_lags import HALF, TIME, TwoLags


def smooth(seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    waves = np.sin(np.multiply.outer(TIME, random.uniform(1.0, 6.0, 6))
                   + random.uniform(0.0, 6.3, 6))
    return np.asarray(waves.sum(axis=1))


def parts_of_the_unknown(problem: LeastSquares, none: FitState,
                         ) -> tuple[list[Place], dict[str, float]]:
    """Return where an unknown input may act, and how likely each part is."""
    found = places(problem, none.point())
    return found, components(found, DEFAULT.localisation.caution)


def test_an_effect_lies_in_its_part_its_signal_and_its_regime() -> None:
    problem = LeastSquares(TwoLags(2.0 * HALF.astype(np.float64), 0.0 * TIME))
    effect = problem.machine.catalogue['left.step']
    none = problem.fit(problem.start(problem.machine.nuisances, {}), 10)
    number = effect.forms[0].parameters[0]
    best = problem.fit(problem.start((*problem.machine.nuisances, number), {}), 10)
    answers = [Answer(Hypothesis(('left.step',), effect.forms, best), 0.9),
               Answer(Hypothesis((), (), none), 0.1)]
    found = of_effects(problem, answers, none, best)
    assert (found[0]['component'], found[0]['signal'], found[0]['regime']) == (
        'left', 'seen left', 'second half')
    assert found[0]['share'] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize('side', ['left', 'right'])
def test_an_unknown_force_lies_where_it_acts(side: str) -> None:
    course = smooth(1)
    machine = (TwoLags(course, 0.0 * TIME) if side == 'left' else TwoLags(0.0 * TIME, course))
    problem = LeastSquares(machine)
    none = problem.fit(problem.start(machine.nuisances, {}), 10)
    likeliest, parts = parts_of_the_unknown(problem, none)
    found = of_the_unknown(problem, none, parts)
    assert likeliest[0].name == f'force on the {side}'
    assert likeliest[0].explained > 0.9
    assert found[0]['component'] == side and found[0]['signal'] == f'seen {side}'
    assert sum(parts.values()) == pytest.approx(1.0) and max(parts, key=parts.__getitem__) == side


def test_the_course_of_an_unknown_force_is_the_force() -> None:
    course = smooth(1)
    machine = TwoLags(course, 0.0 * TIME)
    problem = LeastSquares(machine)
    none = problem.fit(problem.start(machine.nuisances, {}), 10)
    [(times, values)] = courses(problem, none.point(), machine.disturbance_inputs[0])
    assert np.all(np.diff(times) > 0.0)
    inner = slice(10, -10)
    error = values[inner] - np.interp(times[inner], TIME, course)
    assert float(np.sqrt(np.mean(error ** 2))) < 0.1 * float(np.std(course))


def test_what_is_too_fast_for_a_pulse_lies_in_its_reading() -> None:
    machine = TwoLags(0.0 * TIME, 0.0 * TIME)
    machine.experiments[0].measured[:, 1] += 0.5 * np.sin(2.0 * np.pi * 37.0 * TIME)
    verdict = diagnose(machine)
    assert verdict.word == 'unknown_effect'
    assert {item['component'] for item in verdict.where} == {'seen right'}


def test_where_nothing_is_nothing_is_located() -> None:
    verdict = diagnose(TwoLags(0.0 * TIME, 0.0 * TIME))
    assert verdict.word == 'no_gap'
    assert list(verdict.where) == [] and list(verdict.may_enter_at) == []


@pytest.mark.parametrize('side', ['left', 'right'])
@pytest.mark.parametrize(('size', 'word'), [
    (0.0, 'no_gap'), (0.06, 'no_gap'), (1.0, 'unknown_effect')])
def test_the_next_test_is_told_where_something_without_a_name_may_act(
        size: float, word: str, side: str) -> None:
    forces = {'left': 0.0 * TIME, 'right': 0.0 * TIME, side: size * smooth(1)}
    found = diagnose(TwoLags(**forces)).as_data()
    assert found['verdict'] == word
    unnamed = found['planning']['unnamed']
    if not size:
        assert not unnamed
        return
    [unknown] = [item['probability'] for item in found['which'] if item['effects'] == ['unknown']]
    assert max(unnamed, key=unnamed.__getitem__) == side
    assert sum(unnamed.values()) == pytest.approx(unknown, abs=0.02)
    # a verdict without a gap names no place
    assert bool(found['where']) == bool(found['may_enter_at']) == (word == 'unknown_effect')


class PushedEveryDay(TwoLags):
    """The same, with a force on the left every day."""

    disturbance_inputs = (DisturbanceInput('force on the left', 'left', everyday=0.5),
                          TwoLags.disturbance_inputs[1])


@pytest.mark.slow
def test_a_force_of_every_day_is_no_gap_and_more_of_it_is_found_in_its_place() -> None:
    little = 0.25 * smooth(5), 0.0 * TIME
    assert diagnose(TwoLags(*little)).word == 'unknown_effect'
    assert diagnose(PushedEveryDay(*little)).word == 'no_gap'
    elsewhere = diagnose(PushedEveryDay(*reversed(little)))
    assert (elsewhere.word, elsewhere.may_enter_at[0].component) == ('unknown_effect', 'right')
    more = diagnose(PushedEveryDay(3.0 * smooth(5), 0.0 * TIME))
    assert (more.word, more.may_enter_at[0].component) == ('unknown_effect', 'left')
