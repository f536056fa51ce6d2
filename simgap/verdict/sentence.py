# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A verdict in plain words: what, where, how large, how sure, and what to do next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TYPE_CHECKING

from simgap.machine.with_law import Law
from simgap.next_test.design import objective_for, SEPARATE
from simgap.next_test.rivals import Findings
from simgap.settings import DEFAULT
from simgap.verdict.intervals import jackknife, TWO_SIDED_95
from simgap.verdict.law_form import nearest_form
from simgap.verdict.reproducibility import contradictions
from simgap.verdict.spoken import percent, quantity, size, with_interval

if TYPE_CHECKING:
    from simgap.verdict.record import Verdict

# A machine without words of its own has so many numbers of an effect listed, a law its waves.
_LISTED = 4


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
            f'record {_designed(verdict)}; one test is not enough for a name, so diagnose all '
            'recordings together, and repeat']
    elif verdict.word in ('no_gap', 'too_few_to_judge'):
        what, then = _nothing(verdict)
    else:
        found = [_effect(verdict, effect, top.parameters) for effect in top.effects]
        what = ' '.join(f'{text[0].upper()}{text[1:]}.' for text, _ in found)
        then = list(dict.fromkeys(step for _, steps in found for step in steps))
        if is_open(verdict):
            # a test that tells the answers apart comes before any that repeats what was found
            then = [f'record {_designed(verdict)}, to tell the answers apart',
                    *(step for step in then if not step.startswith('repeat '))]
    sure = f'Probability {percent(top.probability)}.'
    if apart := '; '.join(contradictions(verdict.reproducibility)):
        what += f' The recordings contradict each other: {apart}.'
    return Said(what, ' '.join([sure, *_how_sure(verdict)]),
                f'Next: {"; ".join(then)}.' if then else '')


def is_open(verdict: Verdict) -> bool:
    """Return whether several answers are left, which a further test has to tell apart."""
    return bool(verdict.confusable) or _separates(verdict)


def _separates(verdict: Verdict) -> bool:
    """Return whether that is what `propose` does if it is told nothing else."""
    known = Findings.of_data(verdict.planning) if verdict.planning else Findings()
    return objective_for(known) == SEPARATE


def _designed(verdict: Verdict) -> str:
    asked = ' --objective separate' if is_open(verdict) and not _separates(verdict) else ''
    return f'the test that `propose{asked}` designs from what `diagnose --json` writes'


def headline(verdict: Verdict) -> str:
    """Return the verdict in a few words, which nothing below them contradicts."""
    word, apart = verdict.word, contradictions(verdict.reproducibility)
    rest = bool(loud(verdict.remains) or word == 'no_gap' and apart)
    fraction = verdict.how_far['explained_fraction']['value']
    if word in ('explained', 'partly_explained') and fraction is not None and fraction <= 0.0:
        return 'named, but it closes nothing of data that was not fitted'
    return {('no_gap', True): 'no effect named',
            ('explained', True): 'explained, but something remains',
            }.get((word, rest), word.replace('_', ' '))


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
    lines += [f'These data cannot tell {group[0]} from {" or ".join(group[1:])}.'
              for group in verdict.confusable if group[1:]]
    return lines + list(_doubts(verdict))


def _doubts(verdict: Verdict) -> Iterator[str]:
    """Yield what makes a number doubtful: its interval, and why; the end of its range."""
    top, folds = verdict.which[0], verdict.how_far.get('folds', ())
    sizes = {p.name: p for effect in top.effects if effect in verdict.machine.catalogue
             for form in verdict.machine.catalogue[effect].forms
             if not form.is_wave for p in form.sizes}
    for name, item in top.parameters.items():
        if name not in sizes:
            continue
        word = name.rpartition('.')[2].replace('_', ' ')
        half = 0.5 * (item['ci95'][1] - item['ci95'][0])
        if item['value'] in (sizes[name].low, sizes[name].high):
            yield f'{word.capitalize()} is at the end of its range: widen it, or doubt the model.'
        if half <= DEFAULT.verdict.wide * abs(item['value']):
            continue
        # what makes half of it is why
        turns = [fold['values'][name] for fold in folds if name in fold['values']]
        if TWO_SIDED_95 * jackknife(turns) >= 0.5 * half:
            why = ('the recordings differ: without one or another it is '
                   f'{size(min(turns), item["unit"])} to {size(max(turns), item["unit"])}')
        elif sizes[name].tolerance >= 0.5 * half:
            why = ('a healthy machine may have up to '
                   f'{size(sizes[name].tolerance, item["unit"])} of it')
        else:
            why = 'these recordings hardly show it'
        yield f'The interval of {word} is wide: {why}.'


def _nothing(verdict: Verdict) -> tuple[str, list[str]]:
    if verdict.word == 'too_few_to_judge':
        return 'Too few samples to judge: no gap shows, and none could.', [
            'record more samples of a longer test']
    rest = [f'{name} is {beyond(verdict.remains[name])}' for name in loud(verdict.remains)]
    if not rest:
        return 'Machine and model agree within tolerance and noise.', []
    return (f'No known effect shows, but not all is noise: what remains of {"; of ".join(rest)}.',
            ['compare the noise that is assumed with a recording at rest, and record '
             f'{_designed(verdict)}'])


def beyond(item: Mapping[str, Any]) -> str:
    """Return by how much what remains of a signal exceeds its noise."""
    return (f'{quantity(item["beyond_noise"], item["unit"])} beyond noise of '
            f'{quantity(item["noise"], item["unit"])}')


def _unknown(verdict: Verdict) -> str:
    what = 'Something acts that no known effect explains'
    if verdict.where:
        first = verdict.where[0]
        what += (f', most likely in {first["component"]}; it shows most in {first["signal"]} '
                 f'({first["regime"]})')
    lines = [f'{what}.']
    # the greatest in its noise, as it was read: a filter would take slow steps for noise
    noises = {name: item.get('noise') for name, item in verdict.remains.items()}
    sizes = {name: item for name, item in verdict.how_far['per_signal'].items()
             if item.get('before_in_unit') is not None and noises.get(name)}
    if sizes:
        name = max(sizes, key=lambda key: float(sizes[key]['before_in_unit'] / noises[key]))
        lines.append(f'The model misses {name} by '
                     f'{quantity(sizes[name]["before_in_unit"], sizes[name]["unit"])} rms.')
    if verdict.may_enter_at:
        place = verdict.may_enter_at[0]
        as_law = f', best as a function of {place.law}' if place.law else ''
        lines.append(f'As {place.name} it could explain {percent(place.explained)} of the gap'
                     f'{as_law}.')
        if place.law:
            lines.append(_law(place.law))
    return ' '.join([*lines, *_when(verdict)])


def _law(law: Law) -> str:
    """Return a law in words: its extremes, what it is like, and what withheld data say of it."""
    least, most = (choose(range(len(law.values)), key=lambda j: law.values[j])
                   for choose in (min, max))
    low, high = sorted((least, most))
    text = (f'It goes from {quantity(law.values[low], law.unit)} at '
            f'{quantity(law.at[low], law.by_unit)} to {quantity(law.values[high], law.unit)} at '
            f'{quantity(law.at[high], law.by_unit)}, ')
    if law.orders:
        text += 'a sum of waves a turn: ' + ', '.join(
            f'{order} with {quantity(size, law.unit)}' for order, size in law.waves()[:_LISTED])
    else:
        form, lacks = nearest_form(law)
        text += f'most like {form}, which lacks {percent(lacks)} of it'
    if law.withheld is None:
        return f'{text}.'
    if law.withheld <= 0.0:
        return f'{text}; it closes nothing of the gap of a recording that was not fitted.'
    return (f'{text}; it closes {percent(law.withheld)} of the gap of recordings that were not '
            'fitted.')


def _when(verdict: Verdict) -> Iterator[str]:
    """Yield when something unknown acts, where it begins or ends in a test."""
    # a declared model has places that are pushed, with sizes
    spans = getattr(verdict, 'pushes', ()) or [
        span for item in verdict.where[:1] for span in item.get('acts', ())]
    for span in spans[:1]:
        begin, end = span['from_s'], span['until_s']
        when = (f'until {end:.2f} s' if begin is None else f'from {begin:.2f} s on' if end is None
                else f'from {begin:.2f} to {end:.2f} s')
        force = f', with {quantity(span["size"], span["unit"])}' if 'size' in span else ''
        more = f', and {len(spans) - 1} times more' if spans[1:] else ''
        yield f'It acts {when} of {span["test"]}{force}{more}.'


def _effect(verdict: Verdict, effect: str,
            parameters: Mapping[str, Any]) -> tuple[str, Sequence[str]]:
    """Return what is said of an effect, and its next steps."""
    own = {name: item for name, item in parameters.items() if name.startswith(f'{effect}.')}
    if own and effect in verdict.machine.words:
        return verdict.machine.words[effect](own)
    known = verdict.machine.catalogue.get(effect)
    sizes = [f'{name.removeprefix(effect)[1:]} {with_interval(item)}'
             for name, item in list(own.items())[:_LISTED]]
    return (f'the model lacks {effect}' + (f' ({known.cause})' if known and known.cause else '')
            + ': ' * bool(sizes) + ', '.join(sizes)), (
        'inspect what may cause it',
        'diagnose again, together with a recording that was not used here')
