# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The proof of a diagnosis: a log that it never saw, predicted without fitting anything to it.

A free run is judged by its rms, in which a slow error counts, unlike in whitened residuals. So the
numbers are fitted once more to the diagnosed logs, by plain least squares.
"""

from collections.abc import Mapping, Sequence
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
from simgap.verdict.law import quantities_of
from simgap.verdict.law_fit import LawfulFit
from simgap.verdict.record import Verdict
from simgap.verdict.spoken import quantity

# A law moves the machine, and so what it is a function of.
_ROUNDS = 4


@dataclass(frozen=True)
class Unseen:
    """How far a reading of an unseen log is from its predictions, as rms in the reading's unit."""

    configured: float  # of the model as configured
    before: float  # fitted by least squares, without any effect
    after: float  # the same with the effects of the best answer
    unit: str
    lawful: float | None = None  # with the law of what is unknown, too; None without one


def unseen(verdict: Verdict, log: Log, push: Mapping[str, FloatArray] | None = None,
           points: Sequence[Point] = ()) -> dict[str, Unseen]:
    """
    Return how well a log of another test, which was not used, is predicted, by reading.

    Nothing is fitted to the log: a number that each test has of its own is the mean of those of
    the diagnosed tests. An effect that has a size by label has that of the log's label. `push` is
    what is known to have entered at some of the model's places, shape (n,) each. `points` are
    those of `plain_fits`, which serve every log.
    """
    whole, machine = verdict.machine, without_labels(verdict.machine)
    assert isinstance(machine, OwnMachine)
    other, found = OwnMachine(machine.model, [log]), {}
    measured = other.experiments[0].measured
    points = [{}, *(points or plain_fits(verdict))]
    if isinstance(whole, ByLabel):
        points = [whole.labels.at(point, log.labels) for point in points]
    points = [_carried(machine, log.name, point) for point in points]
    readings = [other.pushed(point, 0, push or {}) for point in points[:3]]
    if verdict.lawful is not None:
        readings.append(_with_law(verdict.lawful, other, points[3], push or {}))
    for j, (name, item) in enumerate(machine.model.readings.items()):
        configured, before, after, *lawful = (math.sqrt(float(np.nanmean(
            (values[:, j] - measured[:, j]) ** 2))) for values in readings)
        found[name] = Unseen(configured, before, after, item.unit, *lawful)
    return found


def lines(verdict: Verdict, log: Log, found: Mapping[str, Unseen]) -> list[str]:
    """Return how well a log is predicted as people read it, a line for each reading."""
    named = ' and '.join(verdict.best.effects) or 'nothing named'
    told = [f'  {log.name}, not fitted: {name} is off by {quantity(item.configured, item.unit)} '
            f'as configured, {quantity(item.before, item.unit)} fitted without effects, '
            f'{quantity(item.after, item.unit)} with {named}'
            + ('' if item.lawful is None else
               f', {quantity(item.lawful, item.unit)} with the law') + ' (rms)'
            for name, item in found.items()]
    groups = verdict.machine.labels.groups if isinstance(verdict.machine, ByLabel) else {}
    return told + [f'  {log.name}: no diagnosed log has {key}: {log.labels.get(key, "")}'
                   for key, values in groups.items() if log.labels.get(key, '') not in values]


def _with_law(lawful: LawfulFit, other: OwnMachine, point: Point,
              push: Mapping[str, FloatArray]) -> FloatArray:
    """Return the readings of a log with a law, a function of the motion that it makes itself."""
    [log], [experiment], place = other.logs, other.experiments, lawful.place
    values = [point[p.name] for p in lawful.hypothesis.forms[-1].parameters]
    course = np.zeros(experiment.time.size)
    for _ in range(_ROUNDS):
        if place.name in (item.name for item in other.disturbance_inputs):
            name = other.push_at(place.name)
            readings = other.pushed(point, 0, {**push, name: push.get(name, 0.0) + np.interp(
                log.time, experiment.time, course)})
        else:
            readings = other.pushed(point, 0, push)
            readings[:, experiment.channels.index(place.component)] += course
        course = lawful.law.weights(quantities_of(other, [readings]))[0] @ values
    return readings


def plain_fits(verdict: Verdict) -> list[Point]:
    """Return what was fitted by least squares: without effects, with the best, with a law."""
    law, machine = verdict.lawful, verdict.machine
    return [*(refitted(machine, h) for h in (verdict.none, verdict.best)),
            *([refitted(law.machine, law.hypothesis)] if law else [])]


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
