# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Wind on the dish: in each test a torque over time, a little every day and free in a gust."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from antenna_drive.diagnosis.modifiers import AntennaParameter, RunModifier, RunSetup
import numpy as np
from scipy.interpolate import CubicSpline
from simgap.machine.contract import FloatArray, Form

ID = 'axis.wind_gust'
# The torque is free at times this far apart [s], and smooth between.
KNOT_S = 0.5
# How many deviations what differs from day to day may have.
WIDEST = 3.0
# The wind of every day is slower: its knots are this many of those apart.
_CALM = 2
# Within this time a smooth torque is taken as a straight line [s].
_LINE_S = 0.02


@dataclass(frozen=True)
class _Knot(RunModifier):
    """The torque at one knot, which falls to nothing over so many knots to both sides."""

    index: int
    reach: int = 1

    def apply(self, run: RunSetup, value: float) -> None:
        if run.gust is None:
            run.gust = np.zeros(knots(run.duration_s))
        for beside in range(1 - self.reach, self.reach):
            # a truncated test has fewer knots
            if 0 <= self.index + beside < run.gust.size:
                run.gust[self.index + beside] += value * (1.0 - abs(beside) / self.reach)


def knots(duration_s: float) -> int:
    """Return how many knots a gust has in a test of this duration [s]."""
    return int(duration_s / KNOT_S) + 2


def gust_form(durations_s: Sequence[float], everyday: float) -> Form:
    """Return the form of a gust in tests of these durations [s]; `everyday` is an rms [N m]."""
    return Form('torque over time', tuple(
        AntennaParameter(f'{ID}.torque:{k}:{i}', 'N m', -1e6, 1e6, 2e3, 3e4, experiment=k,
                         tolerance=WIDEST * everyday, modifier=_Knot(i))
        for k, duration in enumerate(durations_s) for i in range(knots(duration))),
        is_course=True)


def everyday_wind(k: int, test: str, first_s: float, last_s: float,
                  torque: float) -> Iterator[AntennaParameter]:
    """Yield the knots of the wind of every day in test k while it is seen, of this rms [N m]."""
    for i in range(_CALM * int(first_s / (_CALM * KNOT_S)), knots(last_s), _CALM):
        yield AntennaParameter(f'wind:{test}:{i}', 'N m', -WIDEST * torque, WIDEST * torque,
                               torque, torque, experiment=k, modifier=_Knot(i, _CALM),
                               is_linear=True)


def course(torque: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and the torque [N m] between which straight lines may be drawn."""
    times = KNOT_S * np.arange(torque.size)
    fine = np.arange(0.0, times[-1] + _LINE_S, _LINE_S)
    return fine, np.asarray(CubicSpline(times, torque)(fine))
