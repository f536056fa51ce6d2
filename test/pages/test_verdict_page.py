# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The page about a diagnosis: of any machine, whatever its names are, in a real browser."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from antenna_drive.diagnosis.catalogue import catalogue
from antenna_drive.diagnosis.diagram import DIAGRAM
from antenna_drive.diagnosis.words import advice
from antenna_drive.pages import render
from chromium import EXECUTABLE, Page
import numpy as np
import pytest
from simgap.machine.contract import Effect, Excerpt, Experiment, Form, Parameter
from simgap.machine.diagram import Diagram, DiagramBlock
from simgap.machine.with_law import Law
from simgap.report.page import contents
from simgap.verdict.record import Named, Verdict
from simgap.verdict.unknown_input import Place

needs_browser = pytest.mark.skipif(EXECUTABLE is None, reason='there is no Chromium '
                                                              '(apt-get install chromium)')
HOSTILE = '</script><script>boom()</script><img src="x" onerror="boom()">{{ boom }}'
FULL: dict[str, Any] = {
    'verdict': 'partly_explained',
    'which': [
        {'effects': ['motors.friction'], 'probability': 0.75, 'parameters': {
            'motors.friction.torque': {'value': 0.25, 'ci95': [0.2, 0.3], 'unit': HOSTILE}}},
        {'effects': ['dial.gain', HOSTILE], 'probability': 0.15, 'parameters': {}},
        {'effects': ['unknown'], 'probability': 0.1, 'parameters': {}},
        {'effects': ['none'], 'probability': 0.0, 'parameters': {}}],
    'confusable': [['motors.friction', 'dial.gain']],
    'also_seen': [
        {'effect': HOSTILE, 'gain': 40.0, 'share': 0.012, 'within_tolerance': False,
         'unsure': False},
        {'effect': 'dial.gain', 'gain': 30.0, 'share': 0.2, 'within_tolerance': False,
         'unsure': True}],
    'could_hide': [{'effect': HOSTILE, 'size': 0.00317, 'unit': 'V'},
                   {'effect': 'dial.gain', 'size': None, 'unit': '1'}],
    'remains': {HOSTILE: {'unit': 'V', 'rms': 0.0456, 'noise': 0.01, 'beyond_noise': 0.0445,
                          'matters': True},
                'dial': {'unit': 'V', 'too_few_to_judge': 12}},
    'how_far': {'before': 9.0, 'after': 1.25, 'held_out': HOSTILE,
                'explained_fraction': {'value': 0.9, 'ci95': [0.8, 0.95]},
                'judged': ['motors.friction'], 'cannot_be_judged': {HOSTILE: HOSTILE},
                'per_signal': {HOSTILE: {
                    'before': 9.0, 'after': 1.25, 'unit': HOSTILE, 'before_in_unit': 0.0432,
                    'after_in_unit': None}}},
    'where': [{'component': HOSTILE, 'signal': 'dial', 'regime': 'reversal', 'share': 0.4}],
    'may_enter_at': [{'name': HOSTILE, 'component': 'dial', 'explained': 0.3,
                      'law': {'by': 'rate', 'times': HOSTILE}}],
    'notes': [HOSTILE], 'seconds': 3.0,
}
BARE: dict[str, Any] = {
    **FULL, 'verdict': 'no_gap', 'confusable': [], 'where': [], 'may_enter_at': [],
    'which': [{'effects': ['none'], 'probability': 1.0, 'parameters': {}}],
    'remains': {'dial': {'unit': 'V', 'rms': 0.01, 'noise': 0.01, 'beyond_noise': 0.001,
                         'matters': None}},
    'how_far': {**FULL['how_far'], 'explained_fraction': {
        'value': None, 'ci95': None, 'reason': 'no effect was found'}}}
TIME = np.linspace(0.0, 1.99, 200)


def diagnosis(result: dict[str, Any], read: Sequence[int] = (1,), **machine: Any) -> Verdict:
    """Return a diagnosis of a machine with two tests, two effects and some channels read."""
    true = np.column_stack([np.sin(TIME), np.cos(TIME)])
    measured = np.full_like(true, np.nan)
    measured[:, read] = true[:, read]
    measured[:20, 1] = np.nan
    model = SimpleNamespace(
        experiments=[Experiment(name, TIME, ('speed', HOSTILE), ('m/s', 'V'), measured,
                                np.full_like(true, 0.1)) for name in (HOSTILE, 'second')],
        catalogue={'motors.friction': Effect('motors.friction', 'motors', HOSTILE, ()),
                   'dial.gain': Effect('dial.gain', 'dial', 'a bent needle', ())},
        **{'diagram': None, 'advice': (), 'words': {},
           'simulate': lambda points: [[true - 1.0] * 2, [true] * 2, [true] * 2], **machine})
    fit: Any = SimpleNamespace(state=SimpleNamespace(point=dict), forms=())
    entries = {'fits': [], 'planning': {}, 'labels': None, **result}
    return Verdict(**{
        **{key: value for key, value in entries.items() if key != 'verdict'},
        'word': result['verdict'], 'which': [Named(**answer) for answer in result['which']],
        'may_enter_at': [
            Place(place['name'], place['component'], 1.0, place['explained'],
                  Law(evidence=1.0, width=1.0, spread=1.0, at=(-1.0, 0.0, 3.0),
                      values=(-0.5, 0.0, 1.5),
                      deviations=(0.1, 0.0, 0.25), by_unit='rad/s', unit=HOSTILE,
                      **place['law']))
            for place in result['may_enter_at']],
        'machine': model, 'none': fit, 'best': fit})


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Page]:
    with Page(tmp_path / 'profile', width=390) as opened:
        yield opened


def show(browser: Page, tmp_path: Path, result: dict[str, Any], **machine: Any) -> str:
    path = tmp_path / 'verdict.html'
    path.write_text(render('verdict.html', **contents(diagnosis(result, **machine))))
    browser.open(path.as_uri())
    assert browser.tell('document.documentElement.dataset.state') == 'drawn'
    assert browser.complaints == []
    assert browser.requests == [path.as_uri()]
    assert browser.tell('document.querySelectorAll("img, iframe, link[rel=stylesheet]").length'
                        ) == 0
    # nothing is wider than the window of a phone but what scrolls within itself
    assert browser.tell('document.documentElement.scrollWidth <= innerWidth') is True
    browser.tell('document.querySelectorAll("details").forEach(part => { part.open = true; })')
    text = browser.tell('document.body.innerText')
    assert isinstance(text, str)
    return ' '.join(text.replace('\xa0', ' ').split())


@needs_browser
def test_everything_is_said_and_nothing_is_taken_for_html(browser: Page, tmp_path: Path) -> None:
    text = show(browser, tmp_path, FULL, advice=(
        (('friction',), 'Turn it by hand.'), (('ripple',), 'Hold one rate.'), ((), HOSTILE)))
    for words in ('Partly explained', '75.0 % motors.friction', f'torque = 0.25 {HOSTILE}',
                  'motors.friction explains 90 % of the gap (80 to 95 %). '
                  f'How much {HOSTILE} explains cannot be judged: {HOSTILE}.',
                  f'dial.gain + {HOSTILE}',
                  'cannot tell apart: motors.friction, dial.gain', 'reversal 40 %',
                  f'{HOSTILE} dial 30 %',
                  f'{HOSTILE}, best as a function of rate, in proportion to {HOSTILE}',
                  'Turn it by hand.', '3 s of computing', 'a bent needle',
                  f'data that was not fitted: {HOSTILE}.', 'matters',
                  'could be and still hide here', 'dial 12 samples: too few to judge',
                  f'not worth a name: {HOSTILE} (1.2 % of the gap)'):
        assert words in text, words
    assert 'Hold one rate.' not in text and '0.0 % none' not in text
    # every text of the made-up recording's that can be seen, and the script's data
    assert text.count(HOSTILE) >= 12
    # without a layout of its own, the machine's components stand in rows
    blocks = browser.tell('[...document.querySelectorAll(".diagram text")]'
                          '.map(e => e.textContent.replace(/\\s+/g, " "))')
    assert blocks == ['motors 75 %', 'dial 15 %']


@needs_browser
def test_the_page_begins_with_the_sentence_and_with_what_was_diagnosed(
        browser: Page, tmp_path: Path) -> None:
    verdict = diagnosis({**FULL, 'confusable': []}, words={'motors.friction': lambda numbers: (
        'the motors rub 50 percent more', ['run `this`', 'look'])})
    path = tmp_path / 'verdict.html'
    path.write_text(render('verdict.html', **contents(verdict, {
        'machine': HOSTILE, 'recordings': 'a.csv (2026-01-02)', 'made by': 'it 1.0'})))
    browser.look(390, 800)
    browser.open(path.as_uri())
    text = ' '.join(str(browser.tell('document.body.innerText')).replace('\xa0', ' ').split())
    beginning = (
        'The motors rub 50 percent more. Probability 75 percent. Adding it removes 90 '
        'percent of the gap on data that was not fitted (80 to 95). '
        'Something else acts beside that. Next: run this; look.')
    assert text.startswith(f'{beginning} verdict Partly explained machine {HOSTILE} recordings '
                           'a.csv (2026-01-02) made by it 1.0 ')
    assert verdict.as_data()['sentence'] == beginning.replace('run this', 'run `this`')
    assert verdict.summary().startswith(f'partly explained: {verdict.as_data()["sentence"]}')
    # what is of the fit alone waits until somebody asks
    assert 'Diagnostics of the fit' in text and 'greatest correlation' not in text
    # a phone shows all of the answer
    assert browser.tell('[...document.querySelectorAll("h1, .lead, .next, .facts dd, td")]'
                        '.every(e => e.getBoundingClientRect().right <= 390)') is True


@needs_browser
def test_a_loud_remainder_is_not_called_an_agreement(browser: Page, tmp_path: Path) -> None:
    text = show(browser, tmp_path, {**BARE, 'remains': {
        'dial': {**BARE['remains']['dial'], 'beyond_noise': 0.5}}})
    assert 'agree' not in text and 'no gap' not in text.lower().replace('no gap shows', '')
    assert 'No effect named' in text and 'dial is 0.5 V beyond noise of 0.01 V' in text


@needs_browser
def test_the_tests_are_zoomed_apart(browser: Page, tmp_path: Path) -> None:
    show(browser, tmp_path, FULL)
    titles = browser.tell('[...document.querySelectorAll(".head b")].map(e => e.textContent)')
    assert titles == [f'{HOSTILE} [V]', 'measured less simulated [V]'] * 2
    names = browser.tell('[...document.querySelectorAll(".head")].map(head =>'
                         ' [...head.querySelectorAll("span")].map(e => e.textContent))')
    assert names == [['measured', 'before', 'after'], ['before', 'after']] * 2
    before = pictures(browser)
    browser.tell('document.getElementById("panels").focus()')
    browser.key('+')
    after = pictures(browser)
    assert [a == b for a, b in zip(before, after, strict=True)] == [False, False, True, True]


TITLES = '[...document.querySelectorAll(".head b")].map(e => e.textContent)'
VALUES = '[...document.querySelectorAll("samp")].map(e => e.textContent)'
AT = '[...document.querySelectorAll(".tools output")].map(e => e.textContent)'
SPAN = '[document.documentElement.dataset.from, document.documentElement.dataset.to].map(Number)'


def moment(browser: Page, group: int) -> float:
    """Return the time at the cursor."""
    return float(browser.tell(AT)[group].split()[2])


def choose(browser: Page, which: int, option: int) -> None:
    browser.tell(f'(() => {{ const list = document.querySelectorAll("#choice select")[{which}];'
                 f' list.selectedIndex = {option}; list.dispatchEvent(new Event("change")); }})()')


@needs_browser
def test_recording_and_signal_are_chosen(browser: Page, tmp_path: Path) -> None:
    show(browser, tmp_path, FULL, read=(0, 1))
    assert browser.tell('[...document.querySelectorAll("#choice label")].map(e =>'
                        ' [e.firstChild.data, ...[...e.lastChild].map(o => o.text)])') == [
        ['Recording ', 'all', HOSTILE, 'second'],
        ['Signal ', 'the one that tells most', 'all', 'speed', HOSTILE]]
    least = 'measured less simulated [{}]'.format
    own = [f'{HOSTILE} [V]', least('V')], ['speed [m/s]', least('m/s')]
    # of both the model is off by 1; a tenth of the samples of one is missing
    assert browser.tell(TITLES) == own[1] * 2
    browser.key('+')
    browser.tell('document.querySelectorAll(".group")[1].focus()')
    browser.key('+')
    span = browser.tell(SPAN)
    choose(browser, 0, 2)
    choose(browser, 1, 1)
    assert browser.tell(TITLES) == own[1] + own[0]
    assert browser.tell('[...document.querySelectorAll("h3")].map(e => e.textContent)') == [
        'second']
    assert browser.tell(SPAN) == span, 'the span outlives a choice'
    choose(browser, 1, 3)
    assert browser.tell(TITLES) == own[0]
    choose(browser, 0, 0)
    assert browser.tell(TITLES) == own[0] * 2
    assert browser.complaints == []


@needs_browser
def test_values_at_the_cursor_are_those_of_the_samples(browser: Page, tmp_path: Path) -> None:
    show(browser, tmp_path, FULL, read=(0, 1))
    x, y = browser.place('.u-over', 0.25)
    browser.mouse('mouseMoved', x, y)
    said = browser.until(f'{AT}[0] && {AT}')
    time = float(said[0].split()[2])
    assert said == [f'values at {time:.3f} s', ''] and time == pytest.approx(0.5, abs=0.01)
    measured = np.sin(TIME[np.argmin(np.abs(TIME - time))])
    shown = [float(text) for text in browser.tell(VALUES)[:5]]
    assert shown == pytest.approx([measured, measured - 1.0, measured, 1.0, 0.0], abs=0.02)
    browser.mouse('mouseMoved', 1, 1)
    browser.until(f'{AT}[0] === ""')
    assert set(browser.tell(VALUES)) == {''}


@needs_browser
def test_a_phone_is_touched(browser: Page, tmp_path: Path) -> None:
    browser.look(390, 800, dark=True)
    browser.fingers()
    show(browser, tmp_path, FULL)
    sizes = browser.tell(
        '[...document.querySelectorAll(".tools button, label:not([hidden]) select")].map(e => '
        'Math.min(e.clientHeight, e.clientWidth))')
    assert min(sizes) >= 40, 'as wide as a finger'
    browser.tap('.u-over', 0.5)
    browser.until(f'{AT}[0]')
    assert moment(browser, 0) == pytest.approx(0.995, abs=0.01)
    for title, span in (('zoom in', [0.4975, 1.4925]), ('later', [0.6965, 1.6915]),
                        ('earlier', [0.4975, 1.4925]), ('zoom out', [0.0, 1.99]),
                        ('zoom in', [0.4975, 1.4925]), ('everything', [0.0, 1.99])):
        browser.tap(f'[aria-label="{title}"]')
        browser.until(f'Math.abs({SPAN}[0] - {span[0]}) < 2e-3'
                      f' && Math.abs({SPAN}[1] - {span[1]}) < 2e-3')


@needs_browser
def test_keys_reach_everything(browser: Page, tmp_path: Path) -> None:
    show(browser, tmp_path, FULL, read=(0, 1))
    reached = []
    for _ in range(40):
        browser.key('Tab')
        reached.append(browser.tell('(e => e.ariaLabel || e.textContent.slice(0, 9) || e.tagName)'
                                    '(document.activeElement)'))
    for name in ('zoom in', 'later', 'measured', 'second', 'curves over time'):
        assert name in reached
    assert browser.tell('[...document.querySelectorAll("select")].every(e => e.tabIndex === 0)')
    # keys act on the recording in which the focus is
    browser.tell('document.querySelectorAll(".group")[1].focus()')
    browser.key('ArrowRight', modifiers=8)
    browser.until(f'{AT}[1]')
    assert browser.tell(f'{AT}[0]') == ''
    first = moment(browser, 1)
    assert first == pytest.approx(0.995, abs=0.01)
    before, after = browser.tell(VALUES)[-2:]
    assert float(before) == pytest.approx(1.0) and abs(float(after)) < 1e-6
    browser.key('ArrowLeft', modifiers=8)
    assert first - moment(browser, 1) == pytest.approx(0.01 * 1.99, abs=0.005)


@needs_browser
def test_curves_follow_the_colours_of_day_and_night(browser: Page, tmp_path: Path) -> None:
    show(browser, tmp_path, FULL)
    browser.look(390, 800)
    told = ('[...[...document.querySelectorAll("canvas")].map(c => c.toDataURL()),'
            ' ...[".tools", ".tools button", "select", "body"].map(e => (s => s.color +'
            ' s.background)(getComputedStyle(document.querySelector(e))))]')
    browser.tell(f'day = {told}')
    browser.look(390, 800, dark=True)
    browser.until(f'{told}.every((night, i) => night !== day[i])')


def pictures(browser: Page) -> list[str]:
    found = browser.tell('[...document.querySelectorAll("canvas")].map(c => c.toDataURL())')
    assert isinstance(found, list)
    return found


def test_the_page_says_how_much_is_compared_and_counts_time_as_the_recording() -> None:
    verdict = diagnosis(FULL)
    verdict.machine.experiments = [replace(experiment, excerpt=Excerpt('far', 20.0, zero))
                                   for experiment, zero in zip(
                                       verdict.machine.experiments, (5.0, 15.0), strict=True)]
    found = contents(verdict, {'recordings': 'far.csv', 'made by': 'it 1.0'})
    assert found['facts']['compared'] == 'far 4 of 20 s (20 percent)'
    assert list(found['facts'])[-2:] == ['compared', 'made by'], 'beside the recordings'
    begins = {time[0] for _, _, _, curves in found['panels'] for _, time, _ in curves}
    assert begins == {5.0, 15.0}


def test_the_table_tells_the_effect_from_what_is_fitted_beside_it() -> None:
    """The effect lifts one signal by 3; a tolerance lifts the other by 1."""
    size = Parameter('motors.friction.size', 'V', -9.0, 9.0, 0.1)
    verdict = diagnosis(FULL, read=(0, 1), simulate=lambda points: [[np.column_stack([
        np.full_like(TIME, point.get('zero', 0.0)),
        np.full_like(TIME, point.get(size.name, 0.0))])] * 2 for point in points])
    fitted = SimpleNamespace(point=lambda: {size.name: 3.0, 'zero': 1.0})
    best: Any = SimpleNamespace(state=fitted, forms=(Form('', (size,)),))
    assert contents(replace(verdict, best=best))['alone'] == pytest.approx(
        {'speed': 0.0, HOSTILE: 3.0})


@needs_browser
def test_a_phone_shows_every_number_of_a_wide_table(browser: Page, tmp_path: Path) -> None:
    numbers = dict.fromkeys(('before', 'after', 'before_in_unit', 'after_in_unit'), 6.32e-05)
    size = Parameter('motors.friction.size', 'V', -9.0, 9.0, 0.1)
    verdict = diagnosis({
        **FULL, 'how_far': {**FULL['how_far'], 'per_signal': {
            HOSTILE: {**numbers, 'unit': 'article A'}}},
        'remains': {HOSTILE: {**FULL['remains'][HOSTILE], 'noise': 1.75e-06}}})
    best: Any = SimpleNamespace(state=SimpleNamespace(point=dict), forms=(Form('', (size,)),))
    path = tmp_path / 'verdict.html'
    path.write_text(render('verdict.html', **contents(replace(verdict, best=best))))
    browser.look(390, 800)
    browser.open(path.as_uri())
    assert browser.tell('[...document.querySelectorAll(".stack td")].map(e => [e.textContent,'
                        ' getComputedStyle(e, "::before").content])') == [
        ['6.32e-05', '"before "'], ['6.32e-05', '"after "'], ['1.75e-06', '"noise "'],
        ['0', '"moved by the effect alone "']]
    assert browser.tell('[...document.querySelectorAll("body *")]'
                        '.every(e => e.getBoundingClientRect().right <= 390)') is True


@needs_browser
def test_an_unknown_is_told_with_its_times(browser: Page, tmp_path: Path) -> None:
    text = show(browser, tmp_path, {
        **FULL, 'verdict': 'unknown_effect', 'planning': {
            'unnamed': {'dial': 0.85}, 'rivals': [], 'inflation': 1.0},
        'which': [FULL['which'][2], FULL['which'][0]],
        'where': [{**FULL['where'][0], 'acts': [
            {'test': HOSTILE, 'from_s': 0.5, 'until_s': None}]}]})
    assert f'It acts from 0.50 s on of {HOSTILE}.' in text
    assert f'something unnamed acts in from until size {HOSTILE} 0.50 s the end –' in text
    assert browser.tell('[...document.querySelectorAll(".diagram text")]'
                        '.map(e => e.textContent.replace(/\\s+/g, " "))') == [
        'motors 75 %', 'dial 85 %'], 'the suspected part is marked'


@needs_browser
def test_no_gap_is_a_short_page(browser: Page, tmp_path: Path) -> None:
    text = show(browser, tmp_path, BARE, advice=(((), 'Do more.'),))
    assert text.count('No gap') == 1 and 'is explained (' not in text
    for words in ('What would settle', 'Where the gap lies', 'cannot tell apart', 'Do more.'):
        assert words not in text


def test_a_component_may_stand_for_several_blocks() -> None:
    diagram = Diagram((DiagramBlock('left', '', 0, 0, 9), DiagramBlock('right', '', 10, 5, 9)),
                      several={'both': ('left', 'right')})
    assert diagram.shares({'both': 0.5, 'left': 0.25, 'else': 0.1}) == {
        'left': 0.75, 'right': 0.5, 'else': 0.1}
    assert diagram.box == (-2, -2, 23, 35)


def test_blocks_of_a_machine_without_a_layout_lie_apart() -> None:
    blocks = Diagram.of(['a', 'b_c', 'a', *'defgh']).blocks
    assert [block.label for block in blocks] == ['a', 'b c', *'defgh']
    for i, one in enumerate(blocks):
        for other in blocks[:i]:
            assert one.y != other.y or one.x >= other.x + other.width


def test_the_drives_picture_and_advice_are_of_its_catalogue() -> None:
    effects = catalogue().values()
    shown = {block.component for block in DIAGRAM.blocks}
    for effect in effects:
        assert set(DIAGRAM.several.get(effect.component, (effect.component,))) <= shown, effect.id
    kinds = {effect.id.partition('.')[2] for effect in effects}
    assert {name for names, _ in advice() for name in names} <= kinds


@needs_browser
def test_a_phone_shows_all_of_a_fleet(browser: Page, tmp_path: Path) -> None:
    row = {'machine': 'a-drive-with-a-rather-long-name-of-its-own', 'page': None, 'failure': None,
           'recordings': ['a', 'b', 'c'], 'verdict': 'partly_explained', 'probability': 0.93,
           'effects': ['motors.load_dependent_friction', 'torque_share.fade_out_voltage'],
           'confusable': [['axis.gravity_imbalance', 'axis.wind_steady']],
           'sentence': f'Each motor {HOSTILE}. Next: run `it`.'}
    path = tmp_path / 'fleet.html'
    path.write_text(render(
        'fleet.html', title='Fleet', lead='two', share=lambda row: '90 %',
        rows=[row, {**row, 'failure': f'/{"long" * 40}.csv: no rate command'}],
        summary={'verdicts': {'partly_explained': 1}, 'failed': 1, 'effects': {}}))
    browser.look(390, 800)
    browser.open(path.as_uri())
    assert browser.tell('[...document.querySelectorAll("body *")]'
                        '.every(e => e.getBoundingClientRect().right <= 390)') is True
    said = browser.tell('[...document.querySelectorAll("td[colspan=\\"6\\"]")].map(e =>'
                        ' [e.innerText, e.querySelector("code").innerText])')
    assert said == [[f'Each motor {HOSTILE}. Next: run it.', 'it']], 'a failure has none'
