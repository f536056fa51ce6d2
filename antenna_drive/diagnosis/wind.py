# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Wind on the dish: in each test a little torque over time, as there is every day."""

from collections.abc import Iterator
from dataclasses import dataclass

from antenna_drive.diagnosis.modifiers import AntennaParameter, RunModifier, RunSetup
import numpy as np
from scipy.interpolate import CubicSpline
from simgap.machine.contract import FloatArray

# The torque is smooth between times this far apart [s].
_KNOT_S = 0.5
# A number of the wind acts at its own time and half at those beside it; there is one at each
# second time.
_APART = 2
# How many deviations what differs from day to day may have.
WIDEST = 3.0
# Within this time a smooth torque is taken as a straight line [s].
_LINE_S = 0.02


@dataclass(frozen=True)
class _Knot(RunModifier):
    """The torque about one time."""

    index: int

    def apply(self, run: RunSetup, value: float) -> None:
        if run.wind is None:
            run.wind = np.zeros(_knots(run.duration_s))
        for beside, share in ((-1, 0.5), (0, 1.0), (1, 0.5)):
            # a truncated test has fewer knots
            if 0 <= self.index + beside < run.wind.size:
                run.wind[self.index + beside] += share * value


def _knots(duration_s: float) -> int:
    """Return how many knots the torque has in a test of this duration [s]."""
    return int(duration_s / _KNOT_S) + 2


def everyday_wind(k: int, test: str, first_s: float, last_s: float,
                  torque: float) -> Iterator[AntennaParameter]:
    """Yield the wind of every day in test k while it is seen, of this rms [N m]."""
    for i in range(_APART * int(first_s / (_APART * _KNOT_S)), _knots(last_s), _APART):
        yield AntennaParameter(f'wind:{test}:{i}', 'N m', -WIDEST * torque, WIDEST * torque,
                               torque, torque, experiment=k, modifier=_Knot(i), is_linear=True)


def course(torque: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and the torque [N m] between which straight lines may be drawn."""
    times = _KNOT_S * np.arange(torque.size)
    fine = np.arange(0.0, times[-1] + _LINE_S, _LINE_S)
    return fine, np.asarray(CubicSpline(times, torque)(fine))
