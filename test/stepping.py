# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A block of the drive that a test steps by itself, as its node would."""

from typing import Any

from antenna_drive.emulator.kernels import of_unit
from antenna_drive.parameters.records import record_of
from antenna_drive.physics.block import Block
from antenna_drive.physics.integrator import work_space
import numpy as np


class Stepped:
    """States x, modes, inputs u and outputs y of a block; all but x and y for the test to set."""

    def __init__(self, block: Block, parameters: object) -> None:
        """Start the block."""
        self._kernels = of_unit(block)
        self._p = record_of(parameters)
        self.x: Any = np.zeros(block.count_states(self._p[0]))
        self.mode: Any = np.zeros(len(block.modes), np.int64)
        self.u: Any = np.zeros((len(block.inputs), 2))
        self.y: Any = np.zeros((len(block.outputs), 2))
        self._work = work_space(self.x.size)
        self._kernels.start(self._p, self.x, self.mode, self.u, self.y)

    def step(self, h: float, steps: int = 1) -> None:
        """Advance by a macro-step of h [s], in inner steps."""
        self._kernels.step(self.x, self.mode, self.u, self._p, h, steps, self._work, self.y)
