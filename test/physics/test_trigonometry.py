# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Sine and cosine against the C library's, over the angles that a drive can reach."""

from __future__ import annotations

import math

from antenna_drive.physics.trigonometry import cosine, sine
from hypothesis import example, given
from hypothesis import strategies as st

# A million radians, and what the last digits of both results may differ by.
MOST, ROUNDING = 1e6, 3e-16


@given(st.floats(-MOST, MOST))
@example(0.0)
@example(math.pi)
@example(-0.5 * math.pi)
@example(1e-300)
@example(333333 * math.pi)
def test_sine_and_cosine_are_those_of_the_c_library(angle: float) -> None:
    assert abs(sine(angle) - math.sin(angle)) <= ROUNDING
    assert abs(cosine(angle) - math.cos(angle)) <= ROUNDING


def test_a_small_angle_keeps_its_digits() -> None:
    for angle in (1e-3, -1e-8, 1e-160):
        assert math.isclose(sine(angle), math.sin(angle), rel_tol=ROUNDING)
