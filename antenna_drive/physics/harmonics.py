# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What repeats with an angle: teeth, slots, scales and rails are seldom pure sines."""

from antenna_drive.physics.trigonometry import cosine, sine
from simgap.laws.compiling import inner


@inner
def wave(angle: float, amplitude: float, second: float, third: float, cycles: float,
         phase: float, second_phase: float, third_phase: float) -> float:
    """
    Return a wave of three harmonics, in the unit of its amplitudes.

    angle : that it follows [rad]
    amplitude, second, third : of the harmonics
    cycles : of the first harmonic per revolution
    phase, second_phase, third_phase : of the harmonics at angle zero [rad]
    """
    if amplitude == 0.0 and second == 0.0 and third == 0.0:
        return 0.0
    turned = cycles * angle
    return (amplitude * sine(turned + phase)
            + second * sine(2.0 * turned + second_phase)
            + third * sine(3.0 * turned + third_phase))


@inner
def wave_slope(angle: float, amplitude: float, second: float, third: float, cycles: float,
               phase: float, second_phase: float, third_phase: float) -> float:
    """Return the derivative of `wave` by the angle, per rad; everything as there."""
    if amplitude == 0.0 and second == 0.0 and third == 0.0:
        return 0.0
    turned = cycles * angle
    return cycles * (amplitude * cosine(turned + phase)
                     + 2.0 * second * cosine(2.0 * turned + second_phase)
                     + 3.0 * third * cosine(3.0 * turned + third_phase))
