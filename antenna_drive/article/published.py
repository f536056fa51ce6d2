# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The article's claims, each figure with its tolerance and its basis, and what the model gives.

The basis says what a passing row proves:

- published: the article's own numbers in the article's own equation. It checks the transcription.
- derived: a parameter or a command was computed from this figure, so the row holds by
  construction.
- fitted: the shipped parameter sets were fitted to this figure, or it follows from one that they
  were fitted to. lab/calibration/article.yaml lists the targets of the fit.
- predicted: no parameter was set from it.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antenna_drive.article.measures import article_measures, OLD_CIRCUIT, Results
from antenna_drive.article.profile_measures import loaded_axis_measures, profile_measures
from simgap.inputs.plain_yaml import read_yaml

# The share of the time that is 'significant' [percent].
SIGNIFICANT_TIME = 10.0


@dataclass(frozen=True)
class Claim:
    """One published figure or trend."""

    measure: str  # name of the figure that a parameter set gives for it
    # the published figure in the measure's unit, or the article's words; a mapping with the keys
    # field and analysis where the article gives both
    says: float | str | Mapping[str, float]
    kind: str  # 'near', 'at_least' or 'at_most'
    number: float  # the figure to compare with: the analysis' where there are two
    tolerance: float  # in the measure's unit; zero for a trend or a bound
    basis: str  # 'published', 'derived', 'fitted' or 'predicted'
    note: str  # where it is in the article, and what was assumed

    def holds(self, obtained: float) -> bool:
        """Return whether a figure agrees with the claim; NaN does not."""
        if self.kind == 'at_least':
            return obtained >= self.number - self.tolerance
        if self.kind == 'at_most':
            return obtained <= self.number + self.tolerance
        return abs(obtained - self.number) <= self.tolerance


def _claim(measure: str, entry: Mapping[str, Any]) -> Claim:
    kind = next(kind for kind in ('near', 'at_least', 'at_most') if kind in entry)
    number = entry[kind]
    says = entry.get('says', number)
    if 'field' in entry:
        says = {'field': entry['field'], 'analysis': number}
    tolerance = entry.get('tolerance', entry.get('share', 0.0) * abs(number))
    return Claim(measure, says, kind, number, tolerance, entry['basis'], entry['note'])


CLAIMS = tuple(_claim(measure, entry) for measure, entry in read_yaml(
    Path(__file__).with_suffix('.yaml')).items())


@dataclass(frozen=True)
class Row:
    """One published figure and the model's."""

    # 'T4a.overshoot'
    id: str  # noqa: A003
    # the figure or the words; a mapping where the article gives field and analysis
    published: float | str | Mapping[str, float]
    obtained: float  # what the model gives
    # allowed distance from the published figure, from the analysis' if there are two
    tolerance: float
    unit: str  # of all three
    passed: bool  # whether the obtained figure is within the tolerance
    basis: str  # 'published', 'derived', 'fitted' or 'predicted'; see published.py
    note: str  # where it is in the article, and how it is evaluated


def rows(results: Results, experiments: Iterable[str] = (),
         progress: Callable[[int, int], None] | None = None) -> list[Row]:
    """
    Compare every claim of the article with what a parameter set gives.

    results : of the parameter set
    experiments : only rows of these, as 'T3a'; all if empty
    progress : called with the number of rows done and their total
    """
    wanted = tuple(experiments)
    claims = [claim for claim in CLAIMS
              if not wanted or claim.measure.partition('.')[0] in wanted]
    measures = {**article_measures(results.drives[OLD_CIRCUIT]), **profile_measures(),
                **loaded_axis_measures()}
    found = []
    for done, claim in enumerate(claims):
        if progress:
            progress(done, len(claims))
        measure = measures[claim.measure]
        obtained = measure.value(results)
        found.append(Row(claim.measure, claim.says, obtained, claim.tolerance, measure.unit,
                         claim.holds(obtained), claim.basis, claim.note))
    return found
