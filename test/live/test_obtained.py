# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The figures that the page reads from its history, against those of every step of the run."""

from __future__ import annotations

from antenna_drive.article.experiments import experiments
from antenna_drive.article.measures import article_measures, Results, with_circuits
from antenna_drive.emulator.run import simulate
from antenna_drive.emulator.wiring import DRIVE
from antenna_drive.live.experiment_buttons import claims_of, Obtained
from antenna_drive.live.history import History
from antenna_drive.parameters import load
import numpy as np
import pytest

# What a sample each 10 ms in place of each 1 ms may change, by the figure's unit.
NEAR = {'deg/s': 0.5, 'article A': 0.01, 'A': 0.01, 'V': 0.05, 'percent': 0.6, 's': 0.011}


def played(history: History, name: str, run: int, seconds: float | None = None,
           without: slice = slice(0)) -> None:
    """Let a history see an experiment, without some of its steps."""
    experiment = experiments()[name]
    result = simulate(experiment.drive(), seconds or experiment.duration)
    history.begin(run, result.step_s)
    for step in np.delete(result.steps, without).tolist():
        history.take(step, result.samples[step, :, 0])


def test_figures_of_every_experiment_are_those_of_the_article_command() -> None:
    seen, obtained = History(len(DRIVE.signals)), Obtained()
    results, measures = Results(with_circuits()), article_measures(load())
    for number, name in enumerate(experiments(), 1):
        obtained.begin(seen.run)
        assert obtained.look(name, seen) is None, 'the run before'
        played(seen, name, number)
        figures = obtained.look(name, seen)
        assert figures is not None
        assert set(figures) == {claim.measure for claim in claims_of(name)} != set()
        for measure, value in figures.items():
            assert value == pytest.approx(measures[measure].value(results),
                                          abs=NEAR[measures[measure].unit]), measure
        assert obtained.look(name, seen) is None, 'it is told once'


def test_what_is_compared_with_a_run_that_was_not_seen_is_not_known() -> None:
    seen, obtained = History(len(DRIVE.signals)), Obtained()
    played(seen, 'T2', 7)
    figures = obtained.look('T2', seen)
    assert figures is not None
    assert [name for name, value in figures.items() if value is None] == [
        'T2b.tach', 'T2b.encoder']


def test_a_run_that_is_too_short_or_was_missed_tells_nothing() -> None:
    seen, obtained = History(len(DRIVE.signals)), Obtained()
    played(seen, 'T4a', 1, seconds=7.9)
    assert obtained.look('T4a', seen) is None
    played(seen, 'T4a', 2, without=slice(1000, 2000))
    figures = obtained.look('T4a', seen)
    assert figures is not None and set(figures.values()) == {None}
