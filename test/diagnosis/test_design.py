# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The search for the next test, on a machine whose best test is known beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
import json
from typing import Any

from blas_threads import during, Look
import numpy as np
import pytest
from simgap.machine.contract import (
    Course, DisturbanceInput, Effect, Experiment, FloatArray, Form, Machine, Parameter, Point,
)
from simgap.machine.process import process
from simgap.next_test import design
from simgap.next_test.candidate import Candidate
from simgap.next_test.design import CRITERIA, DesignEffort, TestDesign
from simgap.next_test.proposal import as_data, contents, lines
from simgap.next_test.rivals import Findings
from simgap.next_test.separation import Separation, separation
from simgap.next_test.space import TestSpace
from simgap.search.rival import Rival

SMALL = DesignEffort(drawn=8, judged=6, fitted=6)


class Lever(Machine):
    """
    A lever that is deflected by a load: y = (compliance + hardening load^2 + copy) load.

    A test is a load. Compliance and its copy are alike at any load; hardening shows at a great
    one alone.
    """

    def __init__(self, load: float, sigma: float = 0.03) -> None:
        self.load = load
        super().__init__(
            [Experiment('next', np.linspace(0.0, 1.0, 60), ('y',), ('m',), np.zeros((60, 1)),
                        np.full((60, 1), sigma), model_error=np.zeros(1))],
            [Parameter('zero', 'm', -1.0, 1.0, 0.01, 0.05)],
            [Effect(f'lever.{name}', 'lever', '', (Form('', (
                Parameter(f'lever.{name}', '1', -10.0, 10.0, 0.01),)),))
             for name in ('compliance', 'hardening', 'copy')])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        swing = self.load * np.sin(2.0 * np.pi * self.experiments[0].time)
        y = (1.0 + point.get('lever.compliance', 0.0) + point.get('lever.copy', 0.0)
             + point.get('lever.hardening', 0.0) * swing ** 2) * swing + point.get('zero', 0.0)
        return np.asarray(y[:, None])


class Loads(TestSpace):
    """Loads up to a limit."""

    families = ('weak', 'strong')

    def __init__(self, limit: float) -> None:
        self.limit = limit

    def draw(self, family: str, random: np.random.Generator) -> float:
        bounds = (0.001, 0.005) if family == 'weak' else (0.5, 2.0)
        return float(random.uniform(*bounds))

    def machine(self, test: Any) -> Lever:
        return Lever(test)

    def use(self, machine: Machine, points: Sequence[Point]) -> Mapping[str, float]:
        assert isinstance(machine, Lever)
        return {'load_N': machine.load / self.limit, 'other': 0.0}

    def unread(self, machine: Machine, one: Point, other: Point) -> Mapping[str, float]:
        return {'strain gauge': abs(one.get('lever.copy', 0.0) - other.get('lever.copy', 0.0)),
                'blind gauge': 0.0}


def rival(name: str, size: float, probability: float) -> Rival:
    effects = (f'lever.{name}',) if name else ()
    return Rival(effects, effects, ('',) * len(effects), probability, ('zero', *effects),
                 np.array([0.0, size][:1 + len(effects)]),
                 np.diag([1e-4, 0.01][:1 + len(effects)]))


HARD = [rival('compliance', 0.2, 0.6), rival('hardening', 0.3, 0.4)]


@pytest.mark.parametrize('objective', sorted(CRITERIA))
def test_a_strong_load_within_the_limit_is_proposed(objective: str) -> None:
    found = TestDesign(Loads(1.6), Findings(HARD), objective, effort=SMALL).run()
    assert found.criterion == CRITERIA[objective]
    assert all(test.use['load_N'] <= SMALL.margin for test in found.tests)
    assert found.refused['load_N'] > 0
    assert found.tests[0].family == 'strong'
    assert found.tests[0].test > 0.75


def test_the_promise_for_the_best_test_is_confirmed_by_fits() -> None:
    found = TestDesign(Loads(1.6), Findings(HARD), effort=SMALL).run()
    data = as_data(found, Loads(1.6))
    assert data['expected']['confirmed']
    assert data['expected']['right_after'] > 0.95 > data['expected']['right_before']
    assert data['expected']['surely'] == 1.0
    assert len(data['others']) > 1


class Promising(Loads):
    """Great loads promise most."""

    families = ('modest', 'great')

    def draw(self, family: str, random: np.random.Generator) -> float:
        return float(random.uniform(*((0.3, 0.5) if family == 'modest' else (1.2, 1.6))))


@pytest.mark.parametrize('kept, family', [(1.0, 'great'), (1e-3, 'modest')])
def test_where_a_family_breaks_its_promises_another_one_is_proposed(
        kept: float, family: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(machine: Lever, rivals: Any, inflated: float, fitted: bool = True) -> Separation:
        told = separation(machine, rivals, inflated, fitted)
        share = kept if fitted and machine.load > 1.0 else 1.0
        return replace(told, lack=share * told.lack)

    monkeypatch.setattr(design, 'separation', broken)
    found = TestDesign(Promising(2.0), Findings(HARD), effort=SMALL).run()
    assert found.tests[0].family == family


def _compound(test: Candidate, unlisted: float) -> float:
    assert test.separation is not None
    told = test.separation.information()
    return (1.0 - unlisted) * np.log(told) - unlisted * np.log(test.coarseness)


def test_other_effects_weigh_as_much_as_no_answer_is_likely() -> None:
    """A verdict leaves 0.6 to something without a name: its answers are worth 0.4."""
    doubted = [replace(rival, probability=0.4 * rival.probability) for rival in HARD]
    found = TestDesign(Loads(1.6), Findings(doubted), effort=SMALL).run()
    assert len(found.tests) > 1
    assert all(test.score == pytest.approx(_compound(test, 0.6)) for test in found.tests)


def test_where_no_load_within_the_limit_helps_the_limit_is_named() -> None:
    found = TestDesign(Loads(0.2), Findings(HARD), effort=SMALL).run()
    assert not found.tests
    data = as_data(found, Loads(0.2))
    said = lines(data)
    assert said[0] == 'no test within the limits helps'
    assert 'load_N' in said[1] and 'strong' in said[1]
    assert contents(found, Loads(0.2))['title'] == 'No test within the limits helps'


def test_what_no_test_tells_apart_is_said_with_the_sensor_that_would() -> None:
    alike = [rival('compliance', 0.2, 0.5), rival('copy', 0.2, 0.3), rival('hardening', 0.3, 0.2)]
    found = TestDesign(Loads(1.6), Findings(alike), effort=SMALL).run()
    data = as_data(found, Loads(1.6))
    [pair] = data['not_told_apart']
    assert pair['rivals'] == ['lever.compliance', 'lever.copy']
    assert [item['sensor'] for item in pair['sensors']] == ['strain gauge']
    assert any('strain gauge would' in line for line in lines(data))
    # hardening is split from both, and they share what they had
    shares = {tuple(item['effects']): item['after_if_true'] for item in data['expected']['each']}
    assert shares[('lever.hardening',)] > 0.95
    assert shares[('lever.compliance',)] == pytest.approx(0.5 / 0.8, abs=0.02)


def test_with_a_single_answer_there_is_nothing_to_tell_apart() -> None:
    found = TestDesign(Loads(1.6), Findings([rival('compliance', 0.2, 0.95)]), effort=SMALL).run()
    assert not found.tests
    assert 'nothing to tell apart' in lines(as_data(found, Loads(1.6)))[1]


def test_a_suspicion_is_looked_for_alone() -> None:
    found = TestDesign(Loads(1.6), objective='detect', suspected=['lever.hardening'],
                       effort=SMALL).run()
    assert set(found.tests[0].sizes) == {'lever.hardening'}
    greatest = max(test.test for test in found.tests)
    assert found.tests[0].test == greatest


class Heated(Loads):
    """The same loads, with heat or without: only heat shows how the lever expands."""

    families = ('cold', 'hot')

    def draw(self, family: str, random: np.random.Generator) -> Any:
        return float(random.uniform(1.0, 1.4)), family == 'hot'

    def machine(self, test: Any) -> Lever:
        load, hot = test
        lever = HotLever(load) if hot else Lever(load)
        lever.catalogue[EXPANSION.id] = EXPANSION
        return lever


EXPANSION = Effect('lever.expansion', 'lever', '', (Form('', (
    Parameter('lever.expansion', '1', -10.0, 10.0, 0.01),)),))


class HotLever(Lever):
    """The lever in an oven."""

    def predict(self, point: Point, experiment: int) -> FloatArray:
        warmth = self.experiments[0].time[:, None] ** 2
        return np.asarray(super().predict(point, experiment)
                          + point.get('lever.expansion', 0.0) * warmth)


@pytest.mark.parametrize('seed', range(5))
def test_of_tests_that_tell_the_rivals_apart_one_that_shows_more_is_proposed(seed: int) -> None:
    found = TestDesign(Heated(1.6), Findings(HARD), effort=SMALL, seed=seed).run()
    best, cold = found.tests[0], next(t for t in found.tests if not t.test[1])
    for test in (best, cold):
        assert test.separation is not None and test.separation.expected() > 0.95
    assert best.test[1]
    # the expansion, one effect of four, counts as a thousand times too large in the cold
    assert cold.coarseness / best.coarseness == pytest.approx(1000.0 ** 0.25, rel=0.2)
    data = as_data(found, Heated(1.6))
    assert data['sizes_over_least'] == best.coarseness
    assert any(f'{best.coarseness:.1f} times the least size' in line for line in lines(data))


def test_what_the_tests_so_far_have_shown_counts_for_no_further_test() -> None:
    class Softened(Heated):
        """An oven holds half the load: a hot test shows the expansion, and all else worse."""

        def machine(self, test: Any) -> Lever:
            load, hot = test
            return super().machine((load / 2.0 if hot else load, hot))

    def found(shown: Mapping[str, float]) -> Candidate:
        return TestDesign(Softened(1.6), Findings(shown=shown), 'detect',
                          effort=SMALL).run().tests[0]

    _, hot = found({}).test
    assert hot
    best = found({'lever.expansion': 1e-6})
    assert not best.test[1]
    assert best.sizes['lever.expansion'] == (1e-6, '1')
    # shown at a great size only, it is left to the next test
    assert found({'lever.expansion': 9.0}).test[1]


@pytest.mark.parametrize(('unnamed', 'share'), [
    ({}, 0.25), ({'lever': 0.8}, 0.2 / 4), ({'hinge': 0.8}, 0.25), ({'oven': 0.8}, 0.8 + 0.2 / 4)])
def test_the_next_test_shows_the_part_where_something_without_a_name_may_lie(
        unnamed: Mapping[str, float], share: float) -> None:
    class Faint(Heated):
        """An oven with hardly any load: a hot test shows the expansion, and little else."""

        def machine(self, test: Any) -> Lever:
            load, hot = test
            lever = super().machine((load / 50.0 if hot else load, hot))
            lever.catalogue[EXPANSION.id] = replace(EXPANSION, component='oven')
            return lever

    found = TestDesign(Faint(1.6), Findings(unnamed=unnamed), 'detect', effort=SMALL).run()
    asked = 'oven' in unnamed
    assert found.tests[0].test[1] == asked
    cold = next(test for test in found.tests if not test.test[1])
    # the expansion, one effect of four, counts as a thousand times too large in the cold
    assert cold.coarseness == pytest.approx(1000.0 ** share, rel=0.3)
    said = lines(as_data(found, Faint(1.6)))
    assert any('may lie in oven (80 %)' in line for line in said) == asked


def test_findings_come_back_from_the_file_of_a_verdict() -> None:
    findings = Findings(HARD, 2.5, {'y': {'white': 0.1}}, {'lever.copy': 0.3}, {'lever': 0.4})
    again = Findings.of_data(json.loads(json.dumps(findings.as_data())))
    assert again.as_data() == findings.as_data()
    assert again.shown == {'lever.copy': 0.3} and again.inflated == 2.5
    assert again.unnamed == {'lever': 0.4}
    # an earlier version wrote no noise, nor what has shown, nor where the unnamed may lie
    assert Findings.of_data({'rivals': [], 'inflation': 1.0}) == Findings([])


def test_the_same_seed_proposes_the_same_test() -> None:
    one, other, third = (
        TestDesign(Loads(1.6), Findings(HARD), effort=SMALL, seed=seed).run().tests[0]
        for seed in (3, 3, 4))
    assert isinstance(one, Candidate) and one.test == other.test != third.test


def test_linear_algebra_has_one_thread_because_tests_are_judged_side_by_side() -> None:
    class Watched(Loads):
        def __init__(self, look: Look) -> None:
            super().__init__(1.6)
            self.look = look

        def machine(self, test: Any) -> Lever:
            self.look()
            return super().machine(test)

    assert during(lambda look: TestDesign(
        Watched(look), Findings(HARD), effort=SMALL).run()) == {1}


class Windy(Lever):
    """The lever in the wind of every day, with a coarse twin that knows none."""

    def __init__(self, load: float, seen: list[str], wind: float) -> None:
        super().__init__(load)
        self.disturbance_inputs = (DisturbanceInput('wind', 'lever', everyday=wind),)
        self._seen = seen
        self._coarse: Machine = copy(self)

    def low_fidelity(self) -> Machine:
        return getattr(self, '_coarse', self)

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        self._seen.append(place.name)
        return [self.predict(point, 0) + courses[0](self.experiments[0].time)[:, np.newaxis]]


def test_a_test_is_judged_in_the_wind_of_every_day_which_is_simulated_once() -> None:
    class Outdoors(Loads):
        def __init__(self, wind: float) -> None:
            super().__init__(1.6)
            self.seen: list[str] = []
            self.wind = wind

        def machine(self, test: Any) -> Lever:
            return Windy(test, self.seen, self.wind)

    def found(wind: float) -> tuple[Candidate, int]:
        space = Outdoors(wind)
        test = TestDesign(space, Findings(HARD), effort=SMALL).run().tests[0]
        return test, len(space.seen)

    (calm, none), (windy, runs) = found(0.0), found(0.3)
    once: list[str] = []
    process(Windy(1.0, once, 0.3), {})
    assert (none, runs) == (0, SMALL.fitted * len(once))
    assert calm.separation is not None and windy.separation is not None
    assert windy.separation.lack[0, 1] < 0.5 * calm.separation.lack[0, 1]
    assert all(windy.sizes[name][0] > 1.5 * size for name, (size, _) in calm.sizes.items())
