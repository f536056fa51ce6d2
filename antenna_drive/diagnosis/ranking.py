# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""A ranking of hypotheses without a verdict, for callers that judge them in their own way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from antenna_drive.diagnosis import verdict
from antenna_drive.diagnosis.blas import one_blas_thread
from antenna_drive.diagnosis.full_fits import FullFits
from antenna_drive.diagnosis.least_squares import LeastSquares
from antenna_drive.diagnosis.machine import Machine
from antenna_drive.diagnosis.search import Search
from antenna_drive.diagnosis.settings import DEFAULT, Settings


@dataclass(frozen=True)
class Ranking:
    """
    Hypotheses by probability, 'unknown' left out.

    Attributes
    ----------
    answers : the likeliest first
    confusable : groups of effects that the data cannot tell apart

    """

    answers: Sequence[verdict.Answer]
    confusable: Sequence[Sequence[str]]


def _untold(share: float, doing: str) -> None:
    """Tell nobody how far it is."""


def rank_hypotheses(machine: Machine, settings: Settings = DEFAULT) -> Ranking:
    """Search for the effects that a machine lacks, and rank what was found."""
    with one_blas_thread():
        whole = LeastSquares(machine, settings=settings)
        found = FullFits(whole, _untold).compared(*Search(whole, _untold).run())
    return Ranking(verdict.rank(found, 0.0, settings), verdict.confusable(found, settings))
