# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Friction against Eq. (2), and its modes against what they stand for."""

from hypothesis import given, strategies as st
import numpy as np
import pytest
from simgap.laws.friction import drag, friction_torque, next_slip, slip_level

COULOMB, STICTION, THRESHOLD = 2.0, 2.5, 1e-3

torques = st.floats(-10.0, 10.0)
rates = st.floats(-5.0, 5.0)


@pytest.mark.parametrize(('rate', 'applied', 'friction'), [
    (0.1, 0.0, -2.0),       # slips forward: the Coulomb torque holds back
    (-0.1, 7.0, 2.0),       # whatever is applied
    (0.0, 1.5, -1.5),       # at rest: equal and opposite to what is applied
    (0.0, -2.4, 2.4),
    (0.0, 4.0, -2.5),       # up to the stiction torque
    (5e-4, -9.0, 2.5),      # a rate within the threshold counts as rest
    (0.0, 0.0, 0.0)])
def test_the_law_of_eq_2(rate: float, applied: float, friction: float) -> None:
    assert friction_torque(rate, applied, COULOMB, STICTION, THRESHOLD) == friction


@given(rates, torques)
def test_friction_never_drives(rate: float, applied: float) -> None:
    torque = friction_torque(rate, applied, COULOMB, STICTION, THRESHOLD)
    if abs(rate) > THRESHOLD:
        assert torque * rate < 0.0
    else:
        assert torque * applied <= 0.0
        assert abs(torque) <= min(abs(applied), STICTION)


@given(torques)
def test_a_body_at_rest_breaks_away_just_above_stiction(applied: float) -> None:
    slip = next_slip(0, 0.0, applied, COULOMB, STICTION, THRESHOLD)
    assert slip == (np.sign(applied) if abs(applied) > STICTION else 0)


@given(st.sampled_from((-1, 1)), st.floats(THRESHOLD * 1.01, 5.0), torques)
def test_a_moving_body_slips_on(slip: int, speed: float, applied: float) -> None:
    assert next_slip(slip, slip * speed, applied, COULOMB, STICTION, THRESHOLD) == slip


@given(st.sampled_from((-1, 1)), st.floats(1e-9, 5.0), torques)
def test_a_body_whose_rate_changes_sign_sticks(slip: int, speed: float, applied: float) -> None:
    assert next_slip(slip, -slip * speed, applied, COULOMB, STICTION, THRESHOLD) == 0


def test_a_body_that_has_just_broken_away_does_not_stick_again() -> None:
    assert next_slip(1, 0.0, 2.51, COULOMB, STICTION, THRESHOLD) == 1


def test_the_neutral_slip_level_is_the_coulomb_torque() -> None:
    for rate in (-3.0, 0.0, 1e-4, 7.0):
        assert slip_level(rate, COULOMB, 0.0, 0.0, 1.0, 2.0, 0.0) == COULOMB


def test_the_terms_of_the_slip_level() -> None:
    assert slip_level(-3.0, 2.0, 1.5, 0.0, 1.0, 2.0, 0.0) == 3.5
    assert slip_level(1.5, 2.0, 0.0, 0.8, 1.5, 2.0, 0.0) == pytest.approx(2.0 + 0.8 / np.e)
    assert slip_level(-3.0, 2.0, 0.0, 0.8, 1.5, 1.0, 0.0) == pytest.approx(2.0 + 0.8 / np.e ** 2)
    assert slip_level(1.0, 2.0, 0.0, 0.0, 1.0, 2.0, 0.1) == pytest.approx(2.2)
    assert slip_level(-1.0, 2.0, 0.0, 0.0, 1.0, 2.0, 0.1) == pytest.approx(1.8)


def test_drag_is_proportional_to_the_rate_unless_the_lubricant_thins() -> None:
    assert drag(-3.0, 0.5, 10.0, 1.0) == 1.5
    for index in (2.0 / 3.0, 1.0, 2.0):
        assert drag(0.0, 0.5, 10.0, index) == 0.0
        assert drag(10.0, 0.5, 10.0, index) == 5.0
        # eight times the rate: four times the torque of a bearing, eight of oil, 64 of windage
        assert drag(-80.0, 0.5, 10.0, index) == pytest.approx(5.0 * 8.0 ** index)
