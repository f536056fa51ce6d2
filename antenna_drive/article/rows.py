# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The comparison with the article, row by row."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from antenna_drive.article.measures import article_measures, Measure, OLD_CIRCUIT, Results
from antenna_drive.article.profile_measures import loaded_axis_measures, profile_measures
from antenna_drive.article.published import CLAIMS


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


def all_measures(results: Results) -> dict[str, Measure]:
    """Return all figures that rows can refer to, by name."""
    return {**article_measures(results.drives[OLD_CIRCUIT]), **profile_measures(),
            **loaded_axis_measures()}


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
    measures = all_measures(results)
    found = []
    for done, claim in enumerate(claims):
        if progress:
            progress(done, len(claims))
        measure = measures[claim.measure]
        obtained = measure.value(results)
        found.append(Row(claim.measure, claim.says, obtained, claim.tolerance, measure.unit,
                         claim.holds(obtained), claim.basis, claim.note))
    return found
