# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Looking closely: values at the cursor, zoom and drag of a paused run, and published figures."""

from __future__ import annotations

from collections.abc import Iterator
import json
import math
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import simulate
from antenna_drive.parameters import load
from chromium import Page
import pytest

CHARTS, SAMPLES = 'antennaDrive.charts', 'antennaDrive.samples'
STATE = 'document.getElementById("state").textContent'
OVER = '[data-title="Torque bias"] .u-over'
BIAS = 'torque_share/bias_voltage'


def span(page: Page) -> tuple[float, float]:
    first, last = page.tell(f'{CHARTS}.span')
    return first, last


def shown(page: Page, title: str) -> list[str]:
    """Return the values beside the names of a chart's curves."""
    of = f'[data-title="{title}"] span b'
    found: list[str] = page.tell(f'[...document.querySelectorAll({of!r})].map(e => e.textContent)')
    return found


def half_a_digit(text: str) -> float:
    """Return what a printed number may differ from the one that was rounded to it."""
    return 0.501 * 10.0 ** -len(text.partition('.')[2])


def held(page: Page, name: str, time: float) -> tuple[float, float]:
    """Return the least and the greatest value that the page holds of a signal at a time."""
    low, high = page.tell(f"""(() => {{ const s = {SAMPLES}, n = Math.floor({time} / s.interval);
        const place = n % 6000 * s.count + s.names.get({json.dumps(name)});
        return [s.lows[place], s.highs[place]]; }})()""")
    return low, high


@pytest.fixture
def paused(page: Page) -> Iterator[Page]:
    """Return the page with a run of more than twelve seconds that stands still."""
    page.until(f'{SAMPLES}.time > 12')
    page.click('#pause')
    step = f'Math.round({SAMPLES}.time / {SAMPLES}.step)'
    page.until(f'{STATE} === "paused" && antennaDrive.run.at === {step}')
    yield page
    page.mouse('mouseMoved', 1, 1)
    page.click('#pause')
    page.until(f'{STATE} === "playing"')


@pytest.mark.slow
def test_a_window_grows_from_ten_seconds(page: Page) -> None:
    first, last = span(page)
    now = page.tell(f'{SAMPLES}.time')
    assert first == 0.0 and last == pytest.approx(max(10.0, now), abs=0.5)
    page.until(f'{SAMPLES}.time > 11 && {CHARTS}.span[1] === {SAMPLES}.time '
               f'&& {CHARTS}.span[0] === 0')


def test_what_is_at_the_cursor_stands_beside_the_names_of_all_charts(paused: Page) -> None:
    paused.tell(f'{CHARTS}.draw()')
    latest = shown(paused, 'Torque bias')
    # where the page's reader, a guest, has missed no step
    whole = paused.until(f"""(() => {{ const s = {SAMPLES};
        const there = n => s.lows.subarray(n % 6000 * s.count, (n % 6000 + 1) * s.count)
          .every(Number.isFinite);
        for (let n = s.newest - 400; n > s.oldest + 200; n--)
          if ([-3, -2, -1, 0, 1, 2, 3].every(more => there(n + more))) return n * s.interval;
        }})()""")
    paused.tell(f'{CHARTS}.show({whole} - 1, {whole} + 1)')  # a pixel is shorter than 10 ms
    x, y = paused.place(OVER, 0.5)
    paused.mouse('mouseMoved', x, y)
    said = paused.until('/^values at ([0-9.]+) s$/.exec(document.getElementById("at").textContent)'
                        '?.[1]')
    assert float(said) == pytest.approx(whole, abs=0.01)
    for title, name, factor, line in (
            ('Torque bias', BIAS, 1.0, 0), ('Axis rate', 'plant/axis_rate', 180 / math.pi, 1),
            ('Motor current', 'motor_2/current', 1.0, 1)):
        texts = shown(paused, title)[line].split(' to ')
        ends, printed = [float(text) for text in texts], max(half_a_digit(text) for text in texts)
        near = [held(paused, name, float(said) + shift) for shift in (-0.01, 0.0, 0.01)]
        least = factor * min(low for low, _ in near)
        most = factor * max(high for _, high in near)
        assert least - printed <= min(ends) <= max(ends) <= most + printed, title
    paused.mouse('mouseMoved', 1, 1)
    paused.until('!document.getElementById("at").textContent.startsWith("values")')
    assert shown(paused, 'Torque bias') == latest


def test_a_paused_run_is_zoomed_and_dragged(paused: Page) -> None:
    whole = span(paused)
    x, y = paused.place(OVER, 0.5)
    middle = sum(whole) / 2
    paused.mouse('mouseWheel', x, y, deltaX=0, deltaY=-600)
    paused.until(f'{CHARTS}.fixed')
    first, last = span(paused)
    assert last - first == pytest.approx(math.exp(-0.9) * (whole[1] - whole[0]), rel=1e-3)
    assert (first + last) / 2 == pytest.approx(middle, abs=0.02)
    scales = paused.tell(f'{CHARTS}.charts.map(c => [c.plot.scales.x.min, c.plot.scales.x.max])')
    assert scales == [[first, last]] * 5, 'all charts show it'
    # to the left: later times come into view, by as much as the mouse moves
    dragged(paused, (x, y), paused.place(OVER, 0.25))
    assert span(paused) == pytest.approx((first + 0.25 * (last - first),
                                          last + 0.25 * (last - first)), abs=0.02)
    first, last = span(paused)
    dragged(paused, paused.place(OVER, 0.2), paused.place(OVER, 0.4), modifiers=8)
    assert span(paused) == pytest.approx((first + 0.2 * (last - first),
                                          first + 0.4 * (last - first)), abs=0.02)
    paused.tell('document.getElementById("charts").focus()')
    paused.key('-')
    assert paused.tell(f'{CHARTS}.span[1] - {CHARTS}.span[0]') == pytest.approx(
        0.4 * (last - first), rel=0.05)
    paused.click('#follow')
    assert span(paused) == whole
    paused.key('+')  # focus is on a button now: the charts do not take it
    assert span(paused) == whole


def dragged(page: Page, start: tuple[float, float], end: tuple[float, float],
            **more: Any) -> None:
    """Drag with the left button."""
    page.mouse('mousePressed', *start, button='left', clickCount=1, **more)
    page.mouse('mouseMoved', *end, button='left', buttons=1, **more)
    page.mouse('mouseReleased', *end, button='left', clickCount=1, **more)


def test_curves_that_run_do_not_run_away_and_follow_again_after_a_pause(page: Page) -> None:
    x, y = page.place(OVER, 0.5)
    page.mouse('mouseWheel', x, y, deltaX=0, deltaY=-300)
    dragged(page, (x, y), page.place(OVER, 0.3))
    assert page.tell(f'{CHARTS}.fixed') is None
    page.key(' ')
    page.until(f'{STATE} === "paused"')
    page.tell(f'{CHARTS}.show(2, 3)')
    page.key(' ')
    page.until(f'{STATE} === "playing" && {CHARTS}.fixed === null')


def test_published_levels_are_named_where_no_curve_is(page: Page) -> None:
    page.until('document.querySelector(\'[data-title="Torque bias"] .level\')')
    assert page.tell('[...document.querySelectorAll(\'[data-title="Torque bias"] .level\')]'
                     '.map(e => e.textContent)') == [
        'published, analysis 11.6, 7.20', 'published, field 11.4, 8.00'], 'Section V, Fig. 20'
    # above the canvas with the curves, and nothing is written into it
    assert page.tell("""(() => {
        const chart = document.querySelector('[data-title="Torque bias"]');
        const box = name => chart.querySelector(name).getBoundingClientRect();
        return box('.head').bottom <= box('.u-over').top; })()""")


@pytest.mark.slow
def test_what_is_obtained_stands_beside_what_is_published(page: Page) -> None:
    page.click('#tab-article')
    row = 'document.querySelector(\'[data-measure="T3b.{}"]\')?.textContent'
    page.until(row.format('time_at_zero'))
    low = page.until('/([0-9] V|not known)$/.exec(' + row.format('low') + ')?.input', 240.0)
    if low.endswith('not known'):  # a busy machine: the page's reader is a guest that came late
        assert page.tell(
            'Number(document.querySelector("#nodes p").textContent.match(/[0-9]+/)[0])') > 0
        return
    experiment = experiments()['T3b']
    bias = simulate(experiment.drive(), experiment.duration)[BIAS][5000:]
    for what, value in (('low', bias.min()), ('high', bias.max())):
        text = page.tell(row.format(what))
        assert float(text.split()[-2].rpartition(')')[2]) == pytest.approx(value, abs=0.02)
    assert page.tell(row.format('time_at_zero')) == 'share of the time without biasnever0 %'


def test_the_title_says_whose_drive_it_is(page: Page) -> None:
    assert page.tell('[...document.querySelectorAll("#about span")].map(e => e.textContent)') == [
        'namespace /', 'configuration new_circuit', 'experiment T3b, saw-tooth, new circuit']


def test_currents_are_offered_in_real_amperes(page: Page) -> None:
    chip = """[...document.querySelectorAll('#chips button')].find(
        button => button.textContent === 'Motor current, real')"""
    page.until(chip)
    page.tell(f'{chip}.click()')
    assert page.tell("""document.querySelector('[data-title="Motor current, real"] .head b')
        .textContent""") == 'Motor current, real [real A]'
    both = page.until(f"""(() => {{ {CHARTS}.draw();
        const both = ['Motor current', 'Motor current, real'].map(title => Number(
          document.querySelector(`[data-title="${{title}}"] span b`).textContent));
        return Math.abs(both[0]) > 0.5 && both; }})()""")
    ratio = load().motor_1.armature.physical_amperes_per_article_ampere
    assert both[1] / both[0] == pytest.approx(ratio, rel=2e-3)
    page.tell(f'{chip}.click()')
