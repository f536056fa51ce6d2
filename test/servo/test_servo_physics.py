# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The servo's physics against closed forms, another integrator and BAM's own figures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from lab.servo.catalogue import catalogue, vector
from lab.servo.log import read_bam, ServoLog
from lab.servo.physics import GRAVITY, swing
from lab.servo.refit import error, LADDER
import numpy as np
from numpy.typing import NDArray
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

LOGS = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'bam_xl330'
MASS, LENGTH, SUPPLY = 0.5, 0.1, 7.0
WEIGHT = MASS * GRAVITY * LENGTH
IDEAL = {'torque_constant': 0.3, 'resistance': 2.0, 'armature_inertia': 0.002}

FloatArray = NDArray[np.float64]


def run(values: dict[str, float], goal: float | FloatArray = 0.0, *, on: bool = True,
        start: float = 0.0, rate: float = 0.0, gain: float = 2.0, seconds: float = 3.0,
        mass: float = MASS, step: float = 1e-3,
        every: float = 5e-3) -> tuple[FloatArray, FloatArray]:
    """Return the times and what the servo did."""
    time = np.arange(0.0, seconds, every)
    ones = np.ones(time.size)
    out = np.empty((time.size, 4))
    swing(vector({**IDEAL, **values}), mass, LENGTH, gain, SUPPLY, time, goal * ones,
          float(on) * ones, 25.0 * ones, start, rate, step, out)
    return time, out


def crossings(time: FloatArray, position: FloatArray) -> FloatArray:
    """Return the times at which the position passes zero."""
    k = np.flatnonzero(np.diff(np.sign(position)) != 0)
    part = position[k] / (position[k] - position[k + 1])
    return np.asarray(time[k] + part * (time[k + 1] - time[k]))


@pytest.mark.parametrize('amplitude', [0.1, 1.0, 2.5])
def test_a_free_pendulum_has_the_period_of_the_elliptic_integral(amplitude: float) -> None:
    time, out = run({}, on=False, start=amplitude, seconds=6.0)
    inertia = MASS * LENGTH ** 2 + IDEAL['armature_inertia']
    period = 4.0 * math.sqrt(inertia / WEIGHT) * ellipk(math.sin(amplitude / 2.0) ** 2)
    assert np.diff(crossings(time, out[:, 0])) == pytest.approx(period / 2.0, rel=1e-3)


def test_without_friction_no_energy_is_lost_and_with_it_none_is_won() -> None:
    tops = {}
    for name, friction in (('none', {}), ('some', {'coulomb_torque': 0.01}),
                           ('teeth', {'compliance': 0.01, 'backlash': 0.01})):
        _, out = run(friction, on=False, start=1.0, seconds=8.0)
        q = out[:, 0]
        tops[name] = np.array([q[k] for k in range(1, q.size - 1)
                               if q[k] > q[k - 1] and q[k] >= q[k + 1] and q[k] > 0.0])
    assert tops['none'] == pytest.approx(1.0, abs=2e-3)
    assert np.all(np.diff(tops['some']) < 0.0)
    assert np.all(tops['teeth'] < 1.0 + 2e-3)


def test_coulomb_friction_takes_its_work_from_each_swing() -> None:
    torque = 0.02
    _, out = run({'coulomb_torque': torque}, on=False, start=1.0, seconds=1.0, every=1e-3)
    turn = float(out[:, 0].min())
    # the loss of potential energy is the work of friction
    assert WEIGHT * (math.cos(turn) - math.cos(1.0)) == pytest.approx(
        torque * (1.0 - turn), rel=5e-3)


def test_a_shaft_sticks_where_friction_carries_the_load_and_only_there() -> None:
    angle = 0.3
    load = WEIGHT * math.sin(angle)
    _, held = run({'coulomb_torque': 1.001 * load}, on=False, start=angle)
    assert np.all(held[:, 0] == angle)
    _, slipped = run({'coulomb_torque': 0.999 * load}, on=False, start=angle)
    assert slipped[-1, 0] < angle


def test_load_dependent_friction_holds_its_share_of_the_load() -> None:
    angle, share = 0.8, 0.4
    missing = (1.0 - share) * WEIGHT * math.sin(angle)
    _, held = run({'load_friction_external': share, 'coulomb_torque': 1.001 * missing},
                  on=False, start=angle)
    assert np.all(held[:, 0] == angle)
    _, slipped = run({'load_friction_external': share, 'coulomb_torque': 0.999 * missing},
                     on=False, start=angle)
    assert slipped[-1, 0] < angle


def test_at_full_duty_the_rate_is_where_torque_and_drag_balance() -> None:
    friction = {'coulomb_torque': 0.05, 'viscous_friction': 0.01}
    _, out = run(friction, goal=1e4, mass=1e-9, seconds=4.0)
    kt, resistance = IDEAL['torque_constant'], IDEAL['resistance']
    expected = ((kt * SUPPLY / resistance - friction['coulomb_torque'])
                / (kt ** 2 / resistance + friction['viscous_friction']))
    assert out[-1, 1] == pytest.approx(expected, rel=1e-6)


def test_a_held_load_needs_the_duty_that_its_weight_says() -> None:
    gain, goal = 2.0, 0.5
    _, out = run({'viscous_friction': 0.05}, goal=goal, gain=gain, seconds=8.0)
    q = float(out[-1, 0])
    torque = IDEAL['torque_constant'] * SUPPLY / IDEAL['resistance'] * gain * (goal - q)
    assert torque == pytest.approx(WEIGHT * math.sin(q), rel=1e-6)


@pytest.mark.parametrize(('effect', 'torque'), [
    ({}, 0.3 * 7.0 / 2.0),
    ({'supply_resistance': 0.5}, 0.3 * 7.0 / 2.5),
    ({'bridge_drop': 1.0}, 0.3 * 6.0 / 2.0),
    ({'duty_limit': 0.25}, 0.3 * 0.75 * 7.0 / 2.0),
    ({'current_limit': 0.5}, 0.3 * 2.0),
    ({'saturation': 0.2}, 0.3 * 3.5 / (1.0 + 0.2 * 3.5)),
])
def test_the_stall_torque_is_that_of_the_circuit(effect: dict[str, float],
                                                 torque: float) -> None:
    # loads just below and just above the stall torque, at the same angle
    def moved(mass: float) -> float:
        _, out = run(effect, goal=1e4, mass=mass, start=math.pi / 2.0, seconds=0.5)
        return float(out[-1, 0]) - math.pi / 2.0

    fits = torque / (GRAVITY * LENGTH)
    assert moved(0.999 * fits) > 0.0 > moved(1.001 * fits)


def test_a_delay_is_a_goal_that_comes_later() -> None:
    time = np.arange(0.0, 3.0, 5e-3)
    goal = np.sin(3.0 * time)
    _, late = run({'delay': 0.02}, goal=goal)
    _, moved = run({}, goal=np.r_[np.zeros(4), goal[:-4]])
    np.testing.assert_allclose(late[:, 0], moved[:, 0], atol=1e-9)


def test_a_smooth_course_is_that_of_another_integrator() -> None:
    kt, resistance, drag, gain = 0.3, 2.0, 0.01, 2.0
    inertia = MASS * LENGTH ** 2 + IDEAL['armature_inertia']

    def slope(t: float, state: FloatArray) -> list[float]:
        q, w = state
        duty = min(max(gain * (0.4 - q), -1.0), 1.0)
        current = (duty * SUPPLY - kt * w) / resistance
        return [w, (kt * current - drag * w - WEIGHT * math.sin(q + 0.1)) / inertia]

    time, out = run({'viscous_friction': drag, 'position_offset': 0.1}, goal=0.4)
    exact = solve_ivp(slope, (0.0, 3.0), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-11)
    errors = []
    for step in (2.5e-3, 1.25e-3):
        _, out = run({'viscous_friction': drag, 'position_offset': 0.1}, goal=0.4, step=step)
        errors.append(float(np.abs(out[:, 0] - exact.y[0]).max()))
    assert errors[1] < 1e-4
    assert errors[1] < errors[0] / 3.0  # the second order


def test_stiff_teeth_without_a_gap_are_no_teeth() -> None:
    time = np.arange(0.0, 3.0, 5e-3)
    goal = 0.8 * np.sin(4.0 * time)
    friction = {'coulomb_torque': 0.01, 'viscous_friction': 0.01}
    _, rigid = run(friction, goal=goal)
    _, teeth = run({**friction, 'compliance': 1e-9}, goal=goal, step=2e-4)
    # the deflection is the load times the least compliance, 2 mrad here
    assert float(np.abs(rigid[:, 0] - teeth[:, 0]).max()) < 6e-3


@pytest.mark.parametrize('effect', sorted(catalogue()))
def test_every_effect_acts_on_some_course_and_none_is_there_at_nought(effect: str) -> None:
    time = np.arange(0.0, 3.0, 5e-3)
    base = {'coulomb_torque': 0.08, 'viscous_friction': 0.01}
    courses: dict[str, dict[str, Any]] = {
        'driven': {'goal': 1.2 * np.sin(4.0 * time)},
        'let go': {'on': False, 'start': 1.0},
        'warm and halting': {'goal': 1.2 * np.clip(2.0 * np.sin(2.0 * time), -1.0, 1.0)}}

    def swung(values: dict[str, float]) -> FloatArray:
        outs = []
        for name, course in courses.items():
            out = np.empty((time.size, 4))
            swing(vector({**IDEAL, **base, **values}), MASS, LENGTH, 4.0, SUPPLY, time,
                  np.ones(time.size) * course.get('goal', 0.0),
                  float(course.get('on', True)) * np.ones(time.size),
                  np.full(time.size, 25.0 if 'warm' not in name else 40.0),
                  float(course.get('start', 0.0)), 0.0, 1e-3, out)
            outs.append(out[:, 0].copy())
        return np.array(outs)

    for form in catalogue()[effect].forms:
        absent = {p.name: p.start if p.is_shape else 0.0 for p in form.parameters}
        there = {p.name: p.start if p.is_shape else 0.5 * p.high for p in form.parameters}
        np.testing.assert_array_equal(swung(absent), swung({}))
        assert float(np.abs(swung(there) - swung({})).max()) > 1e-4, form.name


@pytest.mark.skipif(not LOGS.is_dir(), reason='the recordings of the servo are not here')
def test_the_peers_own_parameters_give_the_peers_own_figure() -> None:
    """
    The friction model m6 is BAM's: its shipped parameters give the same error here as there.

    They are in bam/params/xl330/m6.json of Rhoban/bam. BAM's own simulator obtains 74.1 mrad with
    them on these recordings.
    """
    values = {
        'torque_constant': 0.28638649600668775, 'resistance': 2.000017119760972,
        'armature_inertia': 0.002569774737524995, 'position_offset': 0.01553585638800363,
        'coulomb_torque': 0.0023258418670152347, 'stribeck_torque': 0.0001856264715700908,
        'load_friction_motor': 0.23063000784446322,
        'load_friction_external': 0.26077932692372613,
        'load_stribeck_motor': 1.9157733081388423e-06,
        'load_stribeck_external': 0.15158776983752117,
        'load_quadratic_motor': 0.005595958708218643,
        'load_quadratic_external': 0.0037747149629857673,
        'stribeck_rate': 0.11532863880939243, 'stribeck_shape': 1.000022697315946,
        'viscous_friction': 0.0185448141303962, 'delay': 0.0}
    assert set(values) == set(LADDER['m6'])
    tests = [ServoLog.of(path.stem, read_bam(path)) for path in sorted(LOGS.glob('*.json'))]
    assert len(tests) == 16
    assert 1e3 * error(tests, values) == pytest.approx(74.1, abs=2.0)
