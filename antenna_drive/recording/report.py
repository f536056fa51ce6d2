# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""One self-contained page about a recording: curves to zoom into, figures, configuration."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from html import escape
import json
import math
from pathlib import Path
import re
from typing import Any

from antenna_drive import __version__
from antenna_drive.recording.figures import MotorStatistics, Statistics, statistics
from antenna_drive.recording.panels import Panel, panels_of, real_amperes
from antenna_drive.recording.picture import COLOURS
from antenna_drive.recording.recording import Channel, Recording
from antenna_drive.recording.sheet import sheet_tree
import numpy as np

TEMPLATE = Path(__file__).with_name('report_page.html')
# A curve of more samples is thinned to the lowest and the highest of as many as needed.
MOST_SAMPLES = 40_000


def page(recording: Recording, title: str) -> str:
    """
    Return the page as HTML.

    Parameters
    ----------
    recording
        what the page is about
    title
        its name, for people

    Raises
    ------
    RecordingError : there is no sample to draw

    """
    panels = panels_of(recording)
    kappa = real_amperes(recording)
    data = {'panels': [_panel(recording, panel, kappa) for panel in panels]}
    parts = {
        'TITLE': escape(title),
        'SUMMARY': _summary(recording),
        'STATISTICS': _statistics(statistics(recording), recording, kappa),
        'ABOUT': _about(recording),
        # a script ends at the first '</script', wherever it stands
        'DATA': json.dumps(data, allow_nan=False).replace('<', '\\u003c'),
    }
    # in one go: what a recording holds is never taken for a mark of the page
    return re.sub(r'{{([A-Z]+)}}', lambda mark: parts[mark.group(1)],
                  TEMPLATE.read_text(encoding='utf-8'))


def thinned(channel: Channel, most: int = MOST_SAMPLES) -> tuple[Channel, int]:
    """
    Return a channel of at most `most` samples that looks the same, and how many became two.

    Of each run of samples only the lowest and the highest are kept, so that no peak is lost.
    """
    if len(channel) <= most:
        return channel, 1
    width = math.ceil(2 * len(channel) / most)
    whole = len(channel) // width * width
    runs = channel.values[:whole].reshape(-1, width)
    first = np.arange(0, whole, width)
    kept = np.concatenate([first + runs.argmin(axis=1), first + runs.argmax(axis=1),
                           [0, len(channel) - 1]])
    if whole < len(channel):
        rest = channel.values[whole:]
        kept = np.append(kept, [whole + rest.argmin(), whole + rest.argmax()])
    kept = np.unique(kept)
    return Channel(channel.unit, channel.time_ns[kept], channel.values[kept]), width


def _panel(recording: Recording, panel: Panel, kappa: float | None) -> dict[str, Any]:
    curves = []
    for name, colour in zip(panel.names, COLOURS * 3):
        channel, width = thinned(recording[name])
        values = panel.factor * channel.values
        # shares of the widest difference from the first value: four bytes are then enough
        base = float(values[0])
        with np.errstate(over='ignore'):
            scale = float(np.abs(values - base).max()) or 1.0
        if math.isinf(scale):
            base, scale = 0.0, float(np.abs(values).max())
        stamps = channel.time_ns - channel.time_ns[0]
        steps = np.diff(stamps)
        even = len(steps) > 0 and bool(np.all(steps == steps[0]))
        curves.append({
            'name': name, 'colour': colour, 'n': len(channel), 'thinned': width,
            'base': base, 'scale': scale,
            'start': int(channel.time_ns[0]) / 1e9,
            'step': int(steps[0]) / 1e9 if even else None,
            'times': None if even else _base64(stamps / 1e9, '<f8'),
            'values': _base64((values - base) / scale, '<f4')})
    unit = panel.unit
    if unit == 'article A' and kappa:
        unit += f' (1 = {kappa:g} real A)'
    return {'title': panel.title, 'unit': unit, 'curves': curves}


def _base64(numbers: Any, kind: str) -> str:
    return base64.b64encode(np.asarray(numbers).astype(kind).tobytes()).decode('ascii')


def _summary(recording: Recording) -> str:
    count = sum(map(len, recording.channels.values()))
    facts = [f'{recording.start_ns / 1e9:g} s to {recording.end_ns / 1e9:g} s',
             f'{len(recording.channels)} signals', f'{count} samples',
             f'{len(recording.changes)} live changes']
    return escape(' \u00b7 '.join(facts))


def _number(value: float | None, unit: str = '', digits: int = 4) -> str:
    if value is None:
        return '<td class="none">not recorded</td>'
    return f'<td>{value:.{digits}g}{"&nbsp;" + unit if unit else ""}</td>'


def _share(value: float | None) -> str:
    return _number(value) if value is None else f'<td>{100.0 * value:.1f}&nbsp;%</td>'


def _statistics(figures: Statistics, recording: Recording, kappa: float | None) -> str:
    rows = []

    def row(unit: str, what: str, cell: str, how: str = '') -> None:
        rows.append(f'<tr><th scope="row">{unit}</th><td>{escape(what)}</td>{cell}'
                    f'<td class="how">{escape(how)}</td></tr>')

    bias = figures.bias
    if bias:
        row('torque_share', 'bias voltage', f'<td>{bias.minimum_V:.4g} to {bias.maximum_V:.4g}'
            '&nbsp;V</td>', 'lowest to highest')
        row('torque_share', 'bias at zero', _share(bias.at_zero),
            f'share of time at or below {bias.zero_V:g} V')
    else:
        row('torque_share', 'bias voltage', _number(None))
    for motor, own in figures.motors.items():
        for what, cell, how in _motor_rows(motor, own, recording, kappa):
            row(motor, what, cell, how)
    row('plant', 'axis stands still', _share(figures.axis_stick),
        'share of time that the axis rate is zero')
    return '\n'.join(rows)


def _motor_rows(motor: str, own: MotorStatistics, recording: Recording,
                kappa: float | None) -> Iterable[tuple[str, str, str]]:
    peak = own.current_peak_A
    real = f', {peak * kappa:.4g} real A' if peak is not None and kappa else ''
    limit = _lookup(recording.configuration, motor, 'motor.current_limit')
    limited = f'; limit {limit:g} article A' if isinstance(limit, float) else ''
    at = '' if own.current_peak_s is None else f'at {own.current_peak_s:g} s{real}{limited}'
    yield 'current peak', _number(peak, 'article&nbsp;A'), at
    yield 'current, root mean square', _number(own.current_rms_A, 'article&nbsp;A'), ''
    still = '' if own.still_rad_s is None else (
        f'share of time that the rate is {"zero" if not own.still_rad_s else "within"}'
        + (f' {own.still_rad_s:g} rad/s' if own.still_rad_s else ''))
    yield 'rotor stands still', _share(own.stick), still
    yield ('backlash crossings', _number(own.backlash_crossings, digits=7),
           'changes of the flank that bears, by the sign of the gear torque')


def _lookup(tree: Any, *path: str) -> Any:
    for key in path:
        if not isinstance(tree, Mapping) or key not in tree:
            return None
        tree = tree[key]
    return tree


def _about(recording: Recording) -> str:
    sections = []
    changes = [(f'step {c.step}', {c.unit: c.values}) for c in recording.changes]
    for title, tree, is_open in (
            ('Live changes', dict(_numbered(changes)), True),
            ('Test sheet', sheet_tree(recording.sheet), True),
            ('Notes', recording.notes, False),
            ('Configuration in force at the start', recording.configuration, False)):
        body = ''.join(_rows(tree)) if tree else '<tr><td class="none">none</td></tr>'
        sections.append(f'<details{" open" if is_open and tree else ""}><summary>{title}'
                        f'</summary><table class="tree">{body}</table></details>')
    sections.append(f'<p class="how">antenna_drive {__version__}</p>')
    return '\n'.join(sections)


def _numbered(changes: Iterable[tuple[str, Any]]) -> Iterable[tuple[str, Any]]:
    """Keep apart several changes of one step."""
    for number, (step, tree) in enumerate(changes, 1):
        yield f'{number}. {step}', tree


def _rows(tree: Mapping[str, Any], path: str = '') -> Iterable[str]:
    for key, value in tree.items():
        name = f'{path}.{key}' if path else key
        if isinstance(value, Mapping):
            yield from _rows(value, name)
        else:
            text = ', '.join(map(str, value)) if isinstance(value, (tuple, list)) else str(value)
            yield f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>'
