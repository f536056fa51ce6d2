# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How figures are read off: on signals whose figures are known in closed form."""

from __future__ import annotations

import math

from antenna_drive.article import readings
from hypothesis import given, strategies as st
import numpy as np
import pytest

TIME = np.arange(0.0, 12.0, 1e-3)


@pytest.mark.parametrize('damping', [0.1, 0.2, 0.5])
def test_overshoot_and_final_value_of_a_second_order_system(damping: float) -> None:
    omega = 4.0
    damped = omega * math.sqrt(1.0 - damping ** 2)
    decay = np.exp(-damping * omega * TIME)
    value = 3.0 * (1.0 - decay * (np.cos(damped * TIME)
                                  + damping * omega / damped * np.sin(damped * TIME)))
    response = readings.step_response(TIME, value)
    assert response.final == pytest.approx(3.0, rel=1e-2)
    overshoot = math.exp(-math.pi * damping * omega / damped)
    assert response.overshoot == pytest.approx(overshoot, abs=0.015)


def test_settling_time_of_a_first_order_lag() -> None:
    value = 1.0 - np.exp(-TIME / 0.8)
    settling = readings.step_response(TIME, value).settling_s
    assert settling == pytest.approx(0.8 * math.log(20.0), abs=2e-3)


def test_plateau_and_deviation_leave_out_the_first_period_and_take_the_commands_sign() -> None:
    period = 2.0
    sign = np.where(np.floor(TIME + 1e-9) % 2 == 0, 1.0, -1.0)
    value = 5.0 * sign
    value[TIME < period] = 1e6
    assert readings.plateau(TIME, value, period, (0.5, 0.9)) == pytest.approx(5.0)
    assert readings.deviation(TIME, value, period, (0.5, 0.9)) == pytest.approx(5.0)


def test_bias_range_of_a_clipped_sine() -> None:
    value = np.maximum(0.0, 4.0 * np.sin(math.pi * TIME))
    found = readings.bias_range(TIME, value, 2.0)
    assert (found.low_V, found.high_V) == pytest.approx((0.0, 4.0))
    assert found.zero_fraction == pytest.approx(0.5, abs=2e-3)


numbers = st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=8, unique=True)


@given(numbers)
def test_a_falling_row_is_told_from_any_other(row: list[float]) -> None:
    assert readings.falls(sorted(row, reverse=True)) < 0.0
    strictly = all(after < before for before, after in zip(row, row[1:]))
    assert (readings.falls(row) < 0.0) == strictly


@given(numbers)
def test_falling_then_rising_needs_a_turn_inside_the_row(row: list[float]) -> None:
    steps = [after - before for before, after in zip(row, row[1:])]
    turn = row.index(min(row))
    shape = (0 < turn < len(row) - 1 and all(step < 0.0 for step in steps[:turn])
             and all(step > 0.0 for step in steps[turn:]))
    assert (readings.falls_then_rises(row) < 0.0) == shape
