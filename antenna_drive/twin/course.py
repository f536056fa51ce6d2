# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a twin has done lately, on an even grid."""

from dataclasses import dataclass, field

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.readings import SIGNALS
from antenna_drive.twin.baseline import ENCODER, WashOut
import numpy as np


@dataclass
class Course:
    """The twin's course on an even grid, with the encoder behind its high-pass."""

    time: FloatArray = field(default_factory=lambda: np.zeros(0))
    raw: FloatArray = field(default_factory=lambda: np.zeros((0, len(SIGNALS))))
    washed: FloatArray = field(default_factory=lambda: np.zeros((0, len(SIGNALS))))
    command: FloatArray = field(default_factory=lambda: np.zeros(0))
    wash_out: WashOut = field(default_factory=WashOut)

    def add(self, time: FloatArray, raw: FloatArray, command: FloatArray, step_s: float) -> None:
        """Take rows of the grid: time [s], the channels, and the command."""
        washed = raw.copy()
        washed[:, ENCODER] = self.wash_out(raw[:, ENCODER], step_s)
        self.time = np.append(self.time, time)
        self.raw = np.concatenate([self.raw, raw])
        self.washed = np.concatenate([self.washed, washed])
        self.command = np.append(self.command, command)

    def drop_before(self, time: float) -> None:
        """Forget the rows before a time [s]."""
        first = int(np.searchsorted(self.time, time))
        self.time, self.command = self.time[first:], self.command[first:]
        self.raw, self.washed = self.raw[first:], self.washed[first:]
