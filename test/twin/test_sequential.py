# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The rule for a verdict that grows, where the exact probabilities are known."""

from antenna_drive.twin.sequential import decided, Look, Rule
import numpy as np
import pytest

EFFECTS = ('a', 'b', 'c', 'd')
LOOKS = 80
# Before any data, half of the machines are healthy; the others have one of four effects.
PRIOR = np.array([0.5, *[0.125] * 4])
SHIFT = 0.45


def looks_of(truth: int, random: np.random.Generator) -> list[Look]:
    """Return a look after each sample: exact probabilities of five Gaussian hypotheses."""
    data = random.standard_normal((LOOKS, len(EFFECTS)))
    if truth:
        data[:, truth - 1] += SHIFT
    gain = np.cumsum(SHIFT * data - 0.5 * SHIFT**2, axis=0)
    logs = np.log(PRIOR) + np.column_stack([np.zeros(LOOKS), gain])
    weights = np.exp(logs - logs.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    names = [('none',), *((effect,) for effect in EFFECTS)]
    return [Look(float(k + 1), 2, dict(zip(names, row.tolist(), strict=True)))
            for k, row in enumerate(weights)]


def stopped(looks: list[Look], rule: Rule) -> Look | None:
    """Return the look at which the rule stops; None if it never does."""
    return next((look for k, look in enumerate(looks)
                 if decided(looks[max(0, k - 1):k + 1], rule)), None)


def test_looking_at_every_sample_raises_no_false_alarms() -> None:
    random, rule, n = np.random.default_rng(5), Rule(), 400
    wrong = naive = 0
    for _ in range(n):
        looks = looks_of(0, random)
        end = stopped(looks, rule)
        wrong += end is not None and end.first != ('none',)
        # what the rule is there for: the first time that some gap is likelier than no gap
        naive += any(look.first != ('none',) for look in looks)
    assert wrong / n <= rule.false_alarm
    assert naive / n > 2.0 * rule.false_alarm


def test_odds_of_a_gap_exceed_their_bound_no_more_often_than_ville_says() -> None:
    random, n = np.random.default_rng(6), 400
    peaks = [max(look.evidence for look in looks_of(0, random)) for _ in range(n)]
    for alpha in (0.5, 0.2, 0.05):
        spread = (alpha * (1.0 - alpha) / n)**0.5
        assert np.mean(np.array(peaks) >= 1.0 / alpha) <= alpha + 3.0 * spread


def test_stopped_answers_are_as_often_wrong_as_stated() -> None:
    random, rule, n = np.random.default_rng(7), Rule(), 300
    errors = seconds = ended = 0.0
    for truth in random.choice(len(PRIOR), n, p=PRIOR):
        end = stopped(looks_of(int(truth), random), rule)
        if end is not None:
            ended += 1
            seconds += end.seconds
            errors += end.first != (('none',) if truth == 0 else (EFFECTS[truth - 1],))
    assert ended > 0.9 * n
    assert errors / ended <= rule.error
    assert seconds / ended < 0.7 * LOOKS, 'it stops early where it can'


@pytest.mark.parametrize(('probabilities', 'confusable', 'confidence'), [
    ({('a',): 0.6, ('b',): 0.35, ('none',): 0.05}, (), 0.6),
    ({('a',): 0.6, ('b',): 0.35, ('none',): 0.05}, ({'a', 'b'},), 0.95),
    ({('a', 'c'): 0.6, ('b', 'c'): 0.3, ('a',): 0.1}, ({'a', 'b'},), 0.9),
    ({('none',): 0.7, ('a',): 0.3}, ({'a', 'none'},), 0.7),
])
def test_confusable_effects_count_together(
        probabilities: dict[tuple[str, ...], float], confusable: tuple[set[str], ...],
        confidence: float) -> None:
    look = Look(1.0, 1, probabilities, tuple(map(frozenset, confusable)))
    assert look.confidence == pytest.approx(confidence)


def test_an_answer_has_to_last() -> None:
    sure = Look(20.0, 2, {('a',): 0.95, ('none',): 0.01, ('b',): 0.04})
    other = Look(15.0, 2, {('b',): 0.95, ('none',): 0.01, ('a',): 0.04})
    assert not decided([sure], Rule())
    assert not decided([other, sure], Rule())
    assert decided([other, sure, sure], Rule())


@pytest.mark.parametrize('answer', [('a',), ('none',)])
def test_an_answer_has_to_last_in_a_second_test(answer: tuple[str, ...]) -> None:
    first, second = (Look(seconds, tests, {answer: 0.95, ('b',): 0.05})
                     for seconds, tests in ((30.0, 1), (45.0, 2)))
    assert not decided([first, first], Rule())
    assert decided([first, first, second], Rule())
    assert decided([first, first], Rule(tests=1))
