# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The equations of the trial's joint and axis against closed forms."""

from __future__ import annotations

import math
from typing import Any

from lab.joints.mechanism import Mechanism, simulate, TICK_S
import numpy as np
from numpy.typing import NDArray
import pytest

FloatArray = NDArray[np.float64]
# A steady torque on the load [N m].
PUSHED = {'gravity': 0.01, 'gear': 1e9, 'gravity_phase': 0.5 * math.pi}
# A motor that nothing drives and nothing brakes: the loop is idle, the friction negligible.
FREE: dict[str, Any] = {
    'motor': 2e-4, 'constant': 0.1, 'coulomb': 1e-12, 'viscous': 0.0, 'bristle': 1e-4,
    'bristle_damping': 0.0, 'position_gain': 0.0, 'rate_limit': 1e9, 'velocity_gain': 0.0,
    'velocity_time': 0.0, 'current_limit': 8.0, 'current_lag': 5e-4, 'digit': 1e-12}


def motion(reference: FloatArray, start: float = 0.0,
           **numbers: float) -> tuple[FloatArray, FloatArray]:
    """Return angle and current at each tick."""
    angle, current = np.zeros(reference.size), np.zeros(reference.size)
    simulate(Mechanism(**{**FREE, **numbers}), reference, 1, 0, start, angle, current)
    return angle, current


def jumped(size: float, duration: float) -> FloatArray:
    """Return a reference that jumps at once."""
    return np.r_[0.0, np.full(round(duration / TICK_S), size)]


def turning_rate(angle: FloatArray) -> float:
    """Return the angular frequency of a motion from its turning points [rad/s]."""
    slopes = np.diff(angle - np.polyval(np.polyfit(np.arange(angle.size), angle, 1),
                                        np.arange(angle.size)))
    # where the slope crosses zero upwards, between two samples
    k = np.flatnonzero((slopes[:-1] < 0.0) & (slopes[1:] >= 0.0))
    moments = k + slopes[k] / (slopes[k] - slopes[k + 1])
    return float(2.0 * math.pi / (np.mean(np.diff(moments)) * TICK_S))


def test_a_constant_current_accelerates_as_newton_says() -> None:
    # the loop is saturated: 0.5 A from the first tick on, behind a lag of 0.5 ms
    angle, current = motion(jumped(1e3, 0.2), position_gain=1.0, velocity_gain=1.0,
                            current_limit=0.5)
    assert current[-1] == pytest.approx(0.5, rel=1e-9)
    # the bus interpolates, so its jump at the first tick is complete at the second
    t, lag, torque = 0.198, 5e-4, 0.05
    response = 0.5 * t ** 2 - lag * t + lag ** 2 * (1.0 - math.exp(-t / lag))
    assert angle[-1] == pytest.approx(torque / 2e-4 * response, rel=1e-3)


@pytest.mark.parametrize(('stiffness', 'load'), [(8.0, 3e-4), (1.0, 1e-3)])
def test_two_bodies_swing_at_their_natural_frequency(stiffness: float, load: float) -> None:
    angle, _ = motion(jumped(0.0, 1.0), load=load, stiffness=stiffness, **PUSHED)
    middle = 0.5 * 0.01 / (load + 2e-4) * (TICK_S * np.arange(angle.size)) ** 2
    assert turning_rate(angle - middle) == pytest.approx(
        math.sqrt(stiffness * (1.0 / 2e-4 + 1.0 / load)), rel=2e-3)


def test_damping_of_the_shaft_decays_as_the_closed_form() -> None:
    damping, stiffness, load = 2e-3, 8.0, 3e-4
    angle, _ = motion(jumped(0.0, 0.3), load=load, stiffness=stiffness, damping=damping,
                      **PUSHED)
    both = 1.0 / 2e-4 + 1.0 / load
    time = TICK_S * np.arange(angle.size)
    decay = 0.5 * damping * both
    turn = math.sqrt(stiffness * both - decay ** 2)
    # twist of two bodies of which one is pushed steadily, from rest
    steady = -0.01 / load / (stiffness * both)
    twist = steady * (1.0 - np.exp(-decay * time) * (
        np.cos(turn * time) + decay / turn * np.sin(turn * time)))
    middle = 0.5 * 0.01 / (2e-4 + load) * time ** 2
    assert angle == pytest.approx(middle + twist * load / (2e-4 + load), abs=1e-3 * abs(steady))


def test_what_hangs_on_a_spring_has_its_own_frequency() -> None:
    share, hz = 0.4, 12.0
    angle, _ = motion(jumped(0.0, 2.0), motor=60.0, spring=1e-9, hung_share=share, hung_hz=hz,
                      hung_damping=0.0, shake=50.0, shake_hz=1e-3)
    # both ends of the spring are free
    assert turning_rate(angle[200:] - np.polyval(np.polyfit(
        np.arange(angle.size), angle, 3), np.arange(angle.size))[200:]) == pytest.approx(
        2.0 * math.pi * hz / math.sqrt(1.0 - share), rel=5e-3)


def test_friction_takes_the_same_distance_from_each_swing_until_it_stops() -> None:
    stiffness, level, start = 8.0, 0.03, 0.02
    angle, _ = motion(jumped(0.0, 1.0), start=start, spring=stiffness, coulomb=level,
                      bristle=1e-5, bristle_damping=0.5)
    # at rest when the spring turns it back: amplitudes fall by 2 level / stiffness (Lorenz, 1924)
    lost = 2.0 * level / stiffness
    assert angle.min() == pytest.approx(-(start - lost), rel=2e-3)
    half = round(math.pi * math.sqrt(2e-4 / stiffness) / TICK_S)
    # the peak is up to half a tick from a sample, and bristles give way by 1e-5 rad
    missed = 0.5 * (start - 2.0 * lost) * (0.5 * TICK_S * math.sqrt(stiffness / 2e-4)) ** 2
    assert angle[2 * half - 3:2 * half + 4].max() == pytest.approx(start - 2.0 * lost,
                                                                   abs=missed + 1e-5)
    # where the spring is weaker than the friction, it stays
    assert abs(angle[-1]) < level / stiffness
    assert np.ptp(angle[-300:]) < 1e-6


def test_a_stuck_body_gives_way_as_its_bristles_do() -> None:
    level, bristle, push = 0.03, 1e-3, 0.012
    angle, _ = motion(jumped(0.0, 1.0), coulomb=level, bristle=bristle, bristle_damping=3.0,
                      load=3e-4, stiffness=8.0, damping=0.5, **{**PUSHED, 'gravity': push})
    # pulled slowly, the bristles bend as bristle (1 - exp(-way / bristle)) (P. R. Dahl, 1968)
    assert angle[-1] == pytest.approx(-bristle * math.log(1.0 - push / level), rel=0.02)


def test_a_cyclic_error_a_gap_and_a_slip_are_read_as_large_as_they_are() -> None:
    angle, _ = motion(jumped(0.0, 1.0), slip=0.2, slip_at=0.5)
    assert angle[498] == 0.0 and angle[502] == 0.2
    angle, _ = motion(jumped(0.0, 0.01), encoder_error=0.1, encoder_phase=0.5 * math.pi)
    assert angle == pytest.approx(0.1)
    # the load falls through half the gap before the motor feels it
    angle, _ = motion(jumped(0.0, 0.5), half_gap=0.05, load=3e-4, stiffness=8.0, damping=2e-3,
                      **PUSHED)
    free_s = math.sqrt(2.0 * 0.05 / (0.01 / 3e-4))
    felt = float(TICK_S * np.flatnonzero(np.abs(angle) > 1e-9)[0])
    assert felt == pytest.approx(free_s, abs=1.1e-3)


def test_a_delay_is_the_sum_of_its_lags() -> None:
    pushed = {'position_gain': 1.0, 'velocity_gain': 1.0, 'current_limit': 1.0,
              'current_lag': 5e-3}
    _, prompt = motion(jumped(1e3, 0.2), **pushed)
    _, late = motion(jumped(1e3, 0.2), delay=4e-3, **pushed)
    # the area between two responses is the time between them
    assert TICK_S * float(np.sum(prompt - late)) == pytest.approx(4e-3, rel=5e-3)
