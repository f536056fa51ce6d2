# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis says: a record for programs, with a few lines for people and the JSON."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from simgap.inputs.plain import strict_json
from simgap.machine.contract import Machine
from simgap.search.hypothesis import Hypothesis
from simgap.verdict.interventions import lines as lines_of_labels
from simgap.verdict.law_fit import LawfulFit
from simgap.verdict.localisation import Located
from simgap.verdict.reproducibility import lines as lines_of_days
from simgap.verdict.sentence import beyond, headline, loud, said
from simgap.verdict.unknown_input import Place

# An effect of more parameters than this is summed up instead of listed.
_LISTED = 12


@dataclass(frozen=True)
class Named:
    """An answer."""

    effects: Sequence[str]  # that it names, ['none'] or ['unknown']
    probability: float  # 0 to 1
    # value, ci95, unit and more of each number of its effects, by name
    parameters: Mapping[str, Any]


@dataclass(frozen=True, repr=False)
class Verdict:
    """What a diagnosis found. docs/diagnosis.md explains each entry of the JSON."""

    word: str  # no_gap, too_few_to_judge, explained, partly_explained or unknown_effect
    where: Sequence[Located]  # shares of the gap by part, signal and regime
    which: Sequence[Named]  # the answers, the likeliest first
    also_seen: Sequence[Mapping[str, Any]]  # effects that show a little
    confusable: Sequence[Sequence[str]]  # groups of effects that cannot be told apart
    how_far: Mapping[str, Any]  # how much of the gap of withheld data the effects explain
    # the least size of each effect that would have shown, if no gap does
    could_hide: Sequence[Mapping[str, Any]]
    remains: Mapping[str, Any]  # what is not explained, by signal
    may_enter_at: Sequence[Place]  # places where an unknown input may act, the likeliest first
    fits: Sequence[Mapping[str, Any]]  # every fit that the verdict was decided on
    planning: Mapping[str, Any]  # what the design of a further test needs
    seconds: float  # of computing
    notes: Sequence[str]  # for people
    # how effects differ between labels; None if they do not
    labels: Sequence[Mapping[str, Any]] | None
    # with the noise of the motion that was found; a `ByLabel` where tests carry labels
    machine: Machine
    none: Hypothesis  # the hypothesis without effects
    best: Hypothesis  # the one with the likeliest effects
    # the numbers of the model: what they are the next time, what differs between days
    reproducibility: Sequence[Mapping[str, Any]] = field(default=(), kw_only=True)
    lawful: LawfulFit | None = field(default=None, kw_only=True)  # the best one with a law

    def __repr__(self) -> str:
        """Return the verdict and its first answer, in a line."""
        first = self.which[0]
        return (f'<Verdict: {self.word}, {" + ".join(first.effects)} '
                f'{100.0 * first.probability:.0f} %>')

    def as_data(self) -> dict[str, Any]:
        """Return the JSON of docs/diagnosis.md as plain data."""
        entries = {item.name: getattr(self, item.name) for item in fields(self)
                   if item.name not in ('word', 'machine', 'none', 'best', 'lawful')}
        return {'verdict': self.word, 'sentence': str(said(self)), **{
            name: entry for name, entry in entries.items() if entry is not None},
            'which': [vars(answer) for answer in self.which],
            'may_enter_at': [asdict(place) for place in self.may_enter_at]}

    def to_json(self) -> str:
        """Return the JSON of docs/diagnosis.md."""
        return strict_json(self.as_data())

    def summary(self) -> str:
        """Return the verdict in a few lines."""
        lines = [f'{headline(self)}: {said(self)}']
        for answer in self.which[:3]:
            if answer.probability >= 0.01:
                lines.append(f'  {100.0 * answer.probability:5.1f} %  '
                             + ' and '.join(answer.effects))
                lines += [f'           {line}' for line in value_lines(answer.parameters)]
        lines += [f'  {line}' for line in _closed(self)]
        lines += [f'  {line}' for line in (*lines_of_labels(self.labels or ()),
                                           *lines_of_days(self.reproducibility))]
        lines += [f'  also seen: {item["effect"]}, {100.0 * item["share"]:.2g} % of the gap'
                  for item in self.also_seen]
        lines += [f'  remains: {line}' for line in _remainders(self.remains)]
        lines += [f'  note: {note}' for note in self.notes]
        return '\n'.join(lines)


def _closed(verdict: Verdict) -> list[str]:
    """Return how much of the gap is closed, and by what."""
    far, known = verdict.how_far, [a.effects for a in verdict.which if a.effects != ['unknown']]
    named = [effect for effect in known[0] if effect != 'none']
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


def _remainders(found: Mapping[str, Any]) -> list[str]:
    """Return what remains of the signals that matter, or of all if nobody said which do."""
    asked = any(item.get('matters') is not None for item in found.values())
    return [f'{signal} {beyond(found[signal])}' + (', which matters' if asked else '')
            for signal in loud(found)]


def share_text(fraction: Mapping[str, Any]) -> str:
    """Return an explained fraction as people read it; an effect may make a gap wider, too."""
    if fraction['value'] < 0.0:
        return 'nothing of the gap: with the effect it is wider'
    low, high = (100.0 * max(bound, 0.0) for bound in fraction['ci95'])
    return f'{100.0 * fraction["value"]:.0f} % of the gap ({low:.0f} to {high:.0f} %)'


def value_lines(parameters: Mapping[str, Any]) -> list[str]:
    """Return the values of an answer's parameters as people read them, a line each."""
    if len(parameters) > _LISTED:
        return [f'{len(parameters)} numbers, see the JSON']
    return [f'{name.split(".", 2)[-1]} = {item["value"]:.4g} '
            + ('' if item['unit'] == '1' else f'{item["unit"]} ')
            + f'({item["ci95"][0]:.4g} to {item["ci95"][1]:.4g})'
            for name, item in parameters.items()]
