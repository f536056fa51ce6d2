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
"""One page about a diagnosis, for an engineer with two minutes: self-contained, no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
import math
from typing import Any

from antenna_drive.diagnosis.diagnosis import Diagnosis, value_lines
from antenna_drive.diagnosis.machine import Experiment, FloatArray
from antenna_drive.machines.antenna.catalogue import catalogue
import numpy as np

_VERDICTS = {
    'no_gap': ('No gap', 'Machine and model agree within tolerance and noise.'),
    'explained': ('Explained', 'A known effect closes the gap.'),
    'partly_explained': ('Partly explained', 'A known effect closes some of the gap.'),
    'unknown_effect': ('Unknown effect', 'Nothing in the catalogue closes the gap.'),
}
# The boxes of the drive's picture: component, text, x, y, width.
_BOXES = (
    ('loop', 'rate command', 20, 95, 110), ('motor_1', 'motor 1, amplifiers', 180, 30, 150),
    ('motor_2', 'motor 2, amplifiers', 180, 160, 150), ('gearbox_1', 'gearbox 1', 380, 30, 100),
    ('gearbox_2', 'gearbox 2', 380, 160, 100), ('axis', 'axis and dish', 530, 95, 120),
    ('torque_share', 'torque share, Filter 1', 180, 95, 150), ('tach_1', 'tach 1', 380, 2, 100),
    ('tach_2', 'tach 2', 380, 195, 100), ('current_1', 'ammeter 1', 180, 2, 150),
    ('current_2', 'ammeter 2', 180, 195, 150), ('encoder', 'encoder', 700, 95, 90),
    ('bias_voltage', 'voltmeter', 380, 95, 100),
)
_LINES = (
    (130, 104, 180, 44), (130, 114, 180, 172), (330, 44, 380, 44), (330, 174, 380, 174),
    (480, 44, 530, 102), (480, 174, 530, 118), (650, 109, 700, 109), (255, 95, 255, 58),
    (255, 123, 255, 160), (330, 109, 380, 109),
)
_COLOURS = {'measured': '#444', 'before': '#c63', 'after': '#27a'}
_WIDTH, _HEIGHT = 760, 150
_POINTS = 900

_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;color:#222;
  max-width:820px;margin:24px auto;padding:0 16px}
h1{font-size:26px;margin:0 0 2px}h2{font-size:18px;margin:28px 0 6px}
.lead{font-size:17px;color:#444;margin:0 0 14px}
table{border-collapse:collapse;width:100%}td,th{padding:3px 8px;text-align:left;
border-bottom:1px solid #ddd;vertical-align:top}th{font-weight:600;color:#555}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
.bar{display:inline-block;height:10px;background:#27a;vertical-align:middle}
.small{color:#666;font-size:13px}svg{max-width:100%;height:auto}
.key span{margin-right:16px}.swatch{display:inline-block;width:18px;height:3px;
vertical-align:middle;margin-right:5px}
"""


def page(diagnosis: Diagnosis) -> str:
    """Return a diagnosis as one HTML page."""
    result = diagnosis.result
    title, lead = _VERDICTS[result['verdict']]
    parts = [f'<h1>{title}</h1><p class="lead">{lead}</p>', _drive(result), _which(result),
             _how_far(result), _where(result), _curves(diagnosis), _next(diagnosis),
             _tests(result), _notes(result)]
    return ('<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width">'
            f'<title>Diagnosis: {title}</title><style>{_STYLE}</style></head><body>'
            + ''.join(parts) + '</body></html>\n')


def _guilt(result: dict[str, Any]) -> dict[str, float]:
    """Return the probability that an effect sits in each component."""
    known = catalogue()
    guilt: dict[str, float] = {}
    for entry in result['which']:
        components = {known[effect].component for effect in entry['effects'] if effect in known}
        for component in components:
            for one in (('motor_1', 'motor_2') if component == 'motors' else (component,)):
                guilt[one] = guilt.get(one, 0.0) + entry['probability']
    return guilt


def _drive(result: dict[str, Any]) -> str:
    guilt = _guilt(result)
    shapes = [f'<line x1="{a}" y1="{b}" x2="{c}" y2="{d}" stroke="#999"/>'
              for a, b, c, d in _LINES]
    for component, text, x, y, width in _BOXES:
        share = min(guilt.get(component, 0.0), 1.0)
        fill = f'rgba(204,60,40,{0.75 * share:.2f})' if share > 0.03 else '#f4f4f4'
        mark = f' {100.0 * share:.0f} %' if share > 0.03 else ''
        shapes.append(
            f'<rect x="{x}" y="{y}" width="{width}" height="26" rx="4" fill="{fill}" '
            f'stroke="{"#a22" if share > 0.5 else "#888"}" '
            f'stroke-width="{2.5 if share > 0.5 else 1}"/>'
            f'<text x="{x + width / 2}" y="{y + 17}" text-anchor="middle" font-size="12">'
            f'{text}{mark}</text>')
    return ('<svg viewBox="0 0 800 226" role="img" aria-label="the drive, the guilty part '
            f'marked">{"".join(shapes)}</svg>')


def _number(value: float) -> str:
    return f'{value:.4g}'


def _which(result: dict[str, Any]) -> str:
    known = catalogue()
    rows = []
    for entry in result['which'][:8]:
        share = entry['probability']
        if share < 0.001:
            continue
        names = ' + '.join(escape(name) for name in entry['effects'])
        causes = '; '.join(known[name].cause for name in entry['effects'] if name in known)
        values = ''.join(f'<div class="small">{escape(line)}</div>'
                         for line in value_lines(entry['parameters']))
        rows.append(f'<tr><td class="n">{100.0 * share:.1f} %</td>'
                    f'<td><span class="bar" style="width:{120.0 * share:.0f}px"></span></td>'
                    f'<td><b>{names}</b><div class="small">{escape(causes)}</div>'
                    f'{values}</td></tr>')
    groups = ''.join(f'<p>These data cannot tell apart: {escape(", ".join(group))}.</p>'
                     for group in result['confusable'])
    return ('<h2>Which effect</h2><table><tr><th class="n">probability</th><th></th>'
            f'<th>effect</th></tr>{"".join(rows)}</table>{groups}')


def _how_far(result: dict[str, Any]) -> str:
    far = result['how_far']
    fraction = far['explained_fraction']
    text = ''
    if fraction['value'] is not None:
        low, high = fraction['ci95']
        text = (f'<p><b>{100.0 * fraction["value"]:.1f} %</b> of the gap is explained '
                f'({100.0 * low:.1f} to {100.0 * high:.1f} %).</p>')
    rows = ''.join(
        f'<tr><td>{escape(name)}</td><td class="n">{item["before"]:.2f}</td>'
        f'<td class="n">{item["after"]:.2f}</td></tr>'
        for name, item in far['per_signal'].items())
    return (f'<h2>How far the gap shrinks</h2>{text}<table><tr><th>signal</th>'
            '<th class="n">before</th><th class="n">after</th></tr>'
            f'<tr><td><b>all</b></td><td class="n">{far["before"]:.2f}</td>'
            f'<td class="n">{far["after"]:.2f}</td></tr>{rows}</table>'
            '<p class="small">Rms residual in standard deviations of the sensors; 1 is noise '
            f'alone. Judged on data that was not fitted: {escape(far["held_out"])}.</p>')


def _where(result: dict[str, Any]) -> str:
    if not result['where']:
        return ''
    rows = ''.join(
        f'<tr><td>{escape(item["component"])}</td><td>{escape(item["signal"])}</td>'
        f'<td>{escape(item["regime"])}</td><td class="n">{100.0 * item["share"]:.0f} %</td></tr>'
        for item in result['where'][:8])
    return ('<h2>Where the gap lies</h2><table><tr><th>part</th><th>signal</th><th>regime</th>'
            f'<th class="n">share</th></tr>{rows}</table>{_places(result)}')


def _places(result: dict[str, Any]) -> str:
    """Return where something unknown may have entered, if that was asked."""
    rows = ''.join(
        f'<tr><td>{escape(place["name"])}</td><td>{escape(place["component"])}</td>'
        f'<td class="n">{100.0 * place["explained"]:.0f} %</td></tr>'
        for place in result['may_enter_at'][:4])
    return rows and (
        '<p>Something that no effect of the catalogue names would have to enter here: an input of '
        'any course over time, let into each place in turn.</p><table><tr><th>place</th>'
        f'<th>part</th><th class="n">explains</th></tr>{rows}</table>')


def _curves(diagnosis: Diagnosis) -> str:
    model = diagnosis.machine
    points = [diagnosis.none.state.point(), diagnosis.best.state.point()]
    before, after = model.simulate(points)
    parts = ['<h2>Measured and simulated</h2><p class="key small">'
             + ''.join(f'<span><i class="swatch" style="background:{colour}"></i>{name}</span>'
                       for name, colour in _COLOURS.items())
             + '</p>']
    for k, experiment in enumerate(model.experiments):
        first, second = before[k], after[k]
        assert first is not None and second is not None
        gain = np.nansum(((experiment.measured - first) / experiment.noise) ** 2
                         - ((experiment.measured - second) / experiment.noise) ** 2, axis=0)
        gain[~np.isfinite(experiment.measured).any(axis=0)] = -math.inf
        channel = int(np.argmax(gain))
        parts.append(_panel(experiment, channel, first, second))
    return ''.join(parts)


def _panel(experiment: Experiment, channel: int, before: FloatArray, after: FloatArray) -> str:
    time = experiment.time
    measured = experiment.measured[:, channel]
    curves = {'measured': measured, 'before': before[:, channel], 'after': after[:, channel]}
    errors = {'before': measured - before[:, channel], 'after': measured - after[:, channel]}
    name, unit = experiment.channels[channel], experiment.units[channel]
    return (f'<p class="small"><b>{escape(experiment.name)}</b>: {escape(name)} [{escape(unit)}]'
            f'</p>{_plot(time, curves)}<p class="small">measured less simulated</p>'
            f'{_plot(time, errors)}')


def _plot(time: FloatArray, curves: dict[str, FloatArray]) -> str:
    """Return curves as an SVG; each column of pixels shows the extremes within it."""
    values = np.concatenate([c[np.isfinite(c)] for c in curves.values()])
    low, high = float(values.min()), float(values.max())
    high = high if high > low else low + 1.0
    left = 58
    lines = []
    for text, y in ((_number(high), 10), (_number(low), _HEIGHT - 18)):
        lines.append(f'<text x="{left - 6}" y="{y + 4}" font-size="11" text-anchor="end" '
                     f'fill="#666">{text}</text><line x1="{left}" x2="{_WIDTH}" y1="{y}" y2="{y}" '
                     'stroke="#eee"/>')
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x = left + share * (_WIDTH - left - 16)
        lines.append(f'<text x="{x:.0f}" y="{_HEIGHT - 2}" font-size="11" text-anchor="middle" '
                     f'fill="#666">{share * time[-1]:.3g} s</text>')
    for name, curve in curves.items():
        lines.append(f'<polyline fill="none" stroke="{_COLOURS[name]}" stroke-width="1" '
                     f'points="{_polyline(time, curve, low, high, left)}"/>')
    return f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}">{"".join(lines)}</svg>'


def _polyline(time: FloatArray, curve: FloatArray, low: float, high: float, left: int) -> str:
    good = np.flatnonzero(np.isfinite(curve))
    bins = np.array_split(good, max(1, min(_POINTS // 2, good.size)))
    keep = np.unique(np.concatenate([[b[np.argmin(curve[b])], b[np.argmax(curve[b])]]
                                     for b in bins if b.size]))
    x = left + time[keep] / time[-1] * (_WIDTH - left - 16)
    y = _HEIGHT - 18 - (curve[keep] - low) / (high - low) * (_HEIGHT - 28)
    return ' '.join(f'{a:.1f},{b:.1f}' for a, b in zip(x, y, strict=True))


def _next(diagnosis: Diagnosis) -> str:
    """Return what would settle what is open."""
    result = diagnosis.result
    known = catalogue()
    open_ids = {name for group in result['confusable'] for name in group}
    for entry in result['which']:
        if entry['probability'] > 0.05:
            open_ids |= {name for name in entry['effects'] if name in known}
    if len(open_ids) < 2 and result['verdict'] in ('explained', 'no_gap'):
        return ''
    advice = [text for ids, text in _EXPERIMENTS if _touches(ids, open_ids)]
    advice.append('antenna-drive confusability shows which test separates which effects.')
    items = ''.join(f'<li>{escape(text)}</li>' for text in advice)
    return f'<h2>What would settle what is open</h2><ul>{items}</ul>'


_EXPERIMENTS: Sequence[tuple[Sequence[str], str]] = (
    (('gravity_imbalance', 'wind_steady'),
     'The same test at two elevations far apart: gravity follows the cosine, wind does not.'),
    (('amplifier_offset', 'offset'),
     'A recording with amplifiers on at zero command, and one with each tachometer shorted.'),
    (('bias_pot', 'gain'), 'The bias voltage read with a second meter.'),
    (('coulomb_friction', 'viscous_friction', 'stribeck_friction', 'load_dependent_friction'),
     'Constant rates, at least six from creep to the fastest, in both directions.'),
    (('torque_ripple', 'ripple', 'transmission_error'),
     'One constant rate held for a minute: three revolutions of each shaft or more.'),
    (('gap', 'bull_gear_backlash', 'stiffness', 'hysteresis'),
     'Slow reversals without bias, and a bias step at rest.'),
    (('inertia', 'mode_frequency', 'mode_damping', 'extra_mode'),
     'A chirp or multisine up to 10 Hz at small amplitude with full bias.'),
    (('current_limit', 'armature_resistance', 'amplifier_gain', 'torque_constant'),
     'A square wave large enough to saturate the currents.'),
)


def _touches(names: Sequence[str], ids: set[str]) -> bool:
    return any(effect.partition('.')[2] in names for effect in ids)


def _tests(result: dict[str, Any]) -> str:
    tests = result['residual_tests']
    rows = ''.join(
        f'<tr><td>{escape(name)}</td><td class="n">{item["rms"]:.2f}</td>'
        f'<td class="n">{item["slow_excess"]:.2f}</td>'
        f'<td class="n">{item["greatest_correlation"]:.2f}</td></tr>'
        for name, item in tests['signals'].items())
    looks = ''.join(f'<li>{escape(item["signal"])} depends on {escape(item["depends_on"])} '
                    f'({100.0 * item["share"]:.0f} % of its residual)</li>'
                    for item in tests['depends_on'])
    return ('<h2>What is left</h2><table><tr><th>signal</th><th class="n">rms</th>'
            '<th class="n">slow part beyond noise</th><th class="n">greatest correlation</th></tr>'
            f'{rows}</table><ul class="small">{looks}</ul>')


def _notes(result: dict[str, Any]) -> str:
    items = ''.join(f'<li>{escape(note)}</li>' for note in result['notes'])
    return (f'<h2>Notes</h2><ul class="small">{items}'
            f'<li>{result["seconds"]:.0f} s of computing</li></ul>')
