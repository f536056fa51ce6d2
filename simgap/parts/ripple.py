# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What repeats with an angle: torque ripple, a cyclic error of a scale, a bent screw."""

import math

from simgap.laws.compiling import inner


@inner
def wave(angle: float, order: float, cosine: float, sine: float) -> float:
    """Return a wave by an angle [rad], `order` cycles per revolution, in its amplitudes' unit."""
    if cosine == 0.0 and sine == 0.0:
        return 0.0
    return cosine * math.cos(order * angle) + sine * math.sin(order * angle)


@inner
def harmonics(angle: float, order: float, amplitudes: tuple[float, ...]) -> float:
    """
    Return a wave by an angle [rad] with harmonics, in the unit of its amplitudes.

    `order` is of the fundamental in cycles per revolution; `amplitudes` are cosine and sine part
    of the fundamental, of the second harmonic, and so on.
    """
    total = 0.0
    for k in range(len(amplitudes) // 2):
        total += wave(angle, (k + 1.0) * order, amplitudes[2 * k], amplitudes[2 * k + 1])
    return total
