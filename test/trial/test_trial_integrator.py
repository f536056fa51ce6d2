# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Dormand and Prince's coefficients against the polynomials that they integrate exactly."""

from __future__ import annotations

from lab.antenna.equations import STATES
from lab.antenna.integrator import A, C, ERROR, interpolate
import numpy as np
import pytest

STEP = 0.7


def slopes_and_end(power: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the stages and the end of a step of y' = p t^(p-1), which is t^p from zero."""
    k = np.zeros((7, STATES))
    for stage in range(7):
        k[stage] = power * (C[stage] * STEP) ** (power - 1)
    return k, np.full(STATES, STEP * float(A[6] @ k[:6, 0]))


def test_each_stage_is_taken_where_its_coefficients_add_up_to() -> None:
    assert A.sum(axis=1) == pytest.approx(C, abs=1e-15)


@pytest.mark.parametrize('power', [1, 2, 3, 4, 5])
def test_a_step_is_exact_up_to_the_fifth_power(power: int) -> None:
    k, end = slopes_and_end(power)
    assert end[0] == pytest.approx(STEP ** power, rel=1e-13)
    # the embedded method is one order lower: it first errs at the fifth power
    assert (abs(STEP * float(ERROR @ k[:, 0])) < 1e-13) == (power < 5)


@pytest.mark.parametrize('power', [1, 2, 3, 4])
def test_the_dense_output_is_exact_up_to_the_fourth_power(power: int) -> None:
    k, end = slopes_and_end(power)
    out = np.empty(STATES)
    for part in (0.0, 0.1, 0.5, 0.9, 1.0):
        interpolate(part, np.zeros(STATES), k, end, STEP, out)
        assert out == pytest.approx((part * STEP) ** power, abs=1e-12)
