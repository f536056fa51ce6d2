# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser, beside a real drive: open, click, drag, and see the drive follow."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from antenna_drive.recording.files import read_recording
from chromium import Page
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to look at')

from stand_in_twin import NEXT_TEST, StandInTwin, VERDICT  # noqa: E402, I100

# Eq. (9): the greatest bias voltage is this times the bias pot [V].
FULL_BIAS_V = 13.0
SAMPLES = 'antennaDrive.samples'
STATE = 'document.getElementById("state").textContent'
BIAS_POT = '[data-name="bias_pot"]'


def last_change(page: Page) -> Any:
    """Return what the run's record of changes says last, as the Nodes tab shows it."""
    return page.tell('document.querySelector("#nodes table:nth-of-type(2) td")?.textContent || ""')


@pytest.mark.slow
def test_curves_and_numbers_move(page: Page) -> None:
    for signal in ('test_signal/rate_command', 'motor_1/current', 'plant/encoder'):
        text = f'document.querySelector(\'#diagram [data-signal="{signal}"]\').textContent'
        before = page.until(f'{text} !== "–" && {text}')
        page.until(f'{text} !== {before!r}')
    page.until("""(() => { const drawn = [...document.querySelectorAll('.chart canvas')];
        return drawn.length === 5 && drawn.every(canvas => {
          const all = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
          return new Set(new Uint32Array(all.data.buffer)).size > 20; }); })()""")


@pytest.mark.slow
def test_a_slider_that_is_dragged_turns_the_drive(page: Page) -> None:
    slider = f'{BIAS_POT} input[type="range"]'
    value = f'Number(document.querySelector({slider!r}).value)'
    page.mouse('mousePressed', *page.place(slider, page.tell(value)), button='left', clickCount=1)
    for share in (0.7, 0.6, 0.5):
        page.mouse('mouseMoved', *page.place(slider, share), button='left', buttons=1)
    page.mouse('mouseReleased', *page.place(slider, 0.5), button='left', clickCount=1)
    pot = page.until(f'{value} > 0.4 && {value} < 0.6 && {value}')
    page.until(f'antennaDrive.charts.changes.at(-1)?.changes.bias_pot === {pot}')
    change = page.tell('antennaDrive.charts.changes.at(-1)')
    assert change['unit'] == 'torque_share'
    assert last_change(page) == f'torque_share.bias_pot = {pot:g}'
    greatest = f"""(() => {{ const s = {SAMPLES};
        const column = s.names.get('torque_share/bias_voltage');
        const first = Math.ceil(({change['step']} + 1) * s.step / s.interval) + 1;
        if (s.newest < first + 300) return 0;
        let most = -Infinity;
        for (let i = first; i <= s.newest; i++) {{
          const high = s.highs[i % 6000 * s.count + column];
          if (high > most) most = high;
        }}
        return most; }})()"""
    assert page.until(greatest) == pytest.approx(FULL_BIAS_V * pot, rel=1e-6)


def typed(page: Page, name: str, text: str) -> str:
    """Type a text into a parameter's field and press Enter; return the field as an expression."""
    field = f'document.querySelector(\'[data-name="{name}"] input[type="text"]\')'
    page.tell(f'{field}.focus(); {field}.value = {text!r}; '
              f'{field}.dispatchEvent(new Event("input")); '
              f'{field}.dispatchEvent(new Event("change"))')
    return field


def reason_of(page: Page, name: str) -> Any:
    return page.until(f'document.querySelector(\'[data-name="{name}"] .refused\').textContent')


@pytest.mark.parametrize('text', ['2', '1,250', '', 'much', '1.2.3'])
def test_a_value_that_is_refused_returns_to_the_old_one(page: Page, text: str) -> None:
    before = page.tell(f'document.querySelector(\'{BIAS_POT} input[type="text"]\').value')
    field = typed(page, 'bias_pot', text)
    assert text in reason_of(page, 'bias_pot')
    assert page.tell(f'document.activeElement === {field}'), 'as after Enter'
    page.until(f'{field}.value === {before!r}')
    slider = page.tell(f'Number(document.querySelector(\'{BIAS_POT} input[type="range"]\').value)')
    assert slider == pytest.approx(float(before), abs=1e-3)


def test_a_decimal_comma_is_right(page: Page) -> None:
    field = typed(page, 'bias_pot', '0,625')
    page.until('antennaDrive.charts.changes.at(-1)?.changes.bias_pot === 0.625')
    page.until(f'{field}.value === "0.625"')
    # the answer that clears what was refused before may come after the value
    page.until('[...document.querySelectorAll("#tune .refused")]'
               '.every(line => line.textContent === "")')


def test_what_is_typed_is_never_another_number(page: Page) -> None:
    page.tell('import("/typed.js").then(module => { window.typed = module; })')
    page.until('window.typed')
    for text, value in (('0,5', 0.5), (',5', 0.5), ('-1,5e-3', -0.0015), ('0,125', 0.125),
                        ('12,5', 12.5), ('1e3', 1000), ('+.5', 0.5), ('7', 7)):
        assert page.tell(f'typed.readNumber({text!r})') == {'value': value}, text
    for text in ('1,250', '1.234,5', '1,234.5', '0x10', '1 000', '5,', 'Infinity', 'nan', ' '):
        assert 'value' not in page.tell(f'typed.readNumber({text!r})'), text
    assert 'value' not in page.tell('typed.readNumber("1,5", true)'), 'no whole number'
    for text in ('0.5, 1', '0.5 1', '0.5; 1', '0.5 ;1,'):
        assert page.tell(f'typed.readNumbers({text!r})') == {'values': [0.5, 1]}, text
    for text in ('0,5', '0,5 1', '1,2,3', '1, b'):
        assert 'values' not in page.tell(f'typed.readNumbers({text!r})'), text


def test_the_keyboard_pauses_steps_and_goes_on(page: Page) -> None:
    page.key(' ')
    step = f'Math.round({SAMPLES}.time / {SAMPLES}.step)'
    page.until(f'{STATE} === "paused" && antennaDrive.run.at === {step}')
    before = page.tell(step)
    page.tell('document.getElementById("steps").value = 7')
    page.key('.')
    # on its way the drive is playing, and may say so at a step between
    page.until(f'{STATE} === "paused" && antennaDrive.run.at > {before} '
               f'&& antennaDrive.run.at === {step}')
    assert page.tell(step) == before + 7
    assert page.tell(STATE) == 'paused'
    page.key(' ')
    page.until(f'{STATE} === "playing" && {step} > {before + 100}')


def test_a_test_signal_is_seen_before_it_is_played(page: Page) -> None:
    page.click('#tab-signal')
    form = '[data-signal="rate"]'
    page.until(f'document.querySelector(\'{form} [data-name="waveform"] select\')')
    page.tell(f'(() => {{ const s = document.querySelector(\'{form} [data-name="waveform"] '
              'select\'); s.value = "sine"; s.dispatchEvent(new Event("change")); })()')
    page.until(f'document.querySelector(\'{form} p\').textContent.includes("-0.685 to 0.685 deg")')
    assert page.tell(f'document.querySelector(\'{form} [data-name="bit_time"]\').hidden')
    page.click(f'{form} button.main')
    page.until('antennaDrive.charts.changes.at(-1)?.changes.waveform === "sine"')
    page.until(f"document.querySelector('{form} button.main').disabled")


@pytest.mark.slow
def test_an_experiment_starts_the_drive_as_in_the_article(page: Page) -> None:
    run = page.tell(f'{SAMPLES}.run')
    page.click('#tab-article')
    page.click('.cards button:first-child')
    # five processes end and five others start
    page.until(f'{SAMPLES}.run > {run} && {SAMPLES}.time > 0.5 && {STATE} === "playing"', 240.0)
    page.until('document.querySelector(".cards button").getAttribute("aria-pressed") === "true"')
    claims = page.tell('document.querySelector("#article table").textContent')
    assert '193' in claims, 'Section IV: 193 deg/s'
    assert page.tell('antennaDrive.charts.levels.length') == 4
    page.until(f'Math.abs({SAMPLES}.last("test_signal/rate_command") * 180 / Math.PI)'
               '.toFixed(6) === "0.013000"')


@pytest.mark.trial  # the recorder has tests of its own
def test_a_recording_is_made_and_drawn_beside_the_live_curves(page: Page) -> None:
    page.click('#tab-tapes')
    page.tell('document.getElementById("record-name").value = "from_the_page"')
    page.click('#record')
    page.until('document.getElementById("record").getAttribute("aria-pressed") === "true"')
    page.until('/[1-9]/.test(document.getElementById("record").textContent)')
    page.click('#record')
    page.until('document.getElementById("record").getAttribute("aria-pressed") === "false"')
    said = page.until('/steps recorded to/.exec(document.querySelector("#tapes p").textContent)'
                      '?.input')
    path = Path(said.rpartition(' to ')[2])
    recorded = read_recording(path)
    assert path.name == 'from_the_page'
    assert len(recorded['torque_share/bias_voltage']) > 10
    page.tell(f'document.querySelector("#tapes input[list]").value = {str(path)!r}')
    page.click('#tapes input[list] + datalist + button')
    page.until('antennaDrive.charts.tape?.name === "from_the_page"')
    assert page.tell('antennaDrive.charts.tape.duration') == pytest.approx(recorded.duration_s)


@pytest.fixture
def twin(module_domain: int) -> Iterator[StandInTwin]:
    found = StandInTwin(module_domain)
    yield found
    found.close()


def test_a_twin_is_shown_with_its_verdict_and_its_next_test_is_played(
        page: Page, twin: StandInTwin) -> None:
    twin.say(VERDICT)  # before the page's node has met the twin: it hears the last one
    page.click('#tab-twin')
    text = '(document.querySelector("#twin .twin")?.textContent ?? "")'
    page.until(f'{text}.includes("gap since 3 s") && {text}.includes("70 % after 45 s")')
    assert page.tell('document.querySelector("#twin .twin h2").textContent') == '/beside/watcher'
    assert page.tell('document.querySelector("#twin td").textContent') == (
        '0.5 article A instead of 0.01 article A, mean +9.0 sigma')
    # a line for each answer, and its points: as high as it is probable
    assert page.tell('document.querySelectorAll("#twin polyline").length') == 4
    first, second = page.tell('[...document.querySelector("#twin polyline").points]'
                              '.map(point => [point.x, point.y])')
    least, most = page.tell('[0, 2].map(n => Number(document.querySelectorAll("#twin .grid")[n]'
                            '.getAttribute("y1")))')
    assert [(least - y) / (least - most) for _, y in (first, second)] == pytest.approx(
        [0.3, 0.7], abs=0.01)
    button = 'document.querySelectorAll("#twin button")'
    page.tell(f'{button}[0].click()')
    page.until('document.getElementById("said").textContent.includes("another test")')
    page.tell(f'{button}[1].click()')
    page.until(f'{text}.includes({NEXT_TEST["say"][0]!r}) && !{button}[2].hidden')
    page.tell(f'{button}[2].click()')
    page.until('[...document.querySelectorAll("#nodes td")].some(cell => '
               'cell.textContent.includes("period = 3"))')
    assert twin.begun == 1


@pytest.mark.parametrize('dark', [False, True], ids=['light', 'dark'])
@pytest.mark.parametrize('width', [1400, 768, 390])
def test_nothing_is_cut_off(page: Page, width: int, dark: bool) -> None:
    page.look(width, 900, dark)
    for tab in ('tune', 'signal', 'article', 'tapes', 'nodes', 'twin'):
        page.tell(f'document.getElementById("tab-{tab}").click()')
        page.until(f'!document.getElementById("{tab}").hidden')
        assert page.until('document.documentElement.scrollWidth') <= width
        cut = page.tell(f"""[...document.querySelectorAll(
            'header button, header *, #chips *, .looked *, .head *, #{tab} *')]
            .filter(e => e.getClientRects().length && !e.closest('datalist'))
            .filter(e => {{ const b = e.getBoundingClientRect();
                            return b.left < -1 || b.right > innerWidth + 1; }})
            .map(e => e.outerHTML.slice(0, 80))""")
        assert cut == []
        assert page.tell('document.querySelector(".tabs").getBoundingClientRect().bottom <= '
                         f'document.getElementById("{tab}").getBoundingClientRect().top')
    paper = page.tell('getComputedStyle(document.body).backgroundColor')
    assert (paper == 'rgb(20, 23, 26)') == dark
