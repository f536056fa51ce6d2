# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The sentence of a verdict on any machine: it says what is known, and contradicts nothing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from simgap.machine.contract import Effect, Form, Parameter
from simgap.machine.with_law import Law
from simgap.next_test.design import objective_for, SEPARATE
from simgap.next_test.rivals import Findings
from simgap.verdict.record import Named
from simgap.verdict.sentence import headline, said
from simgap.verdict.spoken import number, percent

GAP = Parameter('gearbox.backlash.gap', 'rad', 0.0, 1.0, 0.01)
EFFECTS = {'gearbox.backlash': Effect('gearbox.backlash', 'gearbox', 'worn {teeth}',
                                      (Form('', (GAP,)),))}
FOUND = Named(['gearbox.backlash'], 0.97, {
    GAP.name: {'value': 0.03, 'ci95': [0.02, 0.04], 'unit': 'rad'}})
QUIET = {'angle': {'unit': 'rad', 'rms': 0.01, 'noise': 0.01, 'beyond_noise': 0.002,
                   'matters': None}}
LOUD = {'angle': {**QUIET['angle'], 'beyond_noise': 0.05}}


def verdict(word: str, top: Named = FOUND, **entries: Any) -> Any:
    return SimpleNamespace(**{
        'word': word, 'which': [top], 'where': [], 'confusable': [], 'may_enter_at': [],
        'remains': QUIET, 'planning': {}, 'reproducibility': [],
        'machine': SimpleNamespace(catalogue=EFFECTS, words={}),
        'how_far': {'judged': top.effects, 'per_signal': {},
                    'explained_fraction': {'value': 0.99, 'ci95': [0.97, 0.996]}}, **entries})


def test_an_effect_of_a_machine_without_words_is_said_by_cause_number_and_unit() -> None:
    assert str(said(verdict('explained'))) == (
        'The model lacks gearbox.backlash (worn {teeth}): gap 0.03 rad (0.02 to 0.04). '
        'Probability 97 percent. Adding it removes 99 percent of the gap on data that was not '
        'fitted (97 to 100). Next: inspect what may cause it; diagnose again, together with a '
        'recording that was not used here.')


def test_a_machine_may_have_words_of_its_own() -> None:
    machine = SimpleNamespace(catalogue=EFFECTS, words={
        'gearbox.backlash': lambda numbers: (
            f'the gap is {numbers[GAP.name]["value"]} rad', ['turn it by hand'])})
    found = said(verdict('explained', machine=machine))
    assert found.what == 'The gap is 0.03 rad.'
    assert found.then == 'Next: turn it by hand.'


def test_what_cannot_be_told_apart_is_said_with_what_would_settle_it() -> None:
    found = said(verdict('partly_explained', confusable=[['gearbox.backlash', 'shaft.twist']]))
    assert 'Something else acts beside that.' in found.sure
    assert 'cannot tell gearbox.backlash from shaft.twist.' in found.sure
    assert found.then.startswith('Next: record the test that `propose --objective separate`')


def rival(effect: str, probability: float) -> dict[str, Any]:
    return {'named': [effect], 'effects': [effect], 'forms': [''], 'probability': probability,
            'names': [], 'values': [], 'covariance': [], 'doubts': {}}


def test_what_is_next_is_what_propose_designs() -> None:
    machine = SimpleNamespace(catalogue=EFFECTS, words={
        'gearbox.backlash': lambda numbers: ('it has a gap', ['inspect it', 'repeat a test'])})
    for chances, steps in (
            ((0.6, 0.35), 'record the test that `propose` designs from what `diagnose --json` '
             'writes, to tell the answers apart; inspect it'),
            # one answer is sure: `propose` would look for other effects
            ((0.97, 0.02), 'inspect it; repeat a test')):
        planning = {'inflation': 1.0, 'rivals': [
            rival(name, chance) for name, chance in zip(('gearbox.backlash', 'shaft.twist'),
                                                        chances, strict=True)]}
        objective = objective_for(Findings.of_data(planning))
        assert (objective == SEPARATE) is ('propose' in steps)
        assert said(verdict('explained', machine=machine, planning=planning)).then == (
            f'Next: {steps}.')


@pytest.mark.parametrize('turns, tolerance, why', [
    ([0.02, 0.05], 0.001,
     'the recordings differ: without one or another it is 0.02 rad to 0.05 rad'),
    ([0.03, 0.03], 0.02, 'a healthy machine may have up to 0.02 rad of it'),
    ([0.03, 0.03], 0.001, 'these recordings hardly show it')])
def test_a_wide_interval_has_a_reason(turns: list[float], tolerance: float, why: str) -> None:
    effect = replace(EFFECTS['gearbox.backlash'], forms=(
        Form('', (replace(GAP, tolerance=tolerance),)),))
    named = replace(FOUND, parameters={GAP.name: {
        'value': 0.03, 'ci95': [0.01, 0.05], 'unit': 'rad'}})
    far = {'judged': [], 'explained_fraction': {'value': None}, 'folds': [
        {'values': {GAP.name: turn}} for turn in turns]}
    found = said(verdict('explained', named, how_far=far, machine=SimpleNamespace(
        catalogue={effect.id: effect}, words={}))).sure
    assert found == f'Probability 97 percent. The interval of gap is wide: {why}.'


def test_a_narrow_interval_needs_no_reason() -> None:
    named = replace(FOUND, parameters={GAP.name: {
        'value': 0.03, 'ci95': [0.024, 0.036], 'unit': 'rad'}})
    assert 'interval' not in said(verdict('explained', named)).sure


def test_a_number_at_the_end_of_its_range_is_said_to_be_there() -> None:
    named = replace(FOUND, parameters={GAP.name: {
        'value': GAP.high, 'ci95': [0.9, 1.0], 'unit': 'rad'}})
    assert ('Gap is at the end of its range: widen it, or doubt the model.'
            in said(verdict('explained', named)).sure)
    assert 'end of its range' not in said(verdict('explained')).sure


def test_an_effect_that_widens_the_gap_is_not_said_to_remove_it() -> None:
    far = {'judged': FOUND.effects, 'explained_fraction': {'value': -3.0, 'ci95': [-9.0, 0.1]}}
    assert 'makes the gap wider' in str(said(verdict('explained', how_far=far)))
    assert headline(verdict('explained', how_far=far)) == (
        'named, but it closes nothing of data that was not fitted')
    unjudged = {'judged': [], 'explained_fraction': {'value': None, 'reason': 'one test'}}
    assert 'Adding' not in str(said(verdict('explained', how_far=unjudged)))


def test_agreement_is_not_said_beside_a_remainder_that_is_louder_than_noise() -> None:
    none = Named(['none'], 0.9, {})
    assert said(verdict('no_gap', none)).what == (
        'Machine and model agree within tolerance and noise.')
    found = str(said(verdict('no_gap', none, remains=LOUD)))
    assert 'agree' not in found
    assert headline(verdict('no_gap', none, remains=LOUD)) == 'no effect named'
    assert headline(verdict('no_gap', none)) == 'no gap'
    assert headline(verdict('explained')) == 'explained'
    assert headline(verdict('explained', remains=LOUD)) == 'explained, but something remains'
    assert 'what remains of angle is 0.05 rad beyond noise of 0.01 rad' in found
    # what a user says does not matter is no reason to doubt
    asked = {'angle': {**LOUD['angle'], 'matters': False}}
    assert 'agree' in str(said(verdict('no_gap', none, remains=asked)))
    few = {'angle': {'unit': 'rad', 'too_few_to_judge': 12}}
    assert said(verdict('too_few_to_judge', none, remains=few)).what.startswith('Too few samples')


def test_unknown_says_place_size_and_when_and_what_would_settle_it() -> None:
    place = SimpleNamespace(name='force on the carriage', component='carriage', explained=0.83,
                            law=Law('angle', 'load', 31.0, (0.0, 1.0, 2.0), (0.5, 0.0, -2.0),
                                    (0.1, 0.1, 0.1), 'rad', 'N/A', 1.0, 1.0, 0.4))
    found = said(verdict(
        'unknown_effect', Named(['unknown'], 0.9, {}), may_enter_at=[place],
        where=[{'component': 'carriage', 'signal': 'angle', 'regime': 'reversal', 'share': 0.6}],
        how_far={'per_signal': {
            'rate': {'before': 2.0, 'before_in_unit': 5.0, 'unit': 'rad/s'},
            'angle': {'before': 9.0, 'before_in_unit': 0.0432, 'unit': 'rad'}}}))
    assert found.what == (
        'Something acts that no known effect explains, most likely in carriage; it shows most in '
        'angle (reversal). The model misses angle by 0.0432 rad rms. As force on the carriage it '
        'could explain 83 percent of the gap, best as a function of angle, in proportion to load. '
        'It goes from 0.5 N/A at 0 rad to -2 N/A at 2 rad, most like a parabola, which lacks less '
        'than 0.1 percent of it; it closes 40 percent of the gap of recordings that were not '
        'fitted.')
    assert 'one test is not enough' in found.then and '`propose`' in found.then


@pytest.mark.parametrize('begin, end, text', [
    (2.0, 3.5, 'from 2.00 to 3.50 s'), (2.0, None, 'from 2.00 s on'), (None, 3.5, 'until 3.50 s')])
def test_unknown_says_when_it_acts(
        begin: float | None, end: float | None, text: str) -> None:
    span = {'test': 'far', 'from_s': begin, 'until_s': end}
    where = {'component': 'carriage', 'signal': 'angle', 'regime': 'stick', 'share': 0.6}
    unknown: Any = {
        'top': Named(['unknown'], 0.9, {}), 'how_far': {'per_signal': {}}}
    found = said(verdict('unknown_effect', where=[{**where, 'acts': [span]}], **unknown))
    assert found.what.endswith(f'It acts {text} of far.')
    # a declared model knows what is pushed, and how strongly
    pushed = {**span, 'size': 3.0, 'unit': 'N'}
    found = said(verdict('unknown_effect', where=[where], pushes=[pushed] * 3, **unknown))
    assert f'It acts {text} of far, with 3 N, and 2 times more.' in found.what


@pytest.mark.parametrize('text, expected', [
    (number(23.64), '23.6'), (number(8.74e6), '8.74e6'), (number(-2e-6), '-2e-6'),
    (number(1234.0), '1234'), (percent(0.053), '5.3 percent'),
    (percent(0.9991), 'more than 99 percent'), (percent(1.0), '100 percent'),
    (percent(0.0001), 'less than 0.1 percent'),
    (percent(0.0), '0.0 percent'),
    (number(float('inf')), 'no number'),
])
def test_numbers_are_as_people_say_them(text: str, expected: str) -> None:
    assert text == expected
