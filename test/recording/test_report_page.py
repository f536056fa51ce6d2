# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The page about a recording in a real browser: drawn, zoomable, and asking nobody."""

from __future__ import annotations

from collections.abc import Iterator
import json
import math
from pathlib import Path
import re

from antenna_drive.recording.panels import PANELS, panels_of
from antenna_drive.recording.recording import Change, Recording
from antenna_drive.recording.report import page
from antenna_drive.recording.sheet import parse_sheet
from chromium import EXECUTABLE, Page
import numpy as np
import pytest
from simgap.logs.channel import RecordingError
from simgap.report.curves import COLOURS

needs_browser = pytest.mark.skipif(EXECUTABLE is None, reason='there is no Chromium '
                                                              '(apt-get install chromium)')
HOSTILE = '</script><img src="http://127.0.0.1:9/x" onerror="boom()">{{DATA}}'


def some_recording(samples: int = 4000) -> Recording:
    time = np.arange(samples) * 1e-3
    signals = {name: math.cos(i) * np.sin(2 * math.pi * time / (1.0 + i))
               for i, name in enumerate(n for panel in PANELS for n in panel.names)}
    return Recording.from_arrays(
        time, {**signals, 'wind/speed': 7.5 + 0.1 * np.cos(time)},
        configuration={'motor_1': {
            'motor.current_limit': 5.049, 'armature.physical_amperes_per_article_ampere': 6.0},
            HOSTILE: HOSTILE},
        changes=(Change(1200, 'torque_share', {'bias_pot': 0.892}),) * 2,
        sheet=parse_sheet({'circuit': 'new', 'elevation_deg': 45.0}), notes={'who': HOSTILE})


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Page]:
    with Page(tmp_path / 'profile') as opened:
        yield opened


def write(tmp_path: Path, recording: Recording, title: str = 'run') -> str:
    path = tmp_path / 'run.html'
    path.write_text(page(recording, title), encoding='utf-8')
    return path.as_uri()


def count_pixels(browser: Page, panel: int, colour: str) -> int:
    """Count the pixels of a panel that have nearly a curve's colour."""
    red, green, blue = (int(colour[i:i + 2], 16) for i in (1, 3, 5))
    counted = browser.tell(f"""(() => {{
        const canvas = document.querySelectorAll('canvas')[{panel}];
        const copy = document.createElement('canvas');
        [copy.width, copy.height] = [canvas.width, canvas.height];
        const context = copy.getContext('2d', {{ willReadFrequently: true }});
        context.drawImage(canvas, 0, 0);
        const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
        let count = 0;
        for (let i = 0; i < pixels.length; i += 4) {{
            if (Math.abs(pixels[i] - {red}) + Math.abs(pixels[i + 1] - {green})
                + Math.abs(pixels[i + 2] - {blue}) < 12 && pixels[i + 3] > 100) count++;
        }}
        return count;
    }})()""")
    assert isinstance(counted, int)
    return counted


def view(browser: Page) -> tuple[float, float]:
    start, end = browser.tell('[document.documentElement.dataset.from, '
                              'document.documentElement.dataset.to]')
    return float(start), float(end)


@needs_browser
def test_the_page_loads_draws_every_curve_and_asks_nobody(browser: Page, tmp_path: Path) -> None:
    recording = some_recording()
    url = write(tmp_path, recording, HOSTILE)
    browser.open(url)
    assert browser.tell('document.documentElement.dataset.state') == 'drawn'
    assert browser.complaints == []
    assert browser.requests == [url]
    assert browser.tell('document.querySelectorAll("img, iframe, link[rel=stylesheet]").length'
                        ) == 0
    assert browser.tell('document.title') == HOSTILE
    panels = panels_of(recording)
    assert browser.tell('document.querySelectorAll("canvas").length') == len(panels)
    for number, panel in enumerate(panels):
        for colour in COLOURS[:len(panel.names)]:
            assert count_pixels(browser, number, colour) > 100, panel
    text = browser.tell('document.body.innerText')
    for word in ('backlash crossings', 'current peak', 'bias voltage', 'rotor stands still',
                 'bias at zero', 'axis stands still', '1. step 1200', '2. step 1200',
                 'limit 5.049 article A', 'elevation_deg'):
        assert word in text, word


@needs_browser
def test_wheel_drag_and_keys_zoom_and_move(browser: Page, tmp_path: Path) -> None:
    browser.open(write(tmp_path, some_recording()))
    assert view(browser) == (0.0, 3.999)
    box = browser.tell('(() => { const b = document.querySelector("canvas")'
                       '.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()')
    left, right, middle = box[0] + 64, box[0] + box[2] - 12, box[1] + box[3] / 2
    quarter = left + 0.25 * (right - left)
    drawn = count_pixels(browser, 0, COLOURS[0])
    for _ in range(8):
        browser.mouse('mouseWheel', quarter, middle, deltaX=0, deltaY=-300)
    start, end = view(browser)
    assert end - start == pytest.approx(3.999 * math.exp(-8 * 0.45), rel=1e-6)
    # what was under the pointer stays there
    assert (start + 0.25 * (end - start)) == pytest.approx(0.25 * 3.999, abs=0.01)
    assert count_pixels(browser, 0, COLOURS[0]) != drawn
    browser.mouse('mousePressed', quarter, middle, button='left', clickCount=1)
    browser.mouse('mouseMoved', quarter + 50, middle, button='left', buttons=1)
    browser.mouse('mouseReleased', quarter + 50, middle, button='left', clickCount=1)
    moved = 50 / (right - left) * (end - start)
    assert view(browser) == pytest.approx((start - moved, end - moved), abs=1e-9)
    assert browser.tell('document.querySelector(".tools output").textContent').startswith(
        'values at ')
    assert float(browser.tell('document.querySelector(".head samp").textContent')) < 10.0
    browser.tell('document.getElementById("panels").focus()')
    browser.key('0')
    assert view(browser) == (0.0, 3.999)
    browser.key('+')
    assert view(browser) == pytest.approx((3.999 / 4, 3 * 3.999 / 4))
    browser.mouse('mousePressed', left, middle, button='left', clickCount=1, modifiers=8)
    browser.mouse('mouseMoved', quarter, middle, button='left', buttons=1, modifiers=8)
    browser.mouse('mouseReleased', quarter, middle, button='left', clickCount=1, modifiers=8)
    assert view(browser) == pytest.approx((3.999 / 4, 3.999 * 3 / 8), abs=1e-6)
    assert browser.complaints == []


@needs_browser
def test_a_name_hides_its_curve(browser: Page, tmp_path: Path) -> None:
    browser.open(write(tmp_path, some_recording()))
    assert count_pixels(browser, 0, COLOURS[0]) > 100
    browser.tell('document.querySelector(".head button").click()')
    assert count_pixels(browser, 0, COLOURS[0]) == 0
    assert browser.tell('document.querySelector(".head button").ariaPressed') == 'false'


@needs_browser
@pytest.mark.parametrize('values', [[1.0], [2.0, 2.0], [1e-300, -1e300], [0.0, 5e-324],
                                    [1.7e308, -1.7e308]])
def test_odd_recordings_are_drawn(values: list[float], browser: Page, tmp_path: Path) -> None:
    time = 1.7e9 + np.arange(len(values)) * 1e-3  # stamps of a wall clock
    browser.open(write(tmp_path, Recording.from_arrays(time, {'a/b': values})))
    assert browser.tell('document.documentElement.dataset.state') == 'drawn'
    assert browser.complaints == []


@needs_browser
def test_half_a_million_samples_stay_a_small_page(browser: Page, tmp_path: Path) -> None:
    samples = 500_000
    values = 0.5 * np.sin(np.arange(samples) / 20_000)
    url = write(tmp_path, Recording.from_arrays(np.arange(samples) * 1e-3, {'a/b': values}))
    assert (tmp_path / 'run.html').stat().st_size < 1_500_000
    browser.open(url)
    assert 'Of every 25 samples' in browser.tell('document.getElementById("thinned").textContent')
    assert count_pixels(browser, 0, COLOURS[0]) > 100


def test_the_page_holds_the_samples(tmp_path: Path) -> None:
    html = page(some_recording(), 'run')
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', html)
    assert found is not None
    data = json.loads(found.group(1))
    assert [p['title'] for p in data['panels']] == [p.title for p in PANELS[:-1]] + ['wind/speed']
    assert all(c['n'] == 4000 and c['step'] == 1e-3 for p in data['panels'] for c in p['curves'])
    assert 'http' not in html.replace('http-equiv', '').replace(
        HOSTILE, '').replace('http://127.0.0.1:9/x', '')


def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(RecordingError, match='no sample to draw'):
        page(Recording({}), 'empty')
