# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Gusts on the dish: in each test a torque over time that is free at its knots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from antenna_drive.diagnosis.modifiers import AntennaParameter, RunModifier, RunSetup
import numpy as np
from scipy.interpolate import CubicSpline
from simgap.machine.contract import FloatArray, Form, Point

ID = 'axis.wind_gust'
# The torque is free at times this far apart [s], and smooth between.
KNOT_S = 0.5
# Within this time a smooth torque is taken as a straight line [s].
_LINE_S = 0.02
# Wind has no jumps: from one knot to the next it changes by at most this many times its usual
# change.
_JUMP = 7.0
# The data determine a knot whose standard deviation is below this share of that of the prior.
_DETERMINED = 0.1


@dataclass(frozen=True)
class _Knot(RunModifier):
    """The torque at one knot."""

    index: int

    def apply(self, run: RunSetup, value: float) -> None:
        if run.gust is None:
            run.gust = np.zeros(knots(run.duration_s))
        # a truncated test has fewer knots
        if self.index < run.gust.size:
            run.gust[self.index] = value


@dataclass(frozen=True)
class Gust(Form):
    """A course over time in each test: so free at its knots that it may be no wind."""

    def implausibility(self, point: Point, deviations: Point) -> float:
        """
        Return the greatest change between two knots, over the greatest that wind makes.

        Where the axis stands still, or the data end, a torque has no effect. The prior holds such
        a knot near zero, and what is left of the fit may pull it anywhere: it tells nothing.
        """
        courses: dict[int | None, list[float]] = {}
        for knot in self.parameters:
            determined = deviations.get(knot.name, 0.0) < _DETERMINED * knot.prior_sigma
            courses.setdefault(knot.experiment, []).append(
                point[knot.name] if determined else math.nan)
        found = 0.0
        for course in courses.values():
            change = np.abs(np.diff(course))
            change = change[np.isfinite(change)]
            if change.size and np.any(change):
                found = max(found, float(change.max() / (1.4826 * np.median(change) + 1e-30)))
        return found / _JUMP


def knots(duration_s: float) -> int:
    """Return how many knots a gust has in a test of this duration [s]."""
    return int(duration_s / KNOT_S) + 2


def gust_form(durations_s: Sequence[float]) -> Gust:
    """Return the form of a gust in tests of these durations [s]."""
    return Gust('torque over time', tuple(
        AntennaParameter(f'{ID}.torque:{k}:{i}', 'N m', -1e6, 1e6, 2e3, 3e4, experiment=k,
                         modifier=_Knot(i))
        for k, duration in enumerate(durations_s) for i in range(knots(duration))),
        is_course=True)


def course(torque: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and the torque [N m] between which straight lines may be drawn."""
    times = KNOT_S * np.arange(torque.size)
    fine = np.arange(0.0, times[-1] + _LINE_S, _LINE_S)
    return fine, np.asarray(CubicSpline(times, torque)(fine))
