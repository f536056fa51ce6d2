# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Backlash against Eq. (1), with the numbers of Fig. 1: a gap of 1 deg, 20 N m/deg."""

from hypothesis import given, strategies as st
import pytest
from simgap.laws.backlash import contact_side, contact_torque, contact_torque_rate, dead_zone

FIG_1_GAP = 1.0
FIG_1_STIFFNESS = 20.0

angles = st.floats(-10.0, 10.0)


@pytest.mark.parametrize(('angle', 'torque'), [
    (0.0, 0.0), (0.999, 0.0), (-1.0, 0.0), (1.0, 0.0), (1.5, 10.0), (-2.0, -20.0), (3.0, 40.0)])
def test_the_curve_of_fig_1(angle: float, torque: float) -> None:
    assert FIG_1_STIFFNESS * dead_zone(angle, FIG_1_GAP) == pytest.approx(torque, abs=1e-12)
    side = contact_side(angle, 0.0, FIG_1_GAP, FIG_1_STIFFNESS, 0.7)
    assert contact_torque(side, angle, 0.0, FIG_1_GAP, FIG_1_STIFFNESS, 0.7) == pytest.approx(
        torque, abs=1e-12)


@given(angles, st.floats(0.0, 5.0))
def test_it_is_odd_and_never_steeper_than_the_spring(angle: float, gap: float) -> None:
    assert dead_zone(-angle, gap) == -dead_zone(angle, gap)
    nearby = angle + 1e-3
    assert 0.0 <= dead_zone(nearby, gap) - dead_zone(angle, gap) <= 1e-3 + 1e-12


@given(angles, st.floats(-100.0, 100.0), st.floats(0.0, 5.0), st.floats(0.0, 10.0))
def test_flanks_push_and_never_pull(angle: float, rate: float, gap: float, damping: float,
                                    ) -> None:
    side = contact_side(angle, rate, gap, 20.0, damping)
    torque = contact_torque(side, angle, rate, gap, 20.0, damping)
    assert torque * angle >= 0.0
    if side == 0:
        assert torque == 0.0
        assert abs(angle) <= gap or angle * rate < 0.0


def test_the_rate_of_the_torque_is_its_derivative() -> None:
    stiffness, damping, rate, acceleration, dt = 23.6, 0.133, 0.4, 3.0, 1e-6

    def torque(t: float) -> float:
        angle = 0.2 + rate * t + 0.5 * acceleration * t * t
        return float(contact_torque(1, angle, rate + acceleration * t, 0.148, stiffness, damping))

    slope = (torque(dt) - torque(-dt)) / (2.0 * dt)
    assert contact_torque_rate(
        torque(0.0), rate, acceleration, stiffness, damping) == pytest.approx(slope, rel=1e-6)
    assert contact_torque_rate(0.0, rate, acceleration, stiffness, damping) == 0.0
