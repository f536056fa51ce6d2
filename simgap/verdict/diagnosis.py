# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The diagnosis of a gap between a machine and its model: where, which effect, how far it shrinks.

It works on any `Machine`; the antenna's is in `machines.antenna`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import time
from typing import Any

from simgap.fit.blas import one_blas_thread
from simgap.fit.noise import found_noise
from simgap.machine.by_label import by_label
from simgap.machine.check import check_machine
from simgap.machine.contract import Machine
from simgap.next_test.confusability import could_hide
from simgap.next_test.rivals import Findings, Rival, rivals_of
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT, Settings
from simgap.verdict import localisation, unknown_input, verdict
from simgap.verdict.conclusion import concluded
from simgap.verdict.intervals import values_with_intervals
from simgap.verdict.interventions import interventions, lines as lines_of_labels
from simgap.verdict.lack_of_fit import remainders, residual_tests

Progress = Callable[[float, str], None]
# An effect of more parameters than this is summed up instead of listed.
_LISTED = 12

_HEADLINES = {
    'no_gap': 'no gap: machine and model agree within tolerance and noise',
    'too_few_to_judge': 'too few samples to judge: no gap shows, and none could',
    'explained': 'explained: one of the known effects closes the gap',
    'partly_explained': 'partly explained: a known effect closes some of the gap',
    'unknown_effect': 'unknown effect: nothing in the catalogue closes the gap',
}


@dataclass(frozen=True)
class Diagnosis:
    """
    What was found.

    Attributes
    ----------
    result : the JSON of docs/diagnosis.md, as plain data
    machine : that was compared, with the noise of the motion that was found; where tests carry
        labels, a `by_label.ByLabel` around it
    none, best : the hypotheses without and with the likeliest effects

    """

    result: dict[str, Any]
    machine: Machine
    none: Hypothesis
    best: Hypothesis

    def __repr__(self) -> str:
        """Return the verdict and its first answer, in a line."""
        first = self.result['which'][0]
        return (f'<Diagnosis: {self.result["verdict"]}, {" + ".join(first["effects"])} '
                f'{100.0 * first["probability"]:.0f} %>')

    def summary(self) -> str:
        """Return the verdict in a few lines."""
        result = self.result
        lines = [_HEADLINES[result['verdict']]]
        for entry in result['which'][:3]:
            if entry['probability'] >= 0.01:
                names = ' and '.join(entry['effects'])
                lines.append(f'  {100.0 * entry["probability"]:5.1f} %  {names}')
                lines += [f'           {line}' for line in value_lines(entry['parameters'])]
        for group in result['confusable']:
            lines.append('  these data cannot tell apart: ' + ', '.join(group))
        if result['may_enter_at']:
            place = result['may_enter_at'][0]
            lines.append(f'  what is not named most likely enters as {place["name"]}, which could '
                         f'explain {100.0 * place["explained"]:.0f} % of the gap')
        lines += [f'  {line}' for line in _closed(result)]
        lines += [f'  {line}' for line in lines_of_labels(result.get('labels', ()))]
        lines += [f'  also seen: {item["effect"]}, {_why_small(item)}'
                  for item in result['also_seen']]
        lines += [f'  remains: {line}' for line in _remainders(result['remains'])]
        lines += [f'  note: {note}' for note in result['notes']]
        return '\n'.join(lines)


def _closed(result: Mapping[str, Any]) -> list[str]:
    """Return how much of the gap is closed, and by what."""
    far, named = result['how_far'], result['statements']['named']['best_of_catalogue']
    judged = [effect for effect in named if effect in far['judged']]
    fraction = far['explained_fraction']
    if named and fraction['value'] is None:
        return [_cannot_be_judged(' and '.join(named), fraction['reason'])] if fraction.get(
            'reason') else []
    lines = [f'{" and ".join(judged)} {"explain" if judged[1:] else "explains"} '
             f'{share_text(fraction)}, judged on {far["held_out"]}'] if judged else []
    return lines + [_cannot_be_judged(effect, far['cannot_be_judged'][effect])
                    for effect in named if effect not in far['judged']]


def _cannot_be_judged(effects: str, reason: str) -> str:
    return f'how much of the gap {effects} explains cannot be judged on withheld data: {reason}'


def _why_small(item: Mapping[str, Any]) -> str:
    if item['unsure']:
        return 'not surely beyond its tolerance'
    if item['within_tolerance']:
        return 'within its tolerance'
    return f'explains {100.0 * item["share"]:.2g} % of the gap'


def _remainders(found: Mapping[str, Any]) -> list[str]:
    """Return what remains of the signals that matter, or of all if nobody said which do."""
    asked = any(item.get('matters') is not None for item in found.values())
    return [f'{signal} {item["beyond_noise"]:.2g} {item["unit"]} beyond noise of '
            f'{item["noise"]:.2g} {item["unit"]}' + (', which matters' if asked else '')
            for signal, item in found.items() if 'rms' in item
            and (item['matters'] if asked else item['beyond_noise'] > item['noise'])]


def share_text(fraction: Mapping[str, Any]) -> str:
    """Return an explained fraction as people read it; an effect may make a gap wider, too."""
    if fraction['value'] < 0.0:
        return 'nothing of the gap: with the effect it is wider'
    low, high = (100.0 * max(bound, 0.0) for bound in fraction['ci95'])
    return f'{100.0 * fraction["value"]:.0f} % of the gap ({low:.0f} to {high:.0f} %)'


def value_lines(parameters: Mapping[str, Any]) -> list[str]:
    """Return the values of an answer's parameters as people read them, a line each."""
    if len(parameters) > _LISTED:
        return [f'{len(parameters)} numbers over time, see the JSON']
    return [f'{name.split(".", 2)[-1]} = {item["value"]:.4g} '
            + ('' if item['unit'] == '1' else f'{item["unit"]} ')
            + f'({item["ci95"][0]:.4g} to {item["ci95"][1]:.4g})'
            for name, item in parameters.items()]


def diagnose(machine: Machine, progress: Progress = lambda share, doing: None, threads: int = 2,
             settings: Settings = DEFAULT, limits: Mapping[str, float] | None = None,
             earlier: Sequence[Rival] = ()) -> Diagnosis:
    """
    Diagnose a machine in its experiments.

    Parameters
    ----------
    machine
        see `Machine`
    progress
        called with the share that is done, 0 to 1, and what is being done
    threads
        how many hypotheses are fitted at once
    settings
        thresholds
    limits
        for some signals, the remainder beyond noise from which it matters, in the signal's unit
    earlier
        answers of a verdict on some of the tests: they are fitted to all from where they have
        ended, beside what the search finds. One whose effects the machine does not know is left
        out

    Raises
    ------
    MachineError : the machine breaks its contract; the message says where

    """
    with one_blas_thread():
        check_machine(machine)
        return _diagnose(by_label(machine), progress, threads, settings, limits or {}, earlier)


def _diagnose(machine: Machine, progress: Progress, threads: int, settings: Settings,
              limits: Mapping[str, float], earlier: Sequence[Rival]) -> Diagnosis:
    began = time.monotonic()
    found = concluded(machine, progress, threads, settings, earlier)
    problem, none, best, decision = found.problem, found.none, found.best, found.decision
    places: Sequence[unknown_input.Place] = ()
    located: Sequence[localisation.Located] = ()
    parts: Mapping[str, float] = {}
    if decision.word == 'unknown_effect' or decision.unknown >= settings.verdict.partly:
        progress(0.95, 'where an unknown input may act')
        parts, places = localisation.parts_of_the_unknown(problem, none.state, decision.lack)
    if decision.word == 'unknown_effect':
        located = localisation.of_the_unknown(problem, none.state, parts)
    elif decision.word in ('explained', 'partly_explained'):
        located = localisation.of_effects(problem, decision.answers, none.state, best.state)
    else:
        # a verdict without a gap names no place; the next test still looks into these parts
        places = ()
    findings = Findings(
        rivals_of(problem, decision.answers, found.evidence.inflation, settings.planning,
                  found.doubted), found.evidence.inflation, found_noise(problem.experiments),
        unnamed={part: decision.unknown * share for part, share in parts.items()
                 if share >= settings.localisation.least_share})
    healthy = decision.word == 'no_gap'
    hidden = could_hide(problem, (none if healthy else best).state, findings.inflated) if (
        healthy or not findings.are_open(settings)) else []
    result = {
        'verdict': decision.word,
        'statements': verdict.statements(decision, best),
        'where': list(located),
        'which': verdict.which(decision, settings.verdict, lambda answer: values_with_intervals(
            answer, found.deviating(answer))),
        'also_seen': verdict.also_seen(
            found.evidence.hypotheses, settings, found.evidence.inflation),
        'confusable': decision.confusable,
        'how_far': found.reach,
        'could_hide': hidden if healthy else [],
        'remains': remainders(problem, best.state, limits),
        'residual_tests': residual_tests(problem, best.state, decision.lack),
        'may_enter_at': [vars(place) for place in places if place.evidence > 0.0],
        'fits': found.evidence.as_data(),
        'planning': {
            **machine.planning,
            **replace(findings, shown={item['effect']: item['size'] for item in hidden
                                       if item['size'] is not None}).as_data()},
        'seconds': time.monotonic() - began,
        'notes': [*machine.notes, *found.notes],
    }
    if labels := interventions(problem, none, best, threads):
        result['labels'] = labels
    progress(1.0, 'done')
    return Diagnosis(result, problem.machine, none, best)
