# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a hypothesis costs, and when it is none: prices, strangeness and the unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from antenna_drive.diagnosis.gust import gust_form, KNOT_S, knots
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from simgap.fit.residual_statistics import fast_power, power, slow_excess
from simgap.fit.state import FitState
from simgap.machine.contract import FloatArray, Form, Parameter
from simgap.search.elimination import backward_elimination, converged_rivals, forward_selection
from simgap.search.full_fits import FullFits
from simgap.search.hypothesis import Hypothesis, penalty
from simgap.settings import DEFAULT
from simgap.verdict.verdict import also_seen, best, decide, LackOfFit, rank, unknown_probability

SETTINGS = DEFAULT.verdict
NUMBER = Parameter('motor.gain', '1', -1.0, 1.0, 0.01, tolerance=0.02)
shares = st.floats(0.0, 1.0)


def unknown(lack: LackOfFit) -> float:
    return unknown_probability(lack, SETTINGS)


def fitted(effects: tuple[str, ...], cost: float,
           curvature: dict[str, float] | None = None) -> Hypothesis:
    """Return a candidate of this cost; its effects are sure but those whose curvature is given."""
    parameters = tuple(replace(NUMBER, name=f'{effect}.size', tolerance=0.0) for effect in effects)
    forms = tuple(Form('', (p,)) for p in parameters)
    blank = np.zeros(0)
    hessian = np.diag([(curvature or {}).get(effect, 1e12) for effect in effects])
    return Hypothesis(effects, forms, FitState(
        parameters, np.ones(len(effects)), blank, np.zeros((0, 0), np.float32), blank, cost,
        kept_hessian=hessian))


@given(st.floats(-1.0, 1.0))
def test_effect_within_a_tolerance_is_dear(value: float) -> None:
    """The price falls to that of any effect as a value outgrows its tolerance."""
    dear = penalty([Form('', (NUMBER,))], {NUMBER.name: value}, DEFAULT.penalty)
    plain = penalty([Form('', (replace(NUMBER, tolerance=0.0),))],
                    {NUMBER.name: value}, DEFAULT.penalty)
    assert dear - plain == pytest.approx(
        DEFAULT.penalty.tolerated * max(0.0, 1.0 - abs(value) / 0.02))


@settings(max_examples=200)
@given(st.floats(0.0, 100.0), shares, st.floats(0.5, 100.0), shares, st.floats(0.0, 5.0),
       st.floats(-5.0, 1.0), st.sampled_from(['slow_excess', 'left', 'fast', 'fast_left',
                                              'implausibility', 'regular']),
       st.floats(1.0, 5.0), shares)
def test_more_of_anything_left_is_never_less_unknown(
        excess: float, left: float, loud: float, loud_left: float, strange: float,
        explained: float, which: str, times: float, regular: float) -> None:
    """The probability of the unknown is one, and rises with all that speaks for it."""
    remains = LackOfFit(excess, left, loud, loud_left, strange, explained, regular=regular)
    more = replace(remains, **{which: times * getattr(remains, which)})
    assert 0.0 <= unknown(remains) <= unknown(more) + 1e-12 <= 1.0 + 1e-9


def test_noise_is_not_unknown_and_hum_is() -> None:
    """White noise of the sheet's size raises nothing; four times as loud a signal does."""
    assert unknown(LackOfFit(0.0, 0.0)) == pytest.approx(SETTINGS.least_unknown, abs=0.01)
    assert unknown(LackOfFit(0.0, 0.0, fast=16.0, fast_left=1.0)) == pytest.approx(
        SETTINGS.most_unknown, abs=0.05)
    # a wave that was fifty times as loud without the effect is explained, except its finer form
    assert unknown(LackOfFit(
        0.0, 0.0, fast=16.0, fast_left=0.02)) < SETTINGS.least_unknown + 0.05
    # without an effect, nothing explains that it has become less loud
    assert unknown(LackOfFit(0.0, 0.0, fast=16.0, fast_left=0.02, named=False)) == pytest.approx(
        SETTINGS.most_unknown, abs=0.05)


def test_a_regular_residual_counts_beside_a_named_effect_by_the_share_that_it_is() -> None:
    assert unknown(LackOfFit(0.0, 0.0, regular=0.9, named=False)) > 0.7
    assert unknown(LackOfFit(0.0, 0.3, regular=0.9)) > 0.6
    assert unknown(LackOfFit(0.0, 0.01, regular=0.9)) < 0.2


def test_one_sample_beside_its_edge_is_no_noise() -> None:
    """A single sample that is off by any amount makes a signal neither loud nor slow."""
    z: FloatArray = np.random.default_rng(0).normal(size=2000)
    z[700] = 500.0
    assert fast_power(z) < 1.2 and power(z) < 1.2 and abs(slow_excess(z)) < 0.3


def test_wind_has_no_jumps() -> None:
    """A smooth random course is a gust; a load that shifts once is none."""
    form = gust_form([30.0])
    time = KNOT_S * np.arange(knots(30.0))
    random = np.random.default_rng(2)
    frequencies, phases = np.geomspace(0.02, 1.0, 24), random.uniform(0.0, 6.3, 24)
    wind = 1e4 * np.sin(2.0 * np.pi * np.multiply.outer(time, frequencies) + phases).sum(axis=1)
    ballast = np.where(time > 11.0, 8e4, 0.0) + 300.0 * random.normal(size=time.size)
    names = [p.name for p in form.parameters]

    def implausibility(torque: FloatArray, deviation: float | FloatArray = 1e3) -> float:
        deviations = np.broadcast_to(deviation, torque.shape)
        return form.implausibility(dict(zip(names, torque.tolist())),
                                   dict(zip(names, deviations.tolist())))

    assert implausibility(wind) < 0.7
    assert implausibility(ballast) > 2.0
    # what the data do not determine tells nothing: they begin with motion at 5 s, end at 30 s
    unseen = (time < 5.5) | (time > 30.0)
    pulled = np.where(unseen, 0.0, wind)
    pulled[[10, -1]] = -4e5, 9e5
    assert implausibility(pulled) > 2.0
    assert implausibility(pulled, np.where(unseen, 3e4, 1e3)) < 0.7


def test_one_effect_in_two_places_needs_less_proof_than_two_effects() -> None:
    """A partner has to explain its share; the same effect elsewhere, of another size, less."""
    none, single = fitted((), 100000.0), fitted(('motors.gain',), 2000.0)
    twins = fitted(('motor_1.gain', 'motor_2.gain'), 1000.0)
    pair = fitted(('motors.gain', 'axis.inertia'), 1000.0)
    assert rank([none, single, twins], 0.0, DEFAULT)[0].hypothesis is twins
    assert rank([none, single, pair], 0.0, DEFAULT)[0].hypothesis is single


@pytest.mark.parametrize('noise_cost', [1e3, 1e6])
def test_the_price_of_an_effect_does_not_grow_with_the_samples(noise_cost: float) -> None:
    price = DEFAULT.penalty.effect + DEFAULT.penalty.parameter
    none = fitted((), noise_cost)
    little, much = (fitted(('motor.gain',), noise_cost - gain * price) for gain in (0.9, 1.1))
    assert rank([none, little], 0.0, DEFAULT)[0].effects == ()
    assert rank([none, much], 0.0, DEFAULT)[0].effects == ('motor.gain',)


def within_tolerance(hypothesis: Hypothesis, *effects: str) -> Hypothesis:
    """Return a hypothesis whose values of some effects a healthy machine may have."""
    forms = tuple(
        Form('', (replace(form.parameters[0], tolerance=2.0 * (effect in effects)),))
        for effect, form in zip(hypothesis.effects, hypothesis.forms, strict=True))
    return replace(hypothesis, forms=forms)


def test_an_effect_within_its_tolerance_is_not_named() -> None:
    none = fitted((), 20000.0)
    small = within_tolerance(fitted(('motor.gain',), 19000.0), 'motor.gain')
    answers = rank([none, small], 0.05, DEFAULT)
    assert [answer.effects for answer in answers] == [()]
    assert answers[0].probability == pytest.approx(0.95)
    decision = decide([none, small], LackOfFit(0.0, 0.0), DEFAULT)
    assert decision.word == 'no_gap'
    assert also_seen([none, small], DEFAULT) == [
        {'effect': 'motor.gain', 'gain': 1000.0, 'share': 1.0, 'within_tolerance': True,
         'unsure': False}]


def test_a_partner_within_its_tolerance_leaves_the_first_effect_alone() -> None:
    none, single = fitted((), 20000.0), fitted(('axis.inertia',), 5000.0)
    pair = within_tolerance(fitted(('axis.inertia', 'motor.gain'), 3000.0), 'motor.gain')
    first = rank([none, single, pair], 0.05, DEFAULT)[0]
    assert first.effects == ('axis.inertia',)
    assert first.probability == pytest.approx(0.95, abs=1e-3)


@given(st.lists(shares, min_size=1, max_size=4))
def test_what_a_fit_may_name_are_all_its_subsets_and_they_share_its_probability(
        chances: list[float]) -> None:
    """Each effect's probability, summed over the answers that name it, is that it is real."""
    effects = tuple(f'part_{k}.gain' for k in range(len(chances)))
    doubtful = replace(fitted(effects, 0.0), doubts=dict(zip(effects, chances, strict=True)))
    answers = rank([fitted((), 1e6), doubtful], 0.1, DEFAULT)
    assert sum(answer.probability for answer in answers) == pytest.approx(0.9)
    for effect, doubt in zip(effects, chances, strict=True):
        assert sum(answer.probability for answer in answers if effect in answer.effects
                   ) == pytest.approx(0.9 * (1.0 - doubt), abs=1e-9)
    assert [answer.probability for answer in answers] == sorted(
        (answer.probability for answer in answers), reverse=True)


def test_an_answer_has_the_fit_of_what_it_names() -> None:
    none, single = fitted((), 20000.0), fitted(('axis.inertia',), 5000.0)
    pair = replace(fitted(('axis.inertia', 'motor.gain'), 3000.0), doubts={'motor.gain': 0.4})
    first, second = rank([none, single, pair], 0.0, DEFAULT)[:2]
    assert first.hypothesis is pair and first.probability == pytest.approx(0.6)
    assert second.hypothesis is single and second.probability == pytest.approx(0.4)


def test_a_partner_of_nobody_who_was_fitted_alone_is_not_listed() -> None:
    none, other = fitted((), 20000.0), fitted(('axis.gain',), 15000.0)
    pair = within_tolerance(fitted(('axis.inertia', 'motor.gain'), 3000.0), 'motor.gain')
    assert rank([none, other, pair], 0.05, DEFAULT)[0].effects == ('axis.inertia',)
    assert also_seen([none, other, pair], DEFAULT) == []


def test_a_small_partner_is_listed_apart() -> None:
    none, single = fitted((), 20000.0), fitted(('axis.inertia',), 1000.0)
    pair = fitted(('axis.inertia', 'motor.gain'), 900.0)
    assert rank([none, single, pair], 0.0, DEFAULT)[0].effects == ('axis.inertia',)
    [seen] = also_seen([none, single, pair], DEFAULT)
    assert seen == {'effect': 'motor.gain', 'gain': 100.0, 'within_tolerance': False,
                    'unsure': False,
                    'share': pytest.approx(100.0 / 19000.0)}


class Ends(FullFits):
    """Fits whose ends are known: the cost of each set of effects."""

    def __init__(self, ends: dict[tuple[str, ...], float]) -> None:
        self.ends = ends
        self.asked: list[tuple[str, ...]] = []

    def converged(self, hypothesis: Hypothesis) -> Hypothesis:
        return fitted(hypothesis.effects, min(self.ends[hypothesis.effects], hypothesis.cost))

    def without(self, hypothesis: Hypothesis, effect: str) -> Hypothesis:
        rest = tuple(e for e in hypothesis.effects if e != effect)
        self.asked.append(rest)
        return fitted(rest, self.ends[rest])

    def simpler(self, hypothesis: Hypothesis) -> list[tuple[str, str]]:
        return [(effect, effect[:-1]) for effect in hypothesis.effects if effect.endswith("'")]

    def elsewhere(self, hypothesis: Hypothesis) -> list[tuple[str, str]]:
        return [(effect, other) for effect, other in (('left', 'right'),)
                if effect in hypothesis.effects]

    def exchanged(self, hypothesis: Hypothesis, effect: str, other: str) -> Hypothesis:
        swapped = tuple(other if e == effect else e for e in hypothesis.effects)
        self.asked.append(swapped)
        return fitted(swapped, self.ends[swapped])

    def joined(self, hypothesis: Hypothesis) -> Hypothesis | None:
        whole = ('both',)
        return fitted(whole, self.ends[whole]) if (
            hypothesis.effects == ('one', 'two') and whole in self.ends) else None

    def with_another(self, hypothesis: Hypothesis) -> list[Hypothesis]:
        return [fitted(more, cost) for more, cost in self.ends.items()
                if set(hypothesis.effects) < set(more)]

    def at_noise_of(self, best: Hypothesis,
                    hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
        return list(hypotheses)

    def leaves_much(self, hypothesis: Hypothesis) -> bool:
        return False


def test_a_fit_of_the_offsets_that_got_stuck_raises_no_alarm() -> None:
    fits = Ends({(): 15990.0, ('a',): 16000.0})
    hypotheses, end = backward_elimination(
        fits, [fitted((), 16470.0), fitted(('a',), 16002.0)], DEFAULT)
    assert end.effects == best(hypotheses, DEFAULT).effects == ()
    # others are as far from their ends as the best was: two
    assert [c.cost for c in hypotheses] == [15992.0, 16002.0]


def test_one_effect_in_both_places_is_preferred_to_one_in_each() -> None:
    fits = Ends({(): 90000.0, ('one', 'two'): 11200.0, ('both',): 11230.0})
    hypotheses, end = backward_elimination(
        fits, [fitted((), 90000.0), fitted(('one', 'two'), 12200.0),
               fitted(('both',), 14900.0)], DEFAULT)
    assert end.effects == ('both',)
    assert {c.effects: c.cost for c in hypotheses}['both',] == 12230.0
    # but not where each has a size of its own
    fits = Ends({(): 90000.0, ('one', 'two'): 11200.0, ('both',): 14000.0})
    assert backward_elimination(fits, [
        fitted((), 90000.0), fitted(('one', 'two'), 11200.0)], DEFAULT)[1].effects == (
            'one', 'two')


def test_a_partner_that_only_helped_a_fit_along_is_let_go() -> None:
    fits = Ends({(): 90000.0, ('a',): 16030.0, ('b',): 89000.0, ('a', 'b'): 16030.0})
    hypotheses, end = backward_elimination(fits, [
        fitted((), 106000.0), fitted(('a', 'b'), 16140.0), fitted(('a',), 19100.0)], DEFAULT)
    assert end.effects == ('a',)
    assert [c.effects for c in hypotheses] == [(), ('a', 'b'), ('a',)]


def test_a_partner_that_is_nearly_nothing_is_let_go_if_the_fit_without_it_got_stuck() -> None:
    fits = Ends({('a', 'b'): 16030.0, ('a',): 16031.0})
    fits.converged = lambda hypothesis: fitted(  # type: ignore[method-assign]
        hypothesis.effects, fits.ends[hypothesis.effects], {'b': 100.0})
    known = [fitted((), 106000.0), fitted(('a', 'b'), 16140.0)]
    for others in ([fitted(('a',), 60000.0)], []):
        hypotheses, end = backward_elimination(fits, [*known, *others], DEFAULT)
        assert end.effects == best(hypotheses, DEFAULT).effects == ('a',)


@pytest.mark.parametrize('end, expected', [(16003.0, 'a'), (17000.0, "a'")])
def test_a_simpler_effect_is_named_if_it_fits_as_well(end: float, expected: str) -> None:
    fits = Ends({("a'",): 16000.0, ('a',): end, (): 90000.0})
    form = fitted(("a'",), 16000.0).forms[0]
    shapes = [replace(NUMBER, name=name, is_shape=True, tolerance=0.0)
              for name in ('rate', 'order')]
    flexible = replace(fitted(("a'",), 16000.0), forms=(
        replace(form, parameters=(*form.parameters, *shapes)),))
    hypotheses, found = backward_elimination(fits, [fitted((), 90000.0), flexible], DEFAULT)
    assert found.effects == best(hypotheses, DEFAULT).effects == (expected,)


def test_the_best_is_fitted_again_if_a_partner_of_no_size_helps_it_along() -> None:
    fits = Ends({('a',): 15500.0})
    hypotheses, end = converged_rivals(
        fits, [fitted((), 90000.0), fitted(('a',), 15550.0),
               within_tolerance(fitted(('a', 'b'), 15496.0), 'b')],
        fitted(('a',), 15550.0), DEFAULT)
    assert (end.effects, end.cost) == (('a',), 15500.0)
    assert {h.effects: h.cost for h in hypotheses}['a',] == 15500.0


def test_an_effect_in_another_place_that_was_given_up_is_tried_before_one_is_named() -> None:
    fits = Ends({('left',): 15990.0, ('right',): 15900.0})
    known = [fitted((), 90000.0), fitted(('left',), 16000.0)]
    hypotheses, end = converged_rivals(fits, known, fitted(('left',), 15990.0), DEFAULT)
    assert end.effects == best(hypotheses, DEFAULT).effects == ('right',)
    assert fits.asked == [('right',)]
    # where it is among the hypotheses, it is a rival as any other: far behind, it stays there
    fits.asked.clear()
    converged_rivals(fits, [*known, fitted(('right',), 50000.0)], end, DEFAULT)
    assert fits.asked == []


def test_an_effect_in_another_place_whose_fit_got_stuck_begins_where_the_best_has_ended() -> None:
    fits = Ends({('left',): 15990.0, ('right',): 15900.0})
    stuck = fitted(('right',), 16040.0)
    fits.converged = lambda hypothesis: hypothesis  # type: ignore[method-assign]
    hypotheses, end = converged_rivals(
        fits, [fitted((), 90000.0), fitted(('left',), 15990.0), stuck],
        fitted(('left',), 15990.0), DEFAULT)
    assert end.effects == ('right',)
    assert {h.effects: h.cost for h in hypotheses}['right',] == 15900.0


def test_only_the_nearest_of_several_ways_to_the_same_effects_is_taken() -> None:
    """Partners of no size help the best along; a rival further behind is settled all the same."""
    fits = Ends({(name,): 15994.0 for name in 'abxy'})
    helped = [within_tolerance(fitted((name, partner), cost), partner) for name, partner, cost in (
        ('a', 'c', 15980.0), ('a', 'd', 15981.0), ('a', 'e', 15982.0), ('b', 'c', 16060.0),
        ('x', 'c', 16050.0), ('x', 'd', 16090.0), ('y', 'c', 16070.0), ('b', 'd', 16080.0))]
    hypotheses, _ = converged_rivals(
        fits, [fitted((), 90000.0), fitted(('a',), 15995.0), *helped],
        fitted(('a',), 15995.0), DEFAULT)
    # the best, and the two rivals that are nearest in any way
    assert fits.asked == [('a',), ('x',), ('b',)]
    assert {h.effects: h.cost for h in hypotheses}['b',] == 15994.0


def test_what_a_quadratic_fit_loses_without_an_effect() -> None:
    """Against the fit without it, whose solution is known."""
    random = np.random.default_rng(5)
    jacobian = random.normal(size=(50, 3))
    jacobian[:, 2] += jacobian[:, 0]
    target = jacobian @ [0.3, -0.2, 1.0] + 0.1 * random.normal(size=50)
    parameters = tuple(replace(NUMBER, name=name, prior_sigma=0.0, low=-1e6, high=1e6,
                               tolerance=0.0)
                       for name in ('first', 'second', 'a.size'))
    x, (left,), *_ = np.linalg.lstsq(jacobian, target, rcond=None)
    _, (without,), *_ = np.linalg.lstsq(jacobian[:, :2], target, rcond=None)
    blank = np.zeros(0)
    hypothesis = Hypothesis(('a',), (Form('', parameters[2:]),), FitState(
        parameters, np.asarray(x, float), blank, np.zeros((0, 0), np.float32), blank, 0.5 * left,
        kept_hessian=jacobian.T @ jacobian))
    assert hypothesis.loss_without('a') == pytest.approx(0.5 * (without - left), rel=1e-6)
    # up to its tolerance the effect may stay, as an offset that every machine has
    _, (within,), *_ = np.linalg.lstsq(jacobian[:, :2], target - 0.4 * jacobian[:, 2], rcond=None)
    tolerated = (*parameters[:2], replace(parameters[2], tolerance=0.4))
    hypothesis = Hypothesis(('a',), (Form('', tolerated[2:]),), replace(
        hypothesis.state, parameters=tolerated))
    assert hypothesis.loss_without('a') == pytest.approx(0.5 * (within - left), rel=1e-6)


def test_a_close_rival_is_taken_to_its_end_before_one_is_named() -> None:
    fits = Ends({('a',): 15995.0, ('b',): 15970.0, ('c',): 15000.0})
    found = [fitted((), 90000.0), fitted(('a',), 16000.0), fitted(('b',), 16010.0),
             fitted(('c',), 17500.0)]  # not close
    hypotheses, end = converged_rivals(fits, found, fitted(('a',), 15995.0), DEFAULT)
    assert (end.effects, end.cost) == (('b',), 15970.0)
    # costs stay comparable: all but the rival are as far from their ends as the first was, five
    assert [h.cost for h in hypotheses] == [90000.0, 16000.0, 15975.0, 17500.0]
    assert best(hypotheses, DEFAULT).effects == ('b',)


def test_a_rival_is_found_behind_a_partner_within_its_tolerance() -> None:
    fits = Ends({('a',): 15995.0, ('b',): 15960.0})
    pair = within_tolerance(fitted(('b', 'c'), 15990.0), 'c')
    hypotheses, end = converged_rivals(
        fits, [fitted((), 90000.0), fitted(('a',), 16000.0), pair], fitted(('a',), 15995.0),
        DEFAULT)
    assert (end.effects, end.cost) == (('b',), 15960.0)
    assert best(hypotheses, DEFAULT).effects == ('b',)


def test_a_weak_effect_that_is_there_stays() -> None:
    fits = Ends({(): 17400.0, ('a',): 16000.0})
    hypotheses, end = backward_elimination(
        fits, [fitted((), 17500.0), fitted(('a',), 16000.0)], DEFAULT)
    assert fits.asked == [()]
    assert end.effects == best(hypotheses, DEFAULT).effects == ('a',)


def test_a_strong_effect_is_not_doubted() -> None:
    fits = Ends({('a',): 16000.0})
    backward_elimination(fits, [fitted((), 160000.0), fitted(('a',), 16000.0)], DEFAULT)
    assert not fits.asked


def test_effects_are_added_until_none_is_worth_its_price() -> None:
    fits = Ends({('a', 'b', 'c'): 9000.0, ('a', 'b', 'c', 'd'): 8990.0, ('a', 'b', 'e'): 19990.0})
    found, end = forward_selection(
        fits, [fitted((), 90000.0), fitted(('a', 'b'), 20000.0)], fitted(('a', 'b'), 20000.0),
        DEFAULT)
    assert end.effects == best(found, DEFAULT).effects == ('a', 'b', 'c')
