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
"""
The next test of the drive: the one that is expected to settle a verdict.

Tests of every family are drawn within the limits. All are simulated with each rival; those that
keep the limits and in which the rivals' readings differ most are judged with all tolerances free
(`diagnosis.discrimination`). The best ones are varied. In the end each rival is fitted to the
simulated readings of the others: what derivatives promise is not always kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple, dataclass, replace
from typing import Any

from antenna_drive.diagnosis import DEFAULT, Settings
from antenna_drive.diagnosis.discrimination import known_to, refitted, Separation, separation
from antenna_drive.diagnosis.rivals import Rival
from antenna_drive.machines.antenna.candidate_tests import drawn, FAMILIES, nearby
from antenna_drive.machines.antenna.drive_limits import CHANNELS, DriveLimits, reached
from antenna_drive.machines.antenna.machine import AntennaMachine
from antenna_drive.machines.antenna.planned_tests import planned
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.sheet import TestSheet
import numpy as np

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Effort:
    """
    How much is searched.

    Attributes
    ----------
    drawn : tests of each family
    judged : of all, those that are judged with all tolerances free
    varied : of these, those that are varied
    variants : of each of them
    confirmed : of all, those that every rival is fitted to
    margin : share of each limit that a test may use

    """

    drawn: int = 12
    judged: int = 14
    varied: int = 3
    variants: int = 4
    confirmed: int = 2
    margin: float = 0.9


@dataclass(frozen=True)
class Judged:
    """
    A test and what it is expected to tell.

    Attributes
    ----------
    family : of the test, see `FAMILIES`
    sheet : of the test
    reached : what the test reaches of the limits, the worst of all rivals
    told : how well it tells the rivals apart; None if it was not judged
    expected : probability that the answer is right after the test
    confirmed : the same with every rival fitted to the readings of the others; None if not done

    """

    family: str
    sheet: TestSheet
    reached: DriveLimits
    told: Separation | None
    expected: float
    confirmed: Separation | None = None


@dataclass(frozen=True)
class Proposal:
    """
    What was found.

    Attributes
    ----------
    tests : the judged ones, the best first; none if no test within the limits helps
    before : probability that the answer is right now
    refused : how many drawn tests each limit has cost

    """

    tests: Sequence[Judged]
    before: float
    refused: Mapping[str, int]


class Search:
    """
    The search for the test that tells rivals apart.

    Parameters
    ----------
    rivals
        of a verdict
    base
        what a further test shares with those that were made
    inflated
        by what differences of the cost are divided
    drive
        the configuration
    limits
        of the drive
    duration, rate
        of the test [s], and its samples per second [Hz]
    threads
        tests at once
    settings, effort
        thresholds, and how much is searched
    seed
        of the tests that are drawn

    """

    def __init__(self, rivals: Sequence[Rival], base: TestSheet, inflated: float, drive: Drive,
                 limits: DriveLimits, duration: float = 30.0, rate: float = 70.0,
                 threads: int = 2, settings: Settings = DEFAULT, effort: Effort = Effort(),
                 seed: int = 0) -> None:
        """Prepare to search."""
        self._rivals, self._base, self._inflated = list(rivals), base, inflated
        self._drive, self._limits = drive, limits
        self._duration, self._rate, self._threads = duration, rate, threads
        self._settings, self._effort = settings, effort
        self._random = np.random.default_rng(seed)

    def run(self, progress: Progress = lambda share, doing: None) -> Proposal:
        """Search, and return what was found."""
        effort = self._effort
        known = np.array([rival.probability for rival in self._rivals])
        before = float(known.max() / known.sum())
        sheets = [(family, drawn(family, self._base, self._limits, self._duration, self._random))
                  for _ in range(effort.drawn) for family in FAMILIES]
        with ThreadPoolExecutor(self._threads) as pool:
            progress(0.0, 'tests within the limits')
            rough = list(pool.map(lambda item: self._screened(*item), sheets))
            refused: dict[str, int] = {}
            for test in rough:
                worst, share = self._limits.worst(test.reached)
                if share > effort.margin:
                    refused[worst] = refused.get(worst, 0) + 1
            allowed = sorted((test for test in rough if self._allowed(test)),
                             key=lambda test: -test.expected)
            progress(0.3, 'the best with all tolerances free')
            judged = self._best(pool.map(self._judged, allowed[:effort.judged]))
            progress(0.55, 'variants of the best')
            variants = [replace(test, sheet=nearby(test.sheet, self._random))
                        for test in judged[:effort.varied] for _ in range(effort.variants)]
            tried = [test for test in pool.map(
                lambda test: self._screened(test.family, test.sheet), variants)
                if self._allowed(test)]
            judged = self._best([*judged, *pool.map(self._judged, tried)])
            progress(0.8, 'each rival fitted to the others')
            sure = list(pool.map(self._confirmed, judged[:effort.confirmed]))
        progress(1.0, 'done')
        sure.sort(key=lambda test: -test.expected)
        helpful = [test for test in (*sure, *judged[effort.confirmed:])
                   if test.expected > before]
        return Proposal(helpful, before, refused)

    def _best(self, tests: Any) -> list[Judged]:
        return sorted(tests, key=lambda test: -test.expected)

    def _allowed(self, test: Judged) -> bool:
        return self._limits.worst(test.reached)[1] <= self._effort.margin

    def _machine(self, sheet: TestSheet) -> AntennaMachine:
        recording = planned(sheet, self._duration, self._rate)
        return AntennaMachine({'next': recording}, self._drive, threads=1)

    def _screened(self, family: str, sheet: TestSheet) -> Judged:
        """Simulate a test with each rival; no rival's numbers follow yet."""
        machine = self._machine(sheet).low_fidelity()
        told = separation(machine, self._rivals, self._inflated, self._settings, follow=False)
        return Judged(family, sheet, self._reached(machine), None, self._expected(told))

    def _reached(self, machine: AntennaMachine) -> DriveLimits:
        """Return what a test reaches of each limit, the worst of all rivals."""
        all_ = [reached(*machine.outputs(known_to(machine, rival), 0, CHANNELS), self._drive)
                for rival in self._rivals]
        return DriveLimits(*(max(values) for values in zip(*map(astuple, all_), strict=True)))

    def _judged(self, test: Judged) -> Judged:
        """Judge a test with all tolerances free, to first order."""
        told = separation(self._machine(test.sheet), self._rivals, self._inflated,
                          self._settings)
        return replace(test, told=told, expected=self._expected(told))

    def _confirmed(self, test: Judged) -> Judged:
        """Fit each rival to the readings of the others."""
        told = refitted(self._machine(test.sheet), self._rivals, self._inflated, self._settings)
        return replace(test, confirmed=told, expected=self._expected(told))

    def _expected(self, told: Separation) -> float:
        return told.expected(self._settings.verdict.temperature)
