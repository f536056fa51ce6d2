# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The proof of a diagnosis: a log that it never saw, predicted without fitting anything to it.

A free run is judged by its rms, in which a slow error counts, unlike in whitened residuals. So the
numbers are fitted once more to the diagnosed logs, by plain least squares.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
import math

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import settled
from simgap.logs.log import Log
from simgap.machine.by_label import ByLabel, without_labels
from simgap.machine.contract import FloatArray, Machine, Point
from simgap.model.machine import OwnMachine
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT
from simgap.verdict.record import Verdict


@dataclass(frozen=True)
class Unseen:
    """How far a reading of an unseen log is from its predictions, as rms in the reading's unit."""

    configured: float  # of the model as configured
    before: float  # fitted by least squares, without any effect
    after: float  # the same with the effects of the best answer
    unit: str


def unseen(verdict: Verdict, log: Log,
           push: Mapping[str, FloatArray] | None = None) -> dict[str, Unseen]:
    """
    Return how well a log of another test, which was not used, is predicted, by reading.

    Nothing is fitted to the log: a number that each test has of its own is the mean of those of
    the diagnosed tests. An effect that has a size by label has that of the log's label. `push` is
    what is known to have entered at some of the model's places, shape (n,) each.
    """
    whole, machine = verdict.machine, without_labels(verdict.machine)
    assert isinstance(machine, OwnMachine)
    other = OwnMachine(machine.model, [log])
    measured = other.experiments[0].measured
    found = {}
    points: list[Point] = [{}, *(refitted(whole, h) for h in (verdict.none, verdict.best))]
    if isinstance(whole, ByLabel):
        points = [whole.labels.at(point, log.labels) for point in points]
    readings = [other.pushed(_carried(machine, log.name, point), 0, push or {})
                for point in points]
    for j, (name, item) in enumerate(machine.model.readings.items()):
        configured, before, after = (math.sqrt(float(np.nanmean(
            (values[:, j] - measured[:, j]) ** 2))) for values in readings)
        found[name] = Unseen(configured, before, after, item.unit)
    return found


def refitted(machine: Machine, hypothesis: Hypothesis) -> dict[str, float]:
    """Return the values of a hypothesis as fitted to the machine's logs by least squares."""
    plain = machine.with_experiments([replace(e, colours=(), process=None)
                                      for e in machine.experiments])
    problem = LeastSquares(plain, settings=DEFAULT.changed('fit.outlier', DEFAULT.fit.runaway))
    start = problem.start(hypothesis.state.parameters, hypothesis.state.point())
    return settled(problem, start, DEFAULT.search.rounds).point()


def _carried(machine: OwnMachine, test: str, point: Point) -> dict[str, float]:
    return {**point, **{f'{name}[{test}]': float(np.mean(
        [point.get(f'{name}[{log.name}]', 0.0) for log in machine.logs]))
        for name in machine.model.per_test}}
