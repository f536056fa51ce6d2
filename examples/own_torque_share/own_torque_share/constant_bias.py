# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A torque share of one's own: the same bias at every load, through a first-order filter."""

from __future__ import annotations

from collections.abc import Mapping
import math
import sys

from antenna_drive.emulator.unit import FloatArray, Unit
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep.entry import run_unit
from antenna_drive.parameters import Entry
import numpy as np
from simgap.inputs.schema import Value

GAIN, POLE, DIFFERENCE_GAIN = 4.54, 1.369863, 8.192149  # 1/s, 1/s, V/A: Filter 1 as it was
BIAS = Entry('V', 0.0, 20.0, 'bias voltage, at every load', live=True)


class ConstantBias(Unit):
    """Asks for one bias voltage whatever the motors carry."""

    inputs = ('motor_1/current', 'motor_2/current')
    outputs = OUTPUTS['torque_share']

    def __init__(self, name: str = 'torque_share', bias: float = 8.0) -> None:
        """Ask for `bias` [V]."""
        super().__init__(name)
        self.bias = bias

    def settings(self) -> Mapping[str, tuple[Entry, Value]]:
        """Return the one parameter."""
        return {'bias': (BIAS, self.bias)}

    def tune(self, changes: Mapping[str, Value]) -> None:
        """Change the bias."""
        self.check(changes)
        self.bias = float(changes.get('bias', self.bias))  # type: ignore[arg-type]

    def start(self, step_s: float) -> FloatArray:
        """Return to rest."""
        self.x, self.step_s = 0.0, step_s
        return np.array([[0.0, GAIN * self.bias], [self.bias, 0.0]])

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Advance x' = GAIN * error - POLE * x over a step, the error taken at its middle."""
        (i_1, di_1), (i_2, di_2) = inputs
        middle, end = ((i_2 - i_1) + (di_2 - di_1) * t for t in (self.step_s / 2, self.step_s))
        target = GAIN / POLE * (self.bias - DIFFERENCE_GAIN * middle)
        self.x = target + (self.x - target) * math.exp(-POLE * self.step_s)
        rate = GAIN * (self.bias - DIFFERENCE_GAIN * end) - POLE * self.x
        return np.array([[self.x, rate], [self.bias, 0.0]])


def main() -> int:
    """Run the node; return its exit code."""
    return run_unit(ConstantBias())


if __name__ == '__main__':
    sys.exit(main())
