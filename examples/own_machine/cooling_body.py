# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A machine of your own for the diagnosis: a body that cools, seen by two thermometers."""

from __future__ import annotations

import sys

import numpy as np
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.verdict.diagnosis import diagnose

TIME = np.arange(0.0, 10.0, 0.02)
STARTS = (3.0, -2.0)     # temperatures above the room's at the start of two tests [K]
NOISE = 0.01             # of a thermometer [K]


class CoolingBody(Machine):
    """A body whose temperature decays; the model lacks a heater and an error of a thermometer."""

    def __init__(self, measured: list[FloatArray]) -> None:
        """Name what was measured, what is known only within a tolerance, and the effects."""
        super().__init__(
            experiments=[
                Experiment(f'from {start:g} K', TIME, ('beside', 'behind'), ('K', 'K'), readings,
                           np.full_like(readings, NOISE))
                for start, readings in zip(STARTS, measured, strict=True)],
            nuisances=[Parameter('rate.change', '1', -0.02, 0.02, 1e-3, prior_sigma=0.01)],
            effects=[
                Effect('heater.step', 'heater', 'the heater comes on', (
                    Form('', (Parameter('heater.step.size', 'K', -1.0, 1.0, 1e-3),)),)),
                Effect('thermometer.gain', 'thermometer', 'a wrong scale', (
                    Form('', (Parameter('thermometer.gain.size', '1', -0.5, 0.5, 1e-3),)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what both thermometers read, had the body these parameter values."""
        return readings_of(STARTS[experiment], point)


def readings_of(start: float, point: Point) -> FloatArray:
    """Return the closed form: start exp(-rate t), with what the effects add."""
    rate = 0.4 * (1.0 + point.get('rate.change', 0.0))
    body = start * np.exp(-rate * TIME) + point.get('heater.step.size', 0.0) * (TIME >= 4.0)
    return np.column_stack([body * (1.0 + point.get('thermometer.gain.size', 0.0)), body])


def main() -> int:
    """Diagnose a body whose heater comes on, and print the verdict."""
    random = np.random.default_rng(1)
    truth = {'heater.step.size': 0.25, 'rate.change': 0.01}
    measured = [readings_of(start, truth) + NOISE * random.normal(size=(TIME.size, 2))
                for start in STARTS]
    print(diagnose(CoolingBody(measured)).summary())
    return 0


if __name__ == '__main__':
    sys.exit(main())
