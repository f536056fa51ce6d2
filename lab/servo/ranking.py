# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A ranking of hypotheses without a verdict, for callers that judge them in their own way."""

from collections.abc import Sequence
from dataclasses import dataclass

from simgap.fit.blas import one_blas_thread
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Machine
from simgap.search.search import Search
from simgap.settings import DEFAULT, Settings
from simgap.verdict import verdict


@dataclass(frozen=True)
class Ranking:
    """Hypotheses by probability, 'unknown' left out."""

    answers: Sequence[verdict.Answer]       # the likeliest first
    confusable: Sequence[Sequence[str]]     # groups that the data cannot tell apart


def _untold(share: float, doing: str) -> None:
    """Tell nobody how far it is."""


def rank_hypotheses(machine: Machine, settings: Settings = DEFAULT) -> Ranking:
    """Search for the effects that a machine lacks, and rank what was found."""
    with one_blas_thread():
        found = Search(LeastSquares(machine, settings=settings), _untold).run()
    return Ranking(verdict.ranked(found, 0.0), verdict.confusable(found))
