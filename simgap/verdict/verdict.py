# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""From fitted hypotheses to probabilities, with 'unknown' and 'none' among the answers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np
from simgap.search.hypothesis import Hypothesis
from simgap.settings import Settings, VerdictSettings


@dataclass(frozen=True)
class LackOfFit:
    """What a hypothesis leaves unexplained."""

    slow_excess: float  # power of the slow residual over that of white noise, less one
    left: float  # share of the gap, 0 to 1
    fast: float = 1.0  # variance of the loudest signal's fast part, over that of noise
    fast_left: float = 1.0  # share of that fast part that was there without any effect
    implausibility: float = 0.0  # of the effects' values, see `Form.implausibility`
    explained: float | None = None  # upper end for withheld data; None without effects
    loudest: str = ''  # signal whose fast part is the loudest
    enough: bool = True  # False if no signal has samples enough
    named: bool = True  # False if it names nothing that could have closed the gap
    regular: float = 0.0  # greatest autocorrelation, less if it is quieter than noise
    most_regular: str = ''  # signal that it is of


@dataclass(frozen=True)
class Answer:
    """What hypotheses that may name the same effects say."""

    hypothesis: Hypothesis  # with these effects alone, or else the best that may name them
    score: float  # of the hypothesis
    probability: float  # of all of them
    effects: tuple[str, ...]  # those named, larger than their tolerances


@dataclass(frozen=True)
class Decision:
    """What a diagnosis concludes."""

    word: str  # no_gap, too_few_to_judge, explained, partly_explained or unknown_effect
    answers: Sequence[Answer]  # the likeliest first, with probabilities
    unknown: float  # probability of something outside the catalogue
    lack: LackOfFit  # what the best hypothesis leaves
    confusable: Sequence[Sequence[str]]  # groups that data cannot tell apart


def decide(hypotheses: Sequence[Hypothesis], lack: LackOfFit, settings: Settings,
           inflation: float = 1.0) -> Decision:
    """Conclude from hypotheses, the nuisances alone among them, and what the best one leaves."""
    unknown = unknown_probability(lack, settings.verdict)
    answers = rank(hypotheses, unknown, settings, inflation)
    named = best(hypotheses, settings, inflation).named
    top = answers[0]
    if unknown > top.probability:
        word = 'unknown_effect'
    elif not top.effects:
        word = 'no_gap' if lack.enough else 'too_few_to_judge'
    else:
        word = 'explained' if unknown < settings.verdict.partly else 'partly_explained'
    return Decision(word, answers, unknown, lack,
                    confusable(hypotheses, settings, inflation) if named else [])


def which(decision: Decision, settings: VerdictSettings,
          values: Callable[[Hypothesis], dict[str, Any]] = lambda hypothesis: {},
          ) -> list[dict[str, Any]]:
    """Return the likeliest answers, 'none' and 'unknown' among them, for the JSON."""
    entries: list[dict[str, Any]] = []
    likeliest = set(decision.answers[0].effects)
    for answer in decision.answers[:settings.entries]:
        effects = answer.effects
        # the members of the likeliest pair, and 'none', are listed however improbable they are
        if answer.probability >= settings.least_probability or set(effects) <= likeliest:
            entries.append({'effects': list(effects) or ['none'],
                            'probability': answer.probability,
                            'parameters': {
                                name: value for name, value in values(answer.hypothesis).items()
                                if name in answer.hypothesis.parameters_of(effects)}})
    if ['none'] not in [entry['effects'] for entry in entries]:
        share = next(a.probability for a in decision.answers if not a.effects)
        entries.append({'effects': ['none'], 'probability': share, 'parameters': {}})
    entries.append({'effects': ['unknown'], 'probability': decision.unknown, 'parameters': {}})
    total = sum(entry['probability'] for entry in entries)
    for entry in entries:
        entry['probability'] /= total
    return sorted(entries, key=lambda entry: -entry['probability'])


def statements(decision: Decision, best_hypothesis: Hypothesis) -> dict[str, Any]:
    """Return what is named beside its runner-up, for the JSON."""
    known = [(list(answer.effects) or ['none'], answer.probability) for answer in decision.answers]
    first, second, *_ = [*sorted([*known, (['unknown'], decision.unknown)],
                                 key=lambda item: -item[1]), ([], 0.0)]
    return {'named': {
        'effects': first[0], 'probability': first[1],
        'runner_up': {'effects': second[0], 'probability': second[1]},
        'best_of_catalogue': list(best_hypothesis.named)}}


class _Scores:
    """The scores of hypotheses, which depend on what the others gain."""

    def __init__(self, hypotheses: Sequence[Hypothesis], settings: Settings,
                 inflation: float) -> None:
        self._none = none = min(h.cost for h in hypotheses if not h.effects)
        single = min((h.cost for h in hypotheses if len(h.effects) == 1), default=none)
        self._first_gain = max(none - single, 0.0) / inflation
        self._settings = settings
        self._inflation = inflation

    def __call__(self, hypothesis: Hypothesis) -> float:
        settings = self._settings.verdict
        count = len(hypothesis.effects)
        total = hypothesis.penalised(self._settings.penalty) - hypothesis.cost
        total += self._none + (hypothesis.cost - self._none) / self._inflation
        if count > 1:
            # a second effect must do more than mend the form of the first; the same effect in
            # a second place has the same form and mends nothing
            twins = len({effect.partition('.')[2] for effect in hypothesis.effects}) < count
            share = settings.twin_share if twins else settings.second_share
            total += (count - 1) * (settings.second_effect + share * self._first_gain)
        return total


def also_seen(hypotheses: Sequence[Hypothesis], settings: Settings,
              inflation: float = 1.0) -> list[dict[str, Any]]:
    """Return effects that show and are not worth a name, the greatest gain first, for the JSON."""
    # each is within its tolerance, or explains a small share of the gap beside what is named
    top = best(hypotheses, settings, inflation)
    gap = max(h.cost for h in hypotheses if not h.effects) - top.cost
    found: dict[str, dict[str, Any]] = {}
    for hypothesis in hypotheses:
        extra = set(hypothesis.effects) - set(top.named)
        if len(extra) != 1 or not set(top.named) < set(hypothesis.effects):
            continue
        effect = extra.pop()
        without = min((h.cost for h in hypotheses if set(h.effects) == set(top.named)),
                      default=None)
        if without is None:
            continue  # nothing tells what the effect gains beside those that are named
        gain = (without - hypothesis.cost) / inflation
        if not top.named and effect in hypothesis.named:
            continue  # a rival of an effect that is not sure is no surer
        if gain > settings.penalty.effect and gain > found.get(effect, {}).get('gain', 0.0):
            found[effect] = {'effect': effect, 'gain': gain,
                             'share': min(inflation * gain / gap, 1.0) if gap > 0.0 else 0.0,
                             'within_tolerance': effect not in hypothesis.named,
                             'unsure': effect in hypothesis.unsure}
    return sorted(found.values(), key=lambda item: -float(item['gain']))


def unknown_probability(lack: LackOfFit, settings: VerdictSettings) -> float:
    """Return the probability that something outside the catalogue is at work."""
    def logit(value: float, tipping: float, slope: float) -> float:
        return slope * math.log(max(value / tipping, 1e-3))

    # an effect of another form than the true one leaves little; no effect has no such excuse
    left = logit(lack.left, settings.left, settings.left_slope)
    slow = _logistic(logit(lack.slow_excess, settings.slow, settings.slow_slope)
                     + (left if lack.named else 0.0))
    # what such a form leaves repeats itself with the motion, and counts by its share only
    regular = (_logistic(logit(lack.regular, settings.regular, settings.regular_slope))
               * (_logistic(left) if lack.named else 1.0))
    # a sensor may be noisier than its sheet says; but noise does not shrink with an effect.
    # Without an effect it is a fitted zero or delay that makes a residual less loud.
    fast = (_logistic(logit(lack.fast, settings.fast, settings.fast_slope))
            * (_logistic(logit(lack.fast_left, settings.fast_left, settings.fast_left_slope))
               if lack.named else 1.0))
    implausible = _logistic(logit(lack.implausibility, 1.0, settings.implausible_slope))
    # an effect that leaves only noise has not failed on withheld data: the training data may
    # not have determined its values
    failed = 0.0 if lack.explained is None else _logistic(
        settings.held_out_slope * (settings.held_out - lack.explained)) * _logistic(
        logit(lack.slow_excess, settings.noise_only, settings.noise_only_slope))
    passed = (1.0 - slow) * (1.0 - fast) * (1.0 - regular) * (1.0 - implausible) * (1.0 - failed)
    return settings.most_unknown - (settings.most_unknown - settings.least_unknown) * passed


def _logistic(logit: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(max(logit, -8.0), 8.0)))


def rank(hypotheses: Sequence[Hypothesis], unknown: float, settings: Settings,
         inflation: float = 1.0) -> list[Answer]:
    """Return what the hypotheses may name, the likeliest first, with probabilities."""
    # A hypothesis whose effects are in doubt gives some of its probability to fewer of them.
    score = _Scores(hypotheses, settings, inflation)
    scores = np.array([score(h) for h in hypotheses])
    weight = np.exp(-(scores - scores.min()) / settings.verdict.temperature)
    weight *= (1.0 - unknown) / weight.sum()
    order = np.argsort(scores, kind='stable')
    # an answer has the fit of what it names and of no more, where there is one
    own = {frozenset(hypotheses[i].effects): i for i in reversed(order)}
    found: dict[frozenset[str], Answer] = {}
    for i in order:
        for names, chance in hypotheses[i].may_name():
            key = frozenset(names)
            fit = own.get(key, i)
            answer = found.get(key, Answer(hypotheses[fit], float(scores[fit]), 0.0, names))
            found[key] = replace(
                answer, probability=answer.probability + float(weight[i]) * chance)
    return sorted(found.values(), key=lambda answer: -answer.probability)


def best(hypotheses: Sequence[Hypothesis], settings: Settings,
         inflation: float = 1.0) -> Hypothesis:
    """Return the hypothesis with the least score."""
    return min(hypotheses, key=_Scores(hypotheses, settings, inflation))


def confusable(hypotheses: Sequence[Hypothesis], settings: Settings,
               inflation: float = 1.0) -> list[list[str]]:
    """Return groups of effects whose exchange costs hardly more, the likeliest of each first."""
    score = _Scores(hypotheses, settings, inflation)
    top = min(hypotheses, key=score)
    limit = score(top) + settings.verdict.confusable
    groups: list[list[str]] = []
    for effect in top.named:
        rest = set(top.effects) - {effect}
        others = sorted((score(h), next(iter(set(h.effects) - rest)))
                        for h in hypotheses
                        if len(h.effects) == len(top.effects) and rest < set(h.effects)
                        and effect not in h.effects and score(h) < limit)
        names = list(dict.fromkeys(name for _, name in others))
        names = names[:settings.verdict.largest_group - 1]
        if names:
            groups.append([effect, *names])
    return groups
