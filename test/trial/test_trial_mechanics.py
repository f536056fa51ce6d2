# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The integrator and the equations against closed forms and conservation laws."""

from __future__ import annotations

import math

from lab.antenna import equations, laws
from lab.antenna.equations import MODES_AT, MOTOR_AT, MOTOR_SIZE
from lab.antenna.machine import Records, reference_machine
from lab.antenna.real_antenna import simulate, TrueSignals
from lab.antenna.sheet import CaseSheet
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

REST = CaseSheet('old', 'old', {'type': 'fixed', 'voltage_V': 0.0}, {}, elevation_deg=0.0)


def bare_axis() -> Records:
    """Return a hub alone: no gears, no appendages."""
    machine = reference_machine()
    machine.motors['stiffness'] = 0.0
    machine.motors['contact_damping'] = 0.0
    machine.structure['mode_inertia'] = 0.0
    return machine


def ideal_mechanics() -> Records:
    """Return rotors, gears, hub and appendages without friction, damping or motor torque."""
    machine = reference_machine()
    machine.motors['torque_constant'] = 0.0
    machine.motors['coulomb'] = 0.0
    machine.motors['contact_damping'] = 0.0
    machine.structure['coulomb'] = 0.0
    machine.structure['mode_damping'] = 0.0
    return machine


def energy(machine: Records, history: TrueSignals) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the mechanical energy at every sample [J]."""
    y, structure = history.state, machine.structure[0]
    theta_a, w_a = y[:, equations.THETA_A], y[:, equations.W_A]
    total = 0.5 * structure['inertia'] * w_a**2
    for k in range(3):
        angle, rate = y[:, MODES_AT + 2 * k], y[:, MODES_AT + 2 * k + 1]
        total += 0.5 * structure['mode_inertia'][k] * (
            rate**2 + structure['mode_frequency'][k]**2 * (angle - theta_a)**2)
    for which in range(2):
        motor, at = machine.motors[which], MOTOR_AT + which * MOTOR_SIZE
        x = y[:, at + equations.THETA] - structure['gear_ratio'] * theta_a
        depth = np.maximum(np.abs(x) - motor['half_gap'], 0.0)
        total += 0.5 * motor['inertia'] * y[:, at + equations.W]**2
        total += 0.5 * motor['stiffness'] * depth**2
    return total


def test_energy_is_conserved_through_every_impact() -> None:
    machine = ideal_mechanics()
    history = simulate(machine, REST, np.linspace(0.0, 10.0, 2001), place=(4.0, -2.5))
    values = energy(machine, history)
    assert history.switchings > 50
    assert values == pytest.approx(np.full(len(values), values[0]), rel=1e-6)


def test_gear_hysteresis_only_takes_energy() -> None:
    machine = ideal_mechanics()
    machine.motors['hysteresis'] = 0.3
    history = simulate(machine, REST, np.linspace(0.0, 10.0, 2001), place=(4.0, -2.5))
    apart = np.ones(len(history.time), dtype=bool)
    for which in range(2):
        at = MOTOR_AT + which * MOTOR_SIZE
        x = history.state[:, at + equations.THETA] - 14868.0 * history.axis_angle
        apart &= np.abs(x) < machine.motors[which]['half_gap']
    # While the teeth are apart no energy hides in the lagging torque.
    values = energy(machine, history)[apart]
    assert len(values) > 20
    assert np.all(np.diff(values) < 1e-6 * values[0])
    assert values[-1] < 0.7 * values[0]


def test_axis_sticks_below_stiction_and_slides_above() -> None:
    times = np.linspace(0.0, 5.0, 101)
    machine = bare_axis()
    coulomb, inertia = float(machine.structure['coulomb'][0]), 8.74e6
    machine.structure['wind'] = 1.2499 * coulomb
    assert not np.any(simulate(machine, REST, times).axis_angle)
    machine.structure['wind'] = -1.2501 * coulomb
    sliding = simulate(machine, REST, times)
    assert sliding.axis_angle == pytest.approx(
        -0.5 * 0.2501 * coulomb / inertia * times**2, rel=1e-9)


def test_axis_coasts_to_a_stop_and_stays() -> None:
    machine = bare_axis()
    coulomb, inertia, let_go = float(machine.structure['coulomb'][0]), 8.74e6, 1.3
    machine.structure['wind'] = 2.5 * coulomb
    machine.structure['ballast'] = -2.5 * coulomb
    machine.structure['ballast_at'] = let_go
    stop = let_go + 1.5 * let_go
    times = np.array([0.0, let_go, stop - 1e-6, stop + 1e-6, 6.0])
    history = simulate(machine, REST, times)
    top = 1.5 * coulomb / inertia * let_go
    assert history.axis_rate[1] == pytest.approx(top, rel=1e-9)
    assert history.axis_rate[2] == pytest.approx(coulomb / inertia * 1e-6, rel=1e-4)
    assert history.axis_rate[3] == history.axis_rate[4] == 0.0
    assert history.axis_angle[4] == pytest.approx(0.5 * top * stop, rel=1e-9)


def test_terminal_rate_under_shear_thinning_drag() -> None:
    machine = bare_axis()
    coulomb = float(machine.structure['coulomb'][0])
    machine.structure['viscous'] = 2e7
    machine.structure['wind'] = 2.0 * coulomb
    rate = brentq(lambda w: 2e7 * w * (1.0 + (w / 1.3e-3)**2)**-0.075 - coulomb, 0.0, 1.0)
    history = simulate(machine, REST, np.array([0.0, 20.0]))
    assert history.axis_rate[-1] == pytest.approx(rate, rel=1e-6)


def test_wind_slides_against_stribeck_friction() -> None:
    """J w' = T - T_c - S / (1 + w / w_h), integrated by another library."""
    machine = bare_axis()
    coulomb, inertia = float(machine.structure['coulomb'][0]), 8.74e6
    machine.structure['stribeck'] = 8e4
    machine.structure['stribeck_rate'] = 2e-3
    machine.structure['wind'] = 1.25 * coulomb + 8e4 + 1.0
    other = solve_ivp(
        lambda t, y: [y[1], (0.25 * coulomb + 8e4 + 1.0 - 8e4 / (1.0 + y[1] / 2e-3)) / inertia],
        (0.0, 3.0), [0.0, 0.0], method='Radau', rtol=1e-10, atol=1e-14)
    history = simulate(machine, REST, np.array([0.0, 3.0]))
    assert history.axis_angle[-1] == pytest.approx(other.y[0, -1], rel=1e-7)


def test_held_mode_swings_at_its_frequency() -> None:
    """A stuck hub jerked by ballast leaves a free appendage at rest; a released one swings."""
    machine = bare_axis()
    machine.structure['mode_inertia'] = (2e6, 0.0, 0.0)
    machine.structure['mode_damping'] = 0.0
    machine.structure['coulomb'] = 0.0
    machine.structure['wind'] = 1e5
    omega, hub, mode = float(machine.structure['mode_frequency'][0, 0]), 8.74e6, 2e6
    times = np.linspace(0.0, 3.0, 301)
    history = simulate(machine, REST, times)
    free = omega * math.sqrt(1.0 + mode / hub)
    total = hub + mode
    rigid = 0.5 * 1e5 / total * times**2
    swing = mode / total * 1e5 / hub / free**2 * (1.0 - np.cos(free * times))
    assert history.axis_angle == pytest.approx(rigid + swing, rel=1e-7, abs=1e-14)


def test_share_circuit_fills_exponentially() -> None:
    """x_2 of Eq. (9) without load: k_2 f_o / s_2 (1 - exp(-s_2 t)), cut at 13 V."""
    sheet = CaseSheet('old', 'old', {'type': 'circuit', 'bias_pot': 0.7, 'start': 'zero'}, {})
    times = np.linspace(0.0, 3.0, 601)
    history = simulate(reference_machine(), sheet, times)
    free = -3.502 * -10.74 / 1.093 * (1.0 - np.exp(-1.093 * times))
    assert history.bias == pytest.approx(0.7 * np.minimum(free, 13.0), rel=1e-7, abs=1e-9)


def test_result_does_not_hang_on_the_tolerance() -> None:
    sheet = CaseSheet('new', 'new', {'type': 'circuit', 'bias_pot': 0.8, 'start': 'steady'},
                      {'type': 'triangle', 'amplitude_deg_s': 0.685, 'period_s': 5.0})
    times = np.linspace(0.0, 15.0, 1501)
    coarse, fine = (simulate(reference_machine('new', 'new', 0.8), sheet, times,
                             place=(0.4, -0.7), tolerance=tolerance)
                    for tolerance in (1e-8, 1e-10))
    assert coarse.current == pytest.approx(fine.current, abs=1e-5)
    assert coarse.axis_angle == pytest.approx(fine.axis_angle, abs=1e-9)


def test_start_is_where_it_is_said_to_be() -> None:
    machine = reference_machine()
    machine.motors['mesh_error'] = 0.05
    machine.motors['mesh_cycles'] = 7.0
    history = simulate(machine, REST, np.array([0.0, 1e-3]), place=(0.999, -0.999))
    assert history.switchings == 0
    for which, place in enumerate((0.999, -0.999)):
        theta = history.state[0, MOTOR_AT + which * MOTOR_SIZE + equations.THETA]
        x, _, gap = laws.gear_deflection(
            machine.motors[which], machine.structure[0], theta, 0.0, 0.0, 0.0)
        assert x == pytest.approx(place * gap, abs=1e-9)
