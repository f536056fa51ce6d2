# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where a wave is, which angle it follows, and its value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from simgap.machine.contract import FloatArray


@dataclass(frozen=True)
class WaveShape:
    """
    Where a wave is and which angle it follows.

    stem : what the names of the amplitude, cycles and phases in the record begin with
    paths : where these fields are
    angle : 'motor_1', 'motor_2' or 'axis'
    order : cycles per revolution; 0 if not chosen yet
    """

    stem: str
    paths: tuple[str, ...]
    angle: str
    order: float = 0.0

    def fields(self, parts: Sequence[float], turned: float = 0.0) -> dict[str, float]:
        """
        Return the wave as the record has it: amplitudes and phases, by the ends of their names.

        parts : sine and cosine, relative change of the order, sine and cosine of the second and of
            the third harmonic
        turned : angle from which the angle of the record counts [rad]
        """
        sine, cosine, change, second_sine, second_cosine, third_sine, third_cosine = parts
        cycles = self.order * (1.0 + change)
        phase = math.remainder(cycles * turned, math.tau)
        return {'': math.hypot(sine, cosine),
                '_phase': math.atan2(cosine, sine) + phase,
                '_cycles': cycles,
                '_second': math.hypot(second_sine, second_cosine),
                '_second_phase': math.atan2(second_cosine, second_sine) + 2.0 * phase,
                '_third': math.hypot(third_sine, third_cosine),
                '_third_phase': math.atan2(third_cosine, third_sine) + 3.0 * phase}

    def along(self, angle: FloatArray, parts: Sequence[float]) -> FloatArray:
        """Return the wave at angles of shape (n,); `parts` as in `fields`."""
        sine, cosine, change, *higher = parts
        total = np.zeros_like(angle)
        amplitudes = (sine, cosine, *higher)
        for k, (a, b) in enumerate(zip(amplitudes[::2], amplitudes[1::2], strict=True), start=1):
            turned = k * self.order * (1.0 + change) * angle
            total += a * np.sin(turned) + b * np.cos(turned)
        return total
