# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The scorecard of a trial, computed from truths and verdicts alone.

lab/notebook/trial.md defines each figure. A case without a valid verdict counts as wrong.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any, NamedTuple

from lab.antenna.cases import Truth
from lab.antenna.wild_programme import KEPT_BACK
from lab.trials import sealing
from lab.trials.batch import FAILURE, KEPT, VERDICT
from lab.trials.held_back import closed_fraction, PredictionError
from lab.trials.sizes import stated_sizes, StatedSize
from lab.trials.verdict import NONE, read_verdict, UNKNOWN, Verdict, VerdictError
import numpy as np

FIRST_FEW = 3
# Rates at the head of the scorecard.
HEADLINES = ('top1', 'top3', 'within_set', 'pairs_both', 'no_gap_on_none')
OVERCONFIDENT = 0.9
BINS = 10
SIZES = ('small', 'middle', 'large')
SCORED_SINGLE, SCORED_PAIR = 'single', 'pair'
HEALTHY_AT_SITE = 0.9       # share of the machines for which the figures of a site hold


@dataclass(frozen=True)
class Case:
    """A truth with its verdict."""

    truth: Truth
    verdict: Verdict | None     # None if the diagnosis failed
    closed: float = math.nan    # fraction of the gap on the recording kept back; or nan

    @property
    def kind(self) -> str:
        """Return 'single', 'pair', 'none' or 'outside'."""
        return str(self.truth['kind'])

    @property
    def machine(self) -> str:
        """Return 'antenna', or the name of another machine."""
        return str(self.truth.get('machine', 'antenna'))

    @property
    def wild(self) -> bool:
        """Return whether this antenna has faults that no sheet lists; others always have."""
        return 'family' in self.truth

    @property
    def effects(self) -> frozenset[str]:
        """Return the right answer: the effects, UNKNOWN outside the catalogue, or NONE."""
        if self.kind == 'outside':
            return frozenset([UNKNOWN])
        return frozenset(entry['id'] for entry in self.truth['effects']) or frozenset([NONE])

    @property
    def label(self) -> str:
        """Return the truth as text: its ids, or 'none'."""
        return ' + '.join(entry['id'] for entry in self.truth['effects']) or NONE

    @property
    def size(self) -> str:
        """Return the third of its range in which the smallest effect lies, one of SIZES."""
        smallest = min((entry['size'] for entry in self.truth['effects']), default=0.0)
        return SIZES[min(int(smallest * len(SIZES)), len(SIZES) - 1)]

    def named_among(self, first: int, *, exactly: bool = False) -> bool:
        """Return whether one of the first entries names the truth or its confusable set."""
        if self.verdict is None:
            return False
        return any(entry.effects == self.effects if exactly
                   else self.verdict.means(entry.effects, self.effects)
                   for entry in self.verdict.which[:first])

    @property
    def within_set(self) -> bool:
        """Return whether the first entry and its confusable sets contain the whole truth."""
        if self.verdict is None:
            return False
        held: frozenset[str] = frozenset().union(*(
            self.verdict.confusable_with(name) for name in self.verdict.which[0].effects))
        return self.effects <= held

    @property
    def alarmed(self) -> bool:
        """Return whether a verdict says that there is a gap."""
        return self.verdict is not None and self.verdict.verdict != 'no_gap'

    @property
    def probability_of_truth(self) -> float:
        """Return the probability of all entries that name the truth; 0 without a verdict."""
        if self.verdict is None:
            return 0.0
        return min(1.0, sum(entry.probability for entry in self.verdict.which
                            if self.verdict.means(entry.effects, self.effects)))

    @property
    def sizes(self) -> list[StatedSize]:
        """Return the sizes that the first entry states of true effects."""
        return [] if self.verdict is None else stated_sizes(self.truth, self.verdict)

    @property
    def right(self) -> bool:
        """Return whether the first entry names the truth or its confusable set."""
        return self.named_among(1)


def read_cases(folder: Path) -> tuple[list[Case], list[Truth]]:
    """
    Return the diagnosed cases of a trial and the truths of the others, checking every seal.

    Raise SealError where a truth is missing or was changed.
    """
    manifest = sealing.read_manifest(folder)
    cases: list[Case] = []
    pending: list[Truth] = []
    for name in manifest['seals']:
        truth = sealing.open_truth(folder, name, manifest)
        place = folder / name
        if (place / VERDICT).exists():
            try:
                verdict = read_verdict(place / VERDICT)
                cases.append(Case(truth, verdict, _closed(folder, truth, verdict)))
            except (VerdictError, PredictionError):
                cases.append(Case(truth, None))
        elif (place / FAILURE).exists():
            cases.append(Case(truth, None))
        else:
            pending.append(truth)
    return cases, pending


def _closed(folder: Path, truth: Truth, verdict: Verdict) -> float:
    """Return what is closed on the recording that was kept back; nan if it is not predicted."""
    recording = folder / KEPT / truth['case'] / f'{KEPT_BACK}.csv'
    if not verdict.held_back or not recording.exists():
        return math.nan
    before, after = (folder / truth['case'] / name for name in verdict.held_back.values())
    return closed_fraction(recording, before, after, truth)


class Rate(NamedTuple):
    """A share with its 95 percent interval (Wilson) and the number of cases."""

    value: float
    low: float
    high: float
    cases: int


def rate(outcomes: Iterable[bool]) -> Rate:
    """Return the share of true outcomes; nan if there are no outcomes."""
    values = list(outcomes)
    count = len(values)
    if not count:
        return Rate(math.nan, math.nan, math.nan, 0)
    share, z = sum(values) / count, 1.959964
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(
        share * (1 - share) / count + z * z / (4 * count * count))
    return Rate(share, max(0.0, middle - half), min(1.0, middle + half), count)


def auroc(positive: Sequence[float], negative: Sequence[float]) -> float:
    """Return the share of pairs whose positive scores higher, ties half; nan if one is empty."""
    if not positive or not negative:
        return math.nan
    first, second = np.asarray(positive)[:, None], np.asarray(negative)[None, :]
    return float(np.mean((first > second) + 0.5 * (first == second)))


class Bin(NamedTuple):
    """One bar of the reliability diagram."""

    low: float
    high: float
    cases: int
    confidence: float       # mean, nan if empty
    accuracy: float         # nan if empty


def reliability(confidences: Sequence[float], right: Sequence[bool]) -> list[Bin]:
    """Return the bins of the reliability diagram, of equal width from 0 to 1."""
    place = [min(int(c * BINS), BINS - 1) for c in confidences]
    bins = []
    for k in range(BINS):
        inside = [i for i, p in enumerate(place) if p == k]
        bins.append(Bin(k / BINS, (k + 1) / BINS, len(inside),
                        _mean(confidences[i] for i in inside), _mean(right[i] for i in inside)))
    return bins


def site(cases: Sequence[Case]) -> dict[str, float]:
    """Return the figures for a site where HEALTHY_AT_SITE are healthy; nan without both kinds."""
    healthy = [case for case in cases if case.kind == 'none']
    faulty = [case for case in cases if case.kind != 'none']
    groups = [(group, weight / len(group)) for group, weight in (
        (healthy, HEALTHY_AT_SITE), (faulty, 1.0 - HEALTHY_AT_SITE)) if group]

    def share(part: Callable[[Case], bool], of: Callable[[Case], bool] = lambda case: True
              ) -> float:
        total = sum(weight * sum(map(of, group)) for group, weight in groups)
        chosen = sum(weight * sum(of(case) and part(case) for case in group)
                     for group, weight in groups)
        return chosen / total if total and len(groups) == 2 else math.nan

    return {'healthy': HEALTHY_AT_SITE, 'right': share(lambda case: case.right),
            'alarms': share(lambda case: case.alarmed),
            'alarms_true': share(lambda case: case.kind != 'none', lambda case: case.alarmed),
            'named_right': share(lambda case: case.right, _names_an_effect)}


def _names_an_effect(case: Case) -> bool:
    return case.verdict is not None and not case.verdict.which[0].effects & {UNKNOWN, NONE}


def calibration_error(bins: Sequence[Bin]) -> float:
    """Return the expected calibration error; nan if there are no cases."""
    total = sum(b.cases for b in bins)
    if not total:
        return math.nan
    return sum(b.cases * abs(b.accuracy - b.confidence) for b in bins if b.cases) / total


def _median(values: Iterable[float]) -> float:
    finite = [value for value in values if math.isfinite(value)]
    return float(np.median(finite)) if finite else math.nan


def _mean(values: Iterable[float]) -> float:
    known = list(values)
    return sum(known) / len(known) if known else math.nan


def case_reliability(cases: Sequence[Case]) -> list[Bin]:
    """Return the reliability diagram of the cases that have a verdict."""
    answered = [case for case in cases if case.verdict is not None]
    return reliability([case.verdict.confidence() for case in answered if case.verdict],
                       [case.right for case in answered])


def _overconfident(case: Case) -> bool:
    if case.verdict is None:
        return False
    return any(entry.probability > OVERCONFIDENT and not entry.effects & {UNKNOWN, NONE}
               for entry in case.verdict.which)


def _unknown(cases: Iterable[Case]) -> list[float]:
    return [case.verdict.probability_of(UNKNOWN) for case in cases if case.verdict]


def confusion(cases: Sequence[Case]) -> dict[str, dict[str, int]]:
    """Return the number of cases by truth and first entry, without pairs."""
    table: dict[str, dict[str, int]] = {}
    for case in cases:
        if case.kind == SCORED_PAIR:
            continue
        answer = 'failure'
        if case.verdict:
            answer = ' + '.join(sorted(case.verdict.which[0].effects))
        row = table.setdefault(case.label, {})
        row[answer] = row.get(answer, 0) + 1
    return table


def score(cases: Sequence[Case], pending: int = 0) -> dict[str, Any]:
    """Return the figures of lab/notebook/trial.md by name, nan where there are no cases."""
    by_kind = {kind: [case for case in cases if case.kind == kind]
               for kind in (SCORED_SINGLE, SCORED_PAIR, 'none', 'outside')}
    singles, pairs = by_kind[SCORED_SINGLE], by_kind[SCORED_PAIR]
    outside = by_kind['outside']
    known = [case for case in cases if case.kind != 'outside']
    sizes = [size for case in (*singles, *pairs) for size in case.sizes]
    rates = _rates(cases, by_kind, sizes)
    return {
        'cases': len(cases),
        'all_wild': bool(cases) and all(case.wild for case in cases),
        'failures': sum(case.verdict is None for case in cases),
        **{name: rates[name].value for name in HEADLINES},
        'auroc_unknown': auroc(_unknown(outside), _unknown(known)),
        'overconfident_outside': rates['overconfident_outside'].value,
        'ece': calibration_error(case_reliability(cases)),
        'explained_fraction_median': _median(
            case.verdict.explained_fraction for case in (*singles, *pairs)
            if case.verdict and case.right),
        'seconds_median': _median(case.verdict.seconds for case in cases if case.verdict),
        'pending': pending,
        **{name: value.value for name, value in rates.items() if name not in HEADLINES},
        'true_probability_mean': _mean(
            case.probability_of_truth for case in (*singles, *pairs)),
        'sizes_compared': len(sizes),
        'size_error_median': _median(size.relative_error for size in sizes),
        'closed_held_back_median': _median(case.closed for case in (*singles, *pairs)),
        'site': site(cases),
        'ci95': {name: [value.low, value.high] for name, value in rates.items()},
        'by_kind': {kind: _summary(group) for kind, group in by_kind.items()},
        'by_size': {size: _summary([case for case in singles if case.size == size])
                    for size in SIZES},
        'by_machine': {name: _summary([case for case in cases if case.machine == name])
                       for name in sorted({case.machine for case in cases})},
        'by_effect': {label: _summary([case for case in (*singles, *outside)
                                       if case.label == label])
                      for label in sorted({case.label for case in (*singles, *outside)})},
        'confusion': confusion(cases),
        'reliability': [b._asdict() for b in case_reliability(cases)]}


def _rates(cases: Sequence[Case], by_kind: Mapping[str, Sequence[Case]],
           sizes: Sequence[StatedSize]) -> dict[str, Rate]:
    singles, pairs = by_kind[SCORED_SINGLE], by_kind[SCORED_PAIR]
    return {
        'top1': rate(case.right for case in singles),
        'top3': rate(case.named_among(FIRST_FEW) for case in singles),
        'within_set': rate(case.within_set for case in singles),
        'pairs_both': rate(case.right for case in pairs),
        'no_gap_on_none': rate(
            case.verdict is not None and case.verdict.verdict == 'no_gap'
            for case in by_kind['none']),
        'top1_exact': rate(case.named_among(1, exactly=True) for case in singles),
        'top3_exact': rate(case.named_among(FIRST_FEW, exactly=True) for case in singles),
        'pairs_one': rate(_one_named(case) for case in pairs),
        'overconfident_outside': rate(_overconfident(case) for case in by_kind['outside']),
        'detection_rate': rate(case.alarmed for case in cases if case.kind != 'none'),
        'false_alarm_rate': rate(
            case.verdict is None or case.alarmed for case in by_kind['none']),
        'size_coverage': rate(size.covered for size in sizes)}


def _one_named(case: Case) -> bool:
    """Return whether the first entry of a pair's verdict names at least one of the two."""
    if case.verdict is None:
        return False
    return any(case.verdict.confusable_with(name) & case.effects
               for name in case.verdict.which[0].effects)


def _summary(cases: Sequence[Case]) -> dict[str, Any]:
    return {'cases': len(cases), 'failures': sum(case.verdict is None for case in cases),
            'top1': rate(case.right for case in cases).value,
            'top3': rate(case.named_among(FIRST_FEW) for case in cases).value}
