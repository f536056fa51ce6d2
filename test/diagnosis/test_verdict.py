# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""From fits to a verdict: what names the same is one answer, and when it is none of them."""

from __future__ import annotations

from dataclasses import replace
import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.search.evidence import Evidence
from simgap.search.hypothesis import Hypothesis
from simgap.search.search import Found
from simgap.settings import DEFAULT
from simgap.verdict.unknown_input import Place
from simgap.verdict.verdict import (
    also_seen, confusable, decide, ranked, unknown_probability, which,
)

SETTINGS = DEFAULT.verdict
NUMBER = Parameter('motor.gain', '1', -1.0, 1.0, 0.01, tolerance=0.02)
shares = st.floats(0.0, 1.0)


def fitted(cost: float, *effects: str, within: str = '') -> Hypothesis:
    """Return a hypothesis of this cost; one of its effects may be within its tolerance."""
    forms = tuple(Form('', (replace(
        NUMBER, name=f'{effect}.size', tolerance=2.0 if effect == within else NUMBER.tolerance),))
        for effect in effects)
    blank, alone = np.zeros(0), np.array([cost])
    return Hypothesis(effects, forms, FitState(
        tuple(form.parameters[0] for form in forms), np.ones(len(effects)), alone,
        np.zeros((0, 0), np.float32), blank, cost, kept_hessian=1e4 * np.eye(len(effects))))


class Nothing(Machine):
    """A machine of no reading, for verdicts on fits that were laid out beforehand."""

    def __init__(self) -> None:
        time = np.zeros(1)
        super().__init__([Experiment('one', time, ('y',), ('1',), np.zeros((1, 1)),
                                     np.ones((1, 1)))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return nothing."""
        return np.zeros((1, 1))


def found(*hypotheses: Hypothesis, tempered: float = 1.0, share: float = 0.0) -> Found:
    """Return what a search would have found with these fits; an error of form leaves a share."""
    none = next(h.cost for h in hypotheses if not h.effects)
    single = min((h.cost for h in hypotheses if len(h.effects) == 1), default=none)
    # the one signal of a fit has its whole cost
    end = min(h.cost for h in hypotheses)
    evidence = Evidence(
        DEFAULT.evidence, 1000, tempered, max(none - single, 0.0), by_signal=lambda cost: cost,
        least=np.array([end + share * (none - end)]))
    return Found(LeastSquares(Nothing()), evidence.ranked(hypotheses), evidence)


def place(explained: float, evidence: float = 1e4) -> Place:
    return Place('torque on the axis', 'axis', evidence, explained)


@pytest.mark.parametrize('tempered', [1.0, 4.0])
def test_probabilities_are_in_proportion_to_the_evidence(tempered: float) -> None:
    """Those of two hypotheses as dear as each other differ by their costs alone."""
    answers = ranked(found(fitted(5000.0), fitted(1000.0, 'axis.inertia'),
                           fitted(1003.0, 'axis.gain'), tempered=tempered), 0.1)
    assert [answer.effects for answer in answers] == [('axis.inertia',), ('axis.gain',), ()]
    assert sum(answer.probability for answer in answers) == pytest.approx(0.9)
    assert answers[0].probability / answers[1].probability == pytest.approx(
        math.exp(3.0 / tempered))


@pytest.mark.parametrize('noise_cost', [1e3, 1e6])
def test_the_price_of_an_effect_does_not_grow_with_the_samples(noise_cost: float) -> None:
    none = fitted(noise_cost)
    evidence = found(none).evidence
    price = evidence(none) - evidence(fitted(noise_cost, 'motor.gain'))
    little, much = (fitted(noise_cost - gain * price, 'motor.gain') for gain in (0.9, 1.1))
    assert ranked(found(none, little), 0.0)[0].effects == ()
    assert ranked(found(none, much), 0.0)[0].effects == ('motor.gain',)


def test_a_partner_has_to_explain_a_share_of_what_the_first_effect_does() -> None:
    """What an error of form may leave of a strong effect is no second one."""
    none, single = fitted(100000.0), fitted(2000.0, 'axis.inertia')
    leaves = DEFAULT.evidence.form_error ** 2 * 98000.0
    little, much = (fitted(2000.0 - gain * leaves, 'axis.inertia', 'motor.gain')
                    for gain in (0.9, 1.3))
    for tempered in (1.0, 4.0):
        for pair, first in ((little, single), (much, much)):
            searched = found(none, single, pair, tempered=tempered,
                             share=DEFAULT.evidence.form_error ** 2)
            assert ranked(searched, 0.0)[0].hypothesis is first


def test_an_effect_within_its_tolerance_is_not_named() -> None:
    none, small = fitted(20000.0), fitted(19000.0, 'motor.gain', within='motor.gain')
    [answer] = ranked(found(none, small), 0.05)
    assert answer.effects == () and answer.probability == pytest.approx(0.95)
    assert decide(found(none, small), [], -math.inf, True).word == 'no_gap'
    assert also_seen(found(none, small)) == [
        {'effect': 'motor.gain', 'gain': 1000.0, 'share': 1.0}]
    assert decide(found(none, small), [], -math.inf, False).word == 'too_few_to_judge'


def test_a_partner_within_its_tolerance_leaves_the_first_effect_alone() -> None:
    none, single = fitted(20000.0), fitted(5000.0, 'axis.inertia')
    pair = fitted(3000.0, 'axis.inertia', 'motor.gain', within='motor.gain')
    first = ranked(found(none, single, pair), 0.05)[0]
    assert first.effects == ('axis.inertia',)
    assert first.probability == pytest.approx(0.95, abs=1e-3)


def test_a_partner_of_nobody_who_was_fitted_alone_is_not_listed() -> None:
    none, other = fitted(20000.0), fitted(15000.0, 'axis.gain')
    pair = fitted(3000.0, 'axis.inertia', 'motor.gain', within='motor.gain')
    searched = found(none, other, pair)
    assert ranked(searched, 0.05)[0].effects == ('axis.inertia',)
    assert also_seen(searched) == []


@given(st.lists(st.floats(0.0, 30.0), min_size=3, max_size=3), shares)
def test_hypotheses_that_name_the_same_are_one_answer(behind: list[float],
                                                      unknown: float) -> None:
    """Its probability is the sum of theirs, and its fit that of what it names and no more."""
    none, single, helped, other = (
        fitted(20000.0), fitted(3000.0 + behind[0], 'axis.inertia'),
        fitted(3000.0 + behind[1], 'axis.inertia', 'motor.gain', within='motor.gain'),
        fitted(3000.0 + behind[2], 'axis.gain'))
    searched = found(none, single, helped, other)
    answers = {answer.effects: answer for answer in ranked(searched, unknown)}
    assert answers.keys() == {(), ('axis.inertia',), ('axis.gain',)}
    assert answers['axis.inertia',].hypothesis is single
    weight = {h.effects: math.exp(searched.evidence(h) - searched.evidence(searched.best))
              for h in searched.hypotheses}
    same = weight[single.effects] + weight[helped.effects]
    assert answers['axis.inertia',].probability == pytest.approx(
        (1.0 - unknown) * same / sum(weight.values()))
    assert sum(answer.probability for answer in answers.values()) == pytest.approx(1.0 - unknown)


def test_the_same_effects_in_another_order_are_the_same_answer() -> None:
    one, other = (fitted(3000.0, 'axis.inertia', 'motor.gain'),
                  fitted(3001.0, 'motor.gain', 'axis.inertia'))
    single = fitted(15000.0, 'axis.inertia')
    first, *rest = ranked(found(fitted(20000.0), single, one, other), 0.0)
    assert set(first.effects) == {'axis.inertia', 'motor.gain'}
    assert first.probability == pytest.approx(1.0)
    assert first.effects not in [answer.effects for answer in rest]


def test_a_small_partner_is_listed_apart() -> None:
    none, single = fitted(20000.0), fitted(1000.0, 'axis.inertia')
    pair = fitted(800.0, 'axis.inertia', 'motor.gain')
    searched = found(none, single, pair, tempered=4.0, share=DEFAULT.evidence.form_error ** 2)
    assert ranked(searched, 0.0)[0].effects == ('axis.inertia',)
    [seen] = also_seen(searched)
    assert seen == {'effect': 'motor.gain', 'gain': 50.0,
                    'share': pytest.approx(200.0 / 19000.0)}


@given(shares, shares, st.booleans())
def test_the_more_an_unknown_input_explains_the_likelier_is_the_unknown(
        one: float, other: float, named: bool) -> None:
    best = [fitted(1000.0, 'axis.inertia')] if named else []
    searched = found(fitted(20000.0), *best)
    little, much = (unknown_probability(searched, [place(share), place(0.0)], -math.inf)
                    for share in sorted([one, other]))
    assert SETTINGS.least_unknown <= little <= much <= SETTINGS.most_unknown


def test_the_place_that_explains_most_tells_of_the_unknown() -> None:
    searched = found(fitted(20000.0), fitted(1000.0, 'axis.inertia'))
    places = [place(0.05), place(0.17)]
    assert unknown_probability(searched, places, -math.inf) == unknown_probability(
        searched, places[1:], -math.inf)
    assert unknown_probability(searched, [], -math.inf) == pytest.approx(SETTINGS.least_unknown)
    # a law counts by what it makes likelier, which may be less
    lawful = [unknown_probability(searched, [], gained) for gained in (-50.0, -1.0, 1.0, 50.0)]
    assert lawful == sorted(lawful)
    assert [lawful[0], lawful[-1]] == pytest.approx(
        [SETTINGS.least_unknown, SETTINGS.most_unknown])


@pytest.mark.parametrize('explained, word', [
    (0.0, 'explained'), (SETTINGS.left, 'partly_explained'), (0.9, 'unknown_effect')])
def test_the_word_of_a_verdict_follows_from_the_unknown(explained: float, word: str) -> None:
    searched = found(fitted(20000.0), fitted(1000.0, 'axis.inertia'))
    # it is a share of the whole gap, and places say theirs of what is left
    left = 0.5 * searched.evidence.samples / searched.evidence.whole
    decision = decide(searched, [place(explained / left)], -math.inf, True)
    assert decision.word == word
    assert decision.answers[0].effects == ('axis.inertia',)


def test_effects_whose_exchange_costs_hardly_more_are_confusable() -> None:
    pair = [('axis.inertia', 'motor.gain', 1000.0), ('axis.inertia', 'motor.offset', 1001.0),
            ('axis.gain', 'motor.gain', 1000.0 + 2.0 * SETTINGS.confusable)]
    searched = found(fitted(90000.0), fitted(50000.0, 'motor.gain'),
                     *(fitted(cost, one, other) for one, other, cost in pair))
    assert confusable(searched) == [['motor.gain', 'motor.offset']]


def test_the_answers_of_a_verdict_are_one_in_all_with_none_and_unknown() -> None:
    searched = found(fitted(20000.0), fitted(1000.0, 'axis.inertia'), fitted(1002.0, 'axis.gain'))
    entries = which(decide(searched, [], -math.inf, True), SETTINGS)
    assert [entry['effects'] for entry in entries] == [
        ['axis.inertia'], ['axis.gain'], ['unknown'], ['none']]
    assert sum(entry['probability'] for entry in entries) == pytest.approx(1.0)
