# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
From the evidence for hypotheses to probabilities, with 'unknown' and 'none' among the answers.

Probabilities are in proportion to the evidence (`search.evidence`). 'Unknown' is an absolute test:
whether an input of any course over time, at some place of the machine, explains more of what the
best hypothesis leaves than an error of form or of the model would.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
from simgap.machine.everyday import everyday_of
from simgap.search.hypothesis import Hypothesis
from simgap.search.search import Found
from simgap.settings import VerdictSettings
from simgap.verdict.unknown_input import Place


@dataclass(frozen=True)
class Answer:
    """What is named by hypotheses, and how probable they are."""

    hypothesis: Hypothesis  # with these effects alone, or the best that names them
    probability: float  # of all that name the same

    @property
    def effects(self) -> tuple[str, ...]:
        """Return the effects that it names, larger than everyday sizes."""
        return self.hypothesis.named


@dataclass(frozen=True)
class Decision:
    """What a diagnosis concludes."""

    word: str  # no_gap, too_few_to_judge, explained, partly_explained or unknown_effect
    answers: Sequence[Answer]  # the likeliest first, with probabilities
    unknown: float  # probability of something outside the catalogue
    confusable: Sequence[Sequence[str]]  # groups that data cannot tell apart


def decide(found: Found, places: Sequence[Place], gained: float, enough: bool) -> Decision:
    """
    Conclude from a search and what an unknown input would explain.

    gained : evidence for a law beyond that for the best hypothesis; -inf without a law
    enough : whether data suffice
    """
    settings = found.problem.settings.verdict
    unknown = unknown_probability(found, places, gained)
    answers = ranked(found, unknown)
    top = answers[0]
    if unknown > top.probability:
        word = 'unknown_effect'
    elif not top.effects:
        word = 'no_gap' if enough else 'too_few_to_judge'
    else:
        word = 'explained' if unknown < settings.partly else 'partly_explained'
    return Decision(word, answers, unknown, confusable(found))


def ranked(found: Found, unknown: float) -> list[Answer]:
    """Return the hypotheses of a search with their probabilities, the likeliest first."""
    evidence = np.array([found.evidence(h) for h in found.hypotheses])
    weight = np.exp(evidence - evidence.max())
    weight *= (1.0 - unknown) / weight.sum()
    answers: dict[frozenset[str], Answer] = {}
    for h, share in zip(found.hypotheses, weight.tolist(), strict=True):
        known = answers.get(frozenset(h.named))
        # an answer has the fit of what it names and of no more, where there is one
        fit = known.hypothesis if known and set(h.effects) != set(h.named) else h
        answers[frozenset(h.named)] = Answer(fit, share + (known.probability if known else 0.0))
    return sorted(answers.values(), key=lambda answer: -answer.probability)


def unknown_probability(found: Found, places: Sequence[Place], gained: float) -> float:
    """Return the probability that something outside the catalogue is at work."""
    settings = found.problem.settings.verdict
    # of the whole gap, because the form of a named effect errs in proportion to what it does
    explained = max((place.explained for place in places), default=0.0) * (
        0.5 * found.evidence.samples / found.evidence.whole)
    beyond = math.log(max(explained, 1e-9) / settings.left) / settings.left_width
    share = 0.5 * (1.0 + math.tanh(0.5 * max(beyond, gained)))
    return settings.least_unknown + (settings.most_unknown - settings.least_unknown) * share


def confusable(found: Found) -> list[list[str]]:
    """Return groups of effects whose exchange costs hardly more, the likeliest of each first."""
    settings, evidence, top = found.problem.settings.verdict, found.evidence, found.best
    limit = evidence(top) - settings.confusable
    groups: list[list[str]] = []
    for effect in top.effects:
        rest = set(top.effects) - {effect}
        others = [next(iter(set(h.effects) - rest)) for h in found.hypotheses
                  if len(h.effects) == len(top.effects) and rest < set(h.effects)
                  and effect not in h.effects and evidence(h) > limit]
        if names := others[:settings.largest_group - 1]:
            groups.append([effect, *names])
    return groups


def which(decision: Decision, settings: VerdictSettings,
          values: Callable[[Hypothesis], dict[str, Any]] = lambda hypothesis: {},
          ) -> list[dict[str, Any]]:
    """Return the likeliest answers, 'none' and 'unknown' among them, for the JSON."""
    entries: list[dict[str, Any]] = []
    likeliest = set(decision.answers[0].effects)
    for answer in decision.answers:
        # the members of the likeliest pair, and 'none', are listed however improbable they are
        if answer.probability >= settings.least_probability or set(answer.effects) <= likeliest:
            entries.append({'effects': list(answer.effects) or ['none'],
                            'probability': answer.probability,
                            'parameters': {name: value for name, value in values(
                                answer.hypothesis).items()
                                if name in answer.hypothesis.parameters_of(answer.effects)}})
    entries.append({'effects': ['unknown'], 'probability': decision.unknown, 'parameters': {}})
    total = sum(entry['probability'] for entry in entries)
    for entry in entries:
        entry['probability'] /= total
    return sorted(entries, key=lambda entry: -entry['probability'])


def also_seen(found: Found) -> list[dict[str, Any]]:
    """Return effects that show beside what the best names and get no name, for the JSON."""
    named = set(found.best.named)
    fit = next((h for h in found.hypotheses if set(h.effects) == named), None)
    if fit is None:
        return []
    seen = _everyday_sizes(found)
    for h in found.hypotheses:
        if named < set(h.effects) and len(h.effects) == len(named) + 1:
            [extra] = set(h.effects) - named
            seen[extra] = max(seen.get(extra, 0.0), fit.cost - h.cost)
    gap, tempered = found.none.cost - found.best.cost, found.evidence.temperature
    return [{'effect': effect, 'gain': gain / tempered,
             'share': min(gain / gap, 1.0) if gap > 0.0 else 0.0}
            for effect, gain in sorted(seen.items(), key=lambda item: -item[1])
            if gain > found.problem.settings.evidence.shows * tempered]


def _everyday_sizes(found: Found) -> dict[str, float]:
    """Return what each everyday size of the best hypothesis gains [half chi-square], by effect."""
    state = found.best.state
    effects = {p.name: effect.id for effect in found.problem.machine.catalogue.values()
               for form in effect.forms for p in form.sizes}
    gains: dict[str, float] = {}
    for p, value, seen in zip(state.parameters, state.x.tolist(),
                              np.diag(state.hessian).tolist(), strict=True):
        effect = effects.get(everyday_of(p.name))
        if effect:
            gains[effect] = gains.get(effect, 0.0) + 0.5 * value ** 2 * seen
    return gains
