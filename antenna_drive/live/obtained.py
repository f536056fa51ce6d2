# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The article's figures as the run on the page gives them, to stand beside the published ones."""

import math

from antenna_drive.article.experiments import DriveExperiment, experiments
from antenna_drive.article.measures import article_measures, Measure, Results
from antenna_drive.article.published import Claim, CLAIMS
from antenna_drive.emulator.run import Run
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.live.history import History, Piece
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import Drive
import numpy as np

_NAMES = tuple(f'{unit}/{signal.name}' for unit, signals in OUTPUTS.items() for signal in signals)
# This share of the intervals may be missing: the page's reader is a guest that may come late.
_MOST_MISSING = 0.01


def claims_of(name: str) -> list[Claim]:
    """Return what the article says of an experiment that the page can begin."""
    rows = {'T2': ('T2a', 'T2b')}.get(name, (name,))
    return [claim for claim in CLAIMS if claim.measure.partition('.')[0] in rows]


class Obtained:
    """Reads the figures of each experiment once its run is long enough, and remembers the runs."""

    def __init__(self) -> None:
        """Begin with no run."""
        self._seen = _Seen({})
        self._told: tuple[str, int] | None = None
        self._before = 0

    def begin(self, before: int) -> None:
        """Take note that an experiment begins with a run that is not `before`."""
        self._before, self._told = before, None

    def look(self, name: str, history: History) -> dict[str, float | None] | None:
        """
        Return the figures of an experiment by name, None if there is nothing new.

        A figure is None if too many steps were missed, or if the run of the other experiment has
        not been seen with which it compares.
        """
        run = history.run
        if run in (0, self._before) or self._told == (name, run):
            return None
        experiment = experiments()[name]
        piece = history.since(run, 0)
        if piece.run != run or piece.time_s < experiment.duration:
            return None
        self._told = (name, run)
        self._seen.runs.pop(name, None)
        seen = run_of(piece, experiment)
        if seen is not None:
            self._seen.runs[name] = seen
        measures = article_measures(load())
        return {claim.measure: self._value(measures[claim.measure]) for claim in claims_of(name)}

    def _value(self, measure: Measure) -> float | None:
        try:
            value = measure.value(self._seen)
        except KeyError:
            return None
        return value if math.isfinite(value) else None


class _Seen(Results):
    """The runs that were seen, in place of simulated ones."""

    def __init__(self, drives: dict[str, Drive]) -> None:
        super().__init__(drives, {})
        self.runs: dict[str, Run] = {}

    def run(self, name: str) -> Run:
        """Return a run; KeyError if it was not seen."""
        return self.runs[name]


def run_of(piece: Piece, experiment: DriveExperiment) -> Run | None:
    """Return the run of an experiment, a sample each interval; None if too much is missing."""
    per = round(piece.interval_s / piece.step_s)
    wanted = round(experiment.duration / piece.interval_s)
    ends = piece.ends[:wanted]
    there = np.isfinite(ends).all(axis=1)
    if piece.first or there.sum() < (1.0 - _MOST_MISSING) * wanted:
        return None
    steps = (np.flatnonzero(there) + 1) * per - 1
    return Run(piece.step_s, steps, _NAMES, np.stack(
        [ends[there], np.zeros_like(ends[there])], axis=2))
