# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A machine whose answers to a force are exact: two lags side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter
from simgap.machine.contract import (
    Course, DisturbanceInput, Effect, Experiment, FloatArray, Form, Machine, Motion, Parameter,
    Point, Regimes, TimeScales,
)

TIME: FloatArray = np.arange(3000, dtype=np.float64) * 0.01
NOISE = 0.05
HALF = TIME > 15.0


def answered(course: FloatArray) -> FloatArray:
    """Return the response of a lag of 0.2 s, exact for an input held between samples."""
    pole = np.exp(-0.01 / 0.2)
    return np.asarray(lfilter([0.0, 1.0 - pole], [1.0, -pole], course))


class TwoLags(Machine):
    """Two lags side by side, each seen by a sensor of its own; regimes are the halves."""

    disturbance_inputs: tuple[DisturbanceInput, ...] = (
        DisturbanceInput('force on the left', 'left'),
        DisturbanceInput('force on the right', 'right'))
    time_scales = TimeScales(1.0, 5.0, 0.15, 1.5, 1.0)

    def __init__(self, left: FloatArray, right: FloatArray) -> None:
        clean = np.column_stack([answered(left), answered(right)])
        measured = clean + NOISE * np.random.default_rng(7).normal(size=clean.shape)
        number = Parameter('left.step.size', 'N', -5.0, 5.0, 1e-3)
        super().__init__(
            [Experiment('one', TIME, ('seen left', 'seen right'), ('m', 'm'), measured,
                        np.full_like(measured, NOISE))],
            [Parameter('zero', 'm', -0.01, 0.01, 1e-4, 0.005)],
            [Effect('left.step', 'left', '', (Form('', (number,)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return both readings."""
        step = answered(point.get('left.step.size', 0.0) * HALF.astype(np.float64))
        return np.column_stack([step, 0.0 * TIME]) + point.get('zero', 0.0)

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        """Return both readings with a force on one lag."""
        found = [self.predict(point, k) for k in range(len(courses))]
        for readings, course in zip(found, courses, strict=True):
            readings[:, int(place.component == 'right')] += answered(course(TIME))
        return found

    def motion(self, experiment: int) -> Motion:
        """Return the halves of the test."""
        return Halves(TIME)


class Halves(Motion):
    """A motion whose regimes are the halves of a test."""

    def regimes(self) -> Regimes:
        """Return the half of the test."""
        return Regimes(('first half', 'second half'), HALF.astype(np.int64))
