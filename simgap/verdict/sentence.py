# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A verdict in plain words: what, where, how large, how sure, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any, NamedTuple, TYPE_CHECKING

from simgap.machine.contract import Words
from simgap.verdict.spoken import number, percent, quantity, ratio

if TYPE_CHECKING:
    from simgap.verdict.record import Verdict

_DESIGNED = 'the test that `propose` designs from the JSON of this verdict'


class Said(NamedTuple):
    """A verdict in plain words."""

    what: str
    sure: str
    then: str

    def __str__(self) -> str:
        """Return all of it, as the text, the page and the JSON have it."""
        return ' '.join(part for part in self if part)


def said(verdict: Verdict) -> Said:
    """Return a verdict in plain words."""
    top = verdict.which[0]
    if verdict.word == 'unknown_effect':
        what, then = _unknown(verdict), [
            f'record {_DESIGNED}; one test is not enough for a name, so diagnose all recordings '
            'together, and repeat']
    elif verdict.word in ('no_gap', 'too_few_to_judge'):
        what, then = _nothing(verdict)
    else:
        found = [_effect(verdict, effect, top.parameters) for effect in top.effects]
        what = ' '.join(f'{text[0].upper()}{text[1:]}.' for text, _ in found)
        then = list(dict.fromkeys(step for _, steps in found for step in steps))
    sure = f'Probability {percent(top.probability)}.'
    return Said(what, ' '.join([sure, *_how_sure(verdict)]),
                f'Next: {"; ".join(then)}.' if then else '')


def loud(remains: Mapping[str, Any]) -> list[str]:
    """Return the signals whose remainder matters, or exceeds noise where nobody said which do."""
    judged = {name: item for name, item in remains.items() if 'rms' in item}
    asked = any(item.get('matters') is not None for item in judged.values())
    return [name for name, item in judged.items()
            if (item['matters'] if asked else item['beyond_noise'] > item['noise'])]


def _how_sure(verdict: Verdict) -> list[str]:
    if verdict.word not in ('explained', 'partly_explained'):
        return []
    lines, fraction = [], verdict.how_far['explained_fraction']
    them = 'them' if verdict.which[0].effects[1:] else 'it'
    judged = set(verdict.which[0].effects) <= set(verdict.how_far['judged'])
    if judged and fraction['value'] is not None and fraction['value'] >= 0.0:
        low, high = (f'{100.0 * max(bound, 0.0):.0f}' for bound in fraction['ci95'])
        lines.append(f'Adding {them} removes {percent(fraction["value"])} of the gap on data that '
                     'was not fitted' + (f' ({low} to {high}).' if low != high else '.'))
    elif fraction['value'] is not None and judged:
        lines.append(f'Adding {them} makes the gap wider on data that was not fitted.')
    if verdict.word == 'partly_explained':
        lines.append('Something else acts beside that.')
    lines += [f'These data cannot tell {group[0]} from {" or ".join(group[1:])}: record '
              f'{_DESIGNED}.' for group in verdict.confusable if group[1:]]
    return lines


def _nothing(verdict: Verdict) -> tuple[str, list[str]]:
    if verdict.word == 'too_few_to_judge':
        return 'Too few samples to judge: no gap shows, and none could.', [
            'record more samples of a longer test']
    rest = [_beyond(name, verdict.remains[name]) for name in loud(verdict.remains)]
    if not rest:
        return 'Machine and model agree within tolerance and noise.', []
    return (f'No known effect shows, but not all is noise: what remains of {"; of ".join(rest)}.',
            [f'compare the noise that is assumed with a recording at rest, and record '
             f'{_DESIGNED}'])


def _beyond(name: str, item: Mapping[str, Any]) -> str:
    return (f'{name} is {quantity(item["beyond_noise"], item["unit"])} beyond noise of '
            f'{quantity(item["noise"], item["unit"])}')


def _unknown(verdict: Verdict) -> str:
    what = 'Something acts that no known effect explains'
    if verdict.where:
        first = verdict.where[0]
        what += (f', most likely in {first["component"]}; it shows most in {first["signal"]} '
                 f'({first["regime"]})')
    lines = [f'{what}.']
    sizes = {name: item for name, item in verdict.how_far['per_signal'].items()
             if item.get('before') is not None and item.get('before_in_unit') is not None}
    if sizes:
        name = max(sizes, key=lambda key: float(sizes[key]['before']))
        lines.append(f'The model misses {name} by '
                     f'{quantity(sizes[name]["before_in_unit"], sizes[name]["unit"])} rms.')
    if verdict.may_enter_at:
        place = verdict.may_enter_at[0]
        lines.append(f'As {place.name} it could explain {percent(place.explained)} of the gap.')
    return ' '.join(lines)


def _effect(verdict: Verdict, effect: str,
            parameters: Mapping[str, Any]) -> tuple[str, Sequence[str]]:
    """Return what is said of an effect, and its next steps."""
    known = verdict.machine.catalogue.get(effect)
    forms = known.forms if known else ()
    shapes = {_bare(p.name) for form in forms for p in form.parameters if p.is_shape}
    sizes = {name: item for name, item in parameters.items()
             if name.startswith(f'{effect}.') and _bare(name) not in shapes}
    cause = f' ({known.cause})' if known and known.cause else ''
    general = ['inspect what may cause it', 'diagnose again with a recording that was not used '
               'here']
    if not sizes:
        return f'the model lacks {effect}{cause}', general
    name = max(sizes, key=lambda key: abs(sizes[key]['value']))
    waves = [key for key in sizes if _bare(key).endswith('sine')]
    item = _amplitude([sizes[key] for key in waves]) if waves else sizes[name]
    words = verdict.machine.words.get(_bare(name), Words(
        f'the model lacks {effect}{cause}, {_bare(name).removeprefix(effect)[1:]}',
        then=tuple(general)))
    text = _sized(words, item)
    if '@' in name:
        text += f', {name.partition("@")[2].partition("[")[0]} cycles a turn'
    if any(form.is_course for form in forms):
        text = text.replace(': ', ': up to ', 1)
    text += ''.join(f', {key.rpartition(".")[2].replace("_", " ")} '
                    f'{quantity(item["value"], item["unit"])}' for key, item in parameters.items()
                    if _bare(key) in shapes and item['unit'] != '1')
    return text + (f', where {name[name.index("[") + 1:-1]}' if name.endswith(']') else ''
                   ), words.then


def _bare(name: str) -> str:
    """Return the name of a parameter without its order and its label."""
    return name.partition('@')[0].partition('[')[0]


def _amplitude(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the amplitude of a wave from its sine and cosine parts, with its interval."""
    size = math.hypot(*(part['value'] for part in parts))
    half = math.hypot(*(0.5 * (part['ci95'][1] - part['ci95'][0]) * part['value'] / size
                        for part in parts)) if size else 0.0
    return {'value': size, 'ci95': [max(size - half, 0.0), size + half],
            'unit': parts[0]['unit']}


def _sized(words: Words, item: Mapping[str, Any]) -> str:
    """Return what is said of a number with its size, beside the configured one if there is one."""
    base, values = words.configured, [item['value'], *item['ci95']]
    if base:
        made = [base * (1.0 + v) if words.how == 'scale' else v if words.how == 'set' else base + v
                for v in values]
        change = made[0] / base - 1.0
    else:
        change = values[0]
        made = [-v for v in values] if change < 0.0 and words.smaller else values
    low, high = sorted(made[1:])
    text = words.smaller if change < 0.0 and words.smaller else words.greater
    if '{by}' in text and not base:
        near, far = sorted(max(v * math.copysign(1.0, change), 0.0) for v in values[1:])
        return text.replace('{by}', f'{ratio(change)} ({ratio(near, "")} to {ratio(far, "")})')
    text = text.replace('{by}', ratio(change))
    return (f'{text}: {quantity(made[0], words.unit or item["unit"])} '
            f'({number(low)} to {number(high)})' + (f' instead of {number(base)}' if base else ''))
