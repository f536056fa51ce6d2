# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Friction: levels against their formulas, motion against closed forms, sticking exactly."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
import pytest
from simgap.parts import compiled, friction
from simgap.parts.friction import Friction


@compiled
def levels(law: Friction, rate: float, load: float, angle: float) -> tuple[float, float]:
    return friction.level(law, rate, load, angle), friction.drag(law, rate)


@compiled
def moved(law: Friction, rate: float, torque: float, inertia: float, step: float,
          rates: NDArray[np.float64]) -> None:
    for k in range(rates.size):
        moving = friction.direction(rate, torque)
        rate = friction.rate_after(step, rate, torque, friction.level(law, moving, 0.0, 0.0),
                                   friction.drag(law, moving), inertia)
        rates[k] = rate


def run(law: Friction, rate: float, torque: float, inertia: float, step: float,
        count: int) -> NDArray[np.float64]:
    rates = np.empty(count)
    moved(law, rate, torque, inertia, step, rates)
    return rates


def test_coulomb_friction_brings_a_body_to_rest_when_it_should_and_keeps_it_there() -> None:
    """Rate falls as w - T t / J and is exactly zero from t = J w / T on."""
    rates = run(Friction(coulomb=0.3), 1.0, 0.0, 1.5, 0.01, 800)
    time = 0.01 * np.arange(1, 801)
    assert rates == pytest.approx(np.maximum(1.0 - 0.2 * time, 0.0), abs=1e-12)
    assert np.all(rates[500:] == 0.0)


def test_a_body_at_rest_moves_only_if_the_torque_exceeds_friction() -> None:
    assert np.all(run(Friction(coulomb=0.3), 0.0, 0.29, 1.0, 0.01, 100) == 0.0)
    assert run(Friction(coulomb=0.3), 0.0, 0.31, 1.0, 0.01, 100)[-1] == pytest.approx(0.01)
    assert run(Friction(coulomb=0.3), 0.0, -0.31, 1.0, 0.01, 100)[-1] == pytest.approx(-0.01)


@pytest.mark.parametrize('steps', [100, 200])
def test_viscous_friction_decays_as_an_exponential_with_an_error_of_second_order(
        steps: int) -> None:
    rates = run(Friction(viscous=2.0), 1.0, 0.5, 1.0, 1.0 / steps, steps)
    exact = 0.25 + 0.75 * math.exp(-2.0)
    assert rates[-1] == pytest.approx(exact, abs=0.1 / steps ** 2 * 0.75)


def test_asymmetric_friction_holds_more_in_one_direction() -> None:
    law = Friction(coulomb=1.0, asymmetry=0.2, viscous=4.0, viscous_asymmetry=-0.25)
    assert levels(law, 0.5, 0.0, 0.0) == pytest.approx((1.2, 3.0))
    assert levels(law, -0.5, 0.0, 0.0) == pytest.approx((0.8, 5.0))
    assert np.all(run(law, 0.0, 1.1, 1.0, 0.01, 50) == 0.0)
    assert run(law, 0.0, -1.1, 1.0, 0.01, 50)[-1] < 0.0


def test_stribeck_friction_fades_with_the_rate() -> None:
    law = Friction(coulomb=1.0, stribeck=0.5, stribeck_rate=0.1, stribeck_shape=2.0)
    assert levels(law, 0.0, 0.0, 0.0)[0] == pytest.approx(1.5)
    assert levels(law, 0.1, 0.0, 0.0)[0] == pytest.approx(1.0 + 0.5 / math.e)
    assert levels(law, -0.2, 0.0, 0.0)[0] == pytest.approx(1.0 + 0.5 * math.exp(-4.0))


def test_load_and_angle_change_the_level() -> None:
    law = Friction(coulomb=1.0, load_share=0.1, wave_order=3.0, wave_cosine=0.2, wave_sine=-0.1)
    assert levels(law, 1.0, -4.0, 0.5)[0] == pytest.approx(
        1.4 * (1.0 + 0.2 * math.cos(1.5) - 0.1 * math.sin(1.5)))


def test_a_wave_deeper_than_the_level_leaves_no_friction_and_drives_nothing() -> None:
    assert levels(Friction(coulomb=1.0, wave_order=1.0, wave_cosine=-2.0), 1.0, 0.0, 0.0)[0] == 0.0


def test_drag_that_thins_is_a_power_of_the_rate() -> None:
    """With an exponent of 2/3 the torque at 8 times the rate is 4 times as large."""
    law = Friction(viscous=3.0, thinning=1.0 / 3.0, thinning_rate=0.1)
    torques = [rate * levels(law, rate, 0.0, 0.0)[1] for rate in (0.1, 0.8)]
    assert torques == pytest.approx([0.3, 1.2])


@compiled
def built_up(distance: float, rate: float, step: float, shares: NDArray[np.float64]) -> None:
    share = -1.0
    for k in range(shares.size):
        share = friction.presliding(share, rate, distance, step)
        shares[k] = share


def test_friction_builds_up_over_a_distance_after_a_reversal() -> None:
    """Dahl: share = 1 - 2 exp(-x / distance), whatever the rate."""
    for rate, step in ((0.5, 1e-3), (0.05, 1e-2)):
        shares = np.empty(200)
        built_up(0.02, rate, step, shares)
        way = rate * step * np.arange(1, 201)
        assert shares == pytest.approx(1.0 - 2.0 * np.exp(-way / 0.02), abs=1e-12)
    built_up(0.0, 0.5, 1e-3, shares)
    assert np.all(shares == 1.0)
    built_up(0.02, 0.0, 1e-3, shares)
    assert np.all(shares == -1.0)
