# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A verdict of the diagnosis, read from its JSON and checked."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
import json
import math
from pathlib import Path
from typing import Any, NamedTuple

from simgap.errors import one_line

UNKNOWN, NONE = 'unknown', 'none'
VERDICTS = ('no_gap', 'too_few_to_judge', 'explained', 'partly_explained', 'unknown_effect')
LARGEST_SET = 5             # ids in a confusable set that is still informative
SUM_ERROR = 0.01            # allowed in the sum of the probabilities


class VerdictError(ValueError):
    """A verdict does not have the form of the diagnosis; it counts as a failure."""


class Interval(NamedTuple):
    """A number with its 95 percent interval and unit."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class VerdictLine:
    """One line of 'which': effects that act together, their probability and parameters."""

    effects: frozenset[str]
    probability: float
    parameters: Mapping[str, Interval] = field(default_factory=dict, compare=False)


@dataclass(frozen=True)
class Verdict:
    """The answer of a diagnosis."""

    verdict: str  # one of VERDICTS
    which: tuple[VerdictLine, ...]  # sorted, the most probable first
    confusable: tuple[frozenset[str], ...]  # ids that the data cannot separate
    explained_fraction: float  # nan if not given
    seconds: float  # nan if not given
    held_back: Mapping[str, str] = field(default_factory=dict, compare=False)  # before and after

    def confusable_with(self, effect: str) -> frozenset[str]:
        """
        Return all ids published as confusable with `effect`, itself included.

        All groups that contain it count together. With more than LARGEST_SET ids they are ignored;
        otherwise many small groups could cover every effect.
        """
        together = frozenset([effect]).union(
            *(group for group in self.confusable if effect in group))
        return together if len(together) <= LARGEST_SET else frozenset([effect])

    def means(self, named: frozenset[str], true: frozenset[str]) -> bool:
        """Return whether an entry names the true effects or ones confusable with them."""
        return len(named) == len(true) and any(True for _ in self._matchings(sorted(named), true))

    def _matchings(self, named: list[str], true: frozenset[str]) -> Iterator[None]:
        if not named:
            yield None
            return
        for effect in true & self.confusable_with(named[0]):
            yield from self._matchings(named[1:], true - {effect})

    def confidence(self) -> float:
        """Return the probability of the first entry and of all equivalent ones."""
        first = self.which[0].effects
        return min(1.0, sum(entry.probability for entry in self.which
                            if entry.effects == first or self.means(first, entry.effects)))

    def probability_of(self, answer: str) -> float:
        """Return the probability of UNKNOWN or NONE."""
        return sum(entry.probability for entry in self.which if entry.effects == {answer})


def read_verdict(path: Path) -> Verdict:
    """Read and check a verdict; VerdictError where it is missing, not JSON or not a verdict."""
    try:
        content = json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError, RecursionError) as error:
        raise VerdictError(f'{path}: {one_line(error, 300)}') from error
    try:
        return parse_verdict(content)
    except VerdictError as error:
        raise VerdictError(f'{path}: {one_line(error, 300)}') from None


def parse_verdict(content: Any) -> Verdict:
    """Check the content of a verdict; VerdictError, which names the key, where it is wrong."""
    if not isinstance(content, dict):
        raise VerdictError('not a JSON object')
    if content.get('verdict') not in VERDICTS:
        raise VerdictError(f'verdict: {content.get("verdict")!r}, not one of {VERDICTS}')
    entries = content.get('which')
    if not isinstance(entries, list) or not entries:
        raise VerdictError('which: not a list with entries')
    which = tuple(_entry(entry) for entry in entries)
    probabilities = [entry.probability for entry in which]
    if abs(sum(probabilities) - 1.0) > SUM_ERROR:
        raise VerdictError(f'which: probabilities add up to {sum(probabilities):.3f}, not to 1')
    ranked = tuple(sorted(which, key=lambda entry: -entry.probability))
    groups = content.get('confusable', [])
    if not isinstance(groups, list) or not all(
            isinstance(group, list) and all(isinstance(name, str) for name in group)
            for group in groups):
        raise VerdictError('confusable: not a list of lists of ids')
    how_far = content.get('how_far')
    fraction = how_far.get('explained_fraction') if isinstance(how_far, dict) else None
    value = fraction.get('value') if isinstance(fraction, dict) else fraction
    return Verdict(content['verdict'], ranked, tuple(frozenset(group) for group in groups),
                   _number_or_nan(value), _number_or_nan(content.get('seconds')),
                   _held_back(content.get('held_back')))


def content_of(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict as `parse_verdict` takes it, but for the predictions that it brings."""
    fraction, seconds = (value if math.isfinite(value) else None
                         for value in (verdict.explained_fraction, verdict.seconds))
    return {'verdict': verdict.verdict,
            'which': [{'effects': sorted(line.effects), 'probability': line.probability,
                       'parameters': {name: {'value': item.value, 'ci95': [item.low, item.high],
                                             'unit': item.unit}
                                      for name, item in line.parameters.items()}}
                      for line in verdict.which],
            'confusable': [sorted(group) for group in verdict.confusable],
            'how_far': {'explained_fraction': fraction}, 'seconds': seconds}


def _held_back(content: Any) -> dict[str, str]:
    if content is None:
        return {}
    names = {key: content.get(key) if isinstance(content, dict) else None
             for key in ('before', 'after')}
    # a plain name: what is elsewhere is no part of the verdict
    if not all(isinstance(name, str) and name == Path(name).name for name in names.values()):
        raise VerdictError("held_back: not the file names 'before' and 'after'")
    return {key: str(name) for key, name in names.items()}


def _entry(content: Any) -> VerdictLine:
    if not isinstance(content, dict):
        raise VerdictError('which: an entry is not a JSON object')
    effects, probability = content.get('effects'), content.get('probability')
    if not isinstance(effects, list) or not effects or not all(
            isinstance(name, str) for name in effects):
        raise VerdictError(f'which.effects: {effects!r}, not a list of ids')
    if isinstance(probability, bool) or not isinstance(probability, (int, float)) or not (
            0.0 <= probability <= 1.0):
        raise VerdictError(f'which.probability: {probability!r}, not a number from 0 to 1')
    parameters = content.get('parameters')
    intervals = {name: _interval(value) for name, value in parameters.items()} if isinstance(
        parameters, dict) else {}
    return VerdictLine(frozenset(effects), float(probability), {
        name: interval for name, interval in intervals.items() if interval is not None})


def _interval(content: Any) -> Interval | None:
    """Return a parameter that is stated with its interval, and None if it is not."""
    bounds = content.get('ci95') if isinstance(content, dict) else None
    if not isinstance(bounds, list) or len(bounds) != 2:
        return None
    value, low, high = (_number_or_nan(number) for number in (content.get('value'), *bounds))
    if not all(map(math.isfinite, (value, low, high))):
        return None
    return Interval(value, low, high, str(content.get('unit', '')))


def _number_or_nan(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return math.nan
    try:
        return float(value)
    except OverflowError:       # a whole number of JSON has no limit
        return math.nan
