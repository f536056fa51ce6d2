# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The structure against closed forms, an eigenvalue solver, and conservation of energy."""

from collections.abc import Callable
from dataclasses import replace
import math

from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import Plant
from antenna_drive.physics import structure
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
import scipy.linalg
from stepping import Stepped

H = 1e-3


def _plant(**axis: object) -> Plant:
    plant = load().plant
    return replace(plant, axis=replace(plant.axis, **axis))  # type: ignore[arg-type]


def _simulate(plant: Plant, x0: np.ndarray, slip: int, steps: int, h: float = H,
              inputs: Callable[[float], np.ndarray] | None = None) -> np.ndarray:
    """Return the states at every step, shape (steps + 1, states)."""
    unit = Stepped(structure.BLOCK, plant)
    unit.x[:], unit.mode[:] = x0, slip
    rows = [unit.x.copy()]
    for k in range(steps):
        if inputs is not None:
            unit.u[:] = inputs(k * h)
        unit.step(h)
        rows.append(unit.x.copy())
    return np.array(rows)


def _energy(plant: Plant, states: np.ndarray) -> np.ndarray:
    """Return kinetic and elastic energy of hub and modes [J], shape (n,)."""
    axis = plant.axis
    total = 0.5 * axis.inertia_hub * states[:, 1] ** 2
    for j, inertia in enumerate(axis.mode_inertias):
        omega = 2.0 * math.pi * axis.mode_frequencies[j]
        bend = states[:, 2 + 2 * j] - states[:, 0]
        total = total + 0.5 * inertia * (states[:, 3 + 2 * j] ** 2 + (omega * bend) ** 2)
    return np.asarray(total)


def test_a_coasting_hub_stops_when_and_where_coulomb_friction_says() -> None:
    plant = _plant(mode_inertias=(1e-3,) * 3, mode_damping_ratios=(0.0,) * 3)
    axis = plant.axis
    friction = axis.coulomb_torque * axis.friction_torque_per_ampere * axis.gear_ratio
    rate = 2e-3
    x0 = np.zeros(8)
    x0[1] = x0[3::2] = rate
    stop = rate * axis.inertia_hub / friction
    states = _simulate(plant, x0, 1, 2 * math.ceil(stop / H))
    moving = np.arange(states.shape[0]) * H < stop
    deceleration = friction / axis.inertia_hub
    time = np.arange(states.shape[0])[moving] * H
    np.testing.assert_allclose(states[moving, 1], rate - deceleration * time, atol=1e-9)
    assert np.all(states[~moving][1:, 1] == 0.0)
    assert states[-1, 0] == pytest.approx(0.5 * rate * stop, rel=1e-6)


def test_a_ramped_torque_breaks_the_axis_away_at_stiction() -> None:
    plant = _plant()
    axis = plant.axis
    coulomb = axis.coulomb_torque * axis.friction_torque_per_ampere * axis.gear_ratio
    ramp = 1e5  # N m/s

    def inputs(t: float) -> np.ndarray:
        u = np.zeros((len(structure.INPUT), 2))
        u[structure.INPUT.external_torque] = ramp * t, ramp
        return u

    breakaway = axis.stiction_ratio * coulomb / ramp
    first = math.floor(breakaway / H)
    states = _simulate(plant, np.zeros(8), 0, first + 2, inputs=inputs)
    assert np.all(states[:first + 1, :2] == 0.0)
    # from the breakaway to the next step the excess over the Coulomb torque accelerates the hub
    dt = (first + 1) * H - breakaway
    gained = ((axis.stiction_ratio - 1.0) * coulomb * dt + 0.5 * ramp * dt * dt)
    assert states[first + 1, 1] == pytest.approx(gained / axis.inertia_hub, rel=1e-4)


def test_modes_of_a_held_hub_ring_at_their_own_frequency_and_damping() -> None:
    plant = _plant(coulomb_torque=1e3)
    x0 = np.zeros(8)
    x0[2::2] = 1e-6
    states = _simulate(plant, x0, 0, 2000)
    time = np.arange(2001) * H
    for j in range(3):
        zeta = plant.axis.mode_damping_ratios[j]
        omega = 2.0 * math.pi * plant.axis.mode_frequencies[j]
        damped = omega * math.sqrt(1.0 - zeta ** 2)
        expected = 1e-6 * np.exp(-zeta * omega * time) * (
            np.cos(damped * time) + zeta * omega / damped * np.sin(damped * time))
        np.testing.assert_allclose(states[:, 2 + 2 * j], expected, atol=1e-12)


def test_a_free_structure_rings_at_the_frequencies_of_its_eigenvalue_problem() -> None:
    plant = _plant(coulomb_torque=0.0, mode_damping_ratios=(0.0,) * 3)
    axis = plant.axis
    stiffness = np.array(axis.mode_inertias) * (2 * math.pi * np.array(axis.mode_frequencies)) ** 2
    mass = np.diag([axis.inertia_hub, *axis.mode_inertias])
    spring = np.diag([stiffness.sum(), *stiffness])
    spring[0, 1:] = spring[1:, 0] = -stiffness
    squared, shapes = scipy.linalg.eigh(spring, mass)
    for omega, shape in zip(np.sqrt(squared[1:]), shapes.T[1:]):
        x0 = np.zeros(8)
        x0[0::2] = shape / np.abs(shape).max() * 1e-6
        states = _simulate(plant, x0, 1, 1000)
        # a free hub turns back and forth: it slips without friction, at a rate of either sign
        expected = x0[0] * np.cos(omega * np.arange(1001) * H)
        np.testing.assert_allclose(states[:, 0], expected, atol=2e-3 * abs(x0[0]))


@settings(max_examples=60)
@given(st.lists(st.floats(-1e-3, 1e-3), min_size=8, max_size=8), st.floats(0.0, 3.0))
def test_energy_never_grows_without_input(x0: list[float], coulomb: float) -> None:
    plant = _plant(coulomb_torque=coulomb)
    start = np.array(x0)
    slip = int(np.sign(start[1]))
    energy = _energy(plant, _simulate(plant, start, slip, 400))
    assert np.all(np.diff(energy) <= 1e-9 * energy[0] + 1e-12)


def test_energy_is_conserved_without_friction_and_damping() -> None:
    plant = _plant(coulomb_torque=0.0, mode_damping_ratios=(0.0,) * 3)
    x0 = np.array([0.0, 1e-3, 1e-5, -1e-3, 2e-5, 0.0, 0.0, 1e-3])
    energy = _energy(plant, _simulate(plant, x0, 1, 2000))
    assert np.max(np.abs(energy / energy[0] - 1.0)) < 1e-6


def test_the_outputs_of_fig_4() -> None:
    plant = _plant()
    unit = Stepped(structure.BLOCK, plant)
    unit.x[:] = 0.1, 2e-3, 0.1 + 1e-5, 2e-3, 0.1, 3e-3, 0.1 - 2e-5, 2e-3
    structure.read(unit.x, unit.mode, unit.u, 0.0, record_of(plant)[0], unit.y)
    y = {signal.name: row for signal, row in zip(structure.OUTPUTS, unit.y)}
    assert y['axis_angle'][0] == y['encoder'][0] == 0.1
    assert y['axis_rate'][0] == y['axis_angle'][1] == 2e-3
    assert y['pinion_rate'][0] == pytest.approx(plant.axis.gear_ratio * 2e-3)
    elevation, cross = y['pointing_error_elevation'], y['pointing_error_cross_elevation']
    assert elevation[0] == pytest.approx(1.0 * 1e-5 + 0.3 * -2e-5)
    assert cross[0] == pytest.approx(0.1 * 1e-5 + 0.3 * -2e-5)
    assert elevation[1] == pytest.approx(0.6 * 1e-3)


def test_halving_the_step_divides_the_error_by_sixteen() -> None:
    plant = _plant(coulomb_torque=0.0)
    x0 = np.array([0.0, 1e-3, 1e-5, -1e-3, 2e-5, 0.0, 0.0, 1e-3])
    exact = _simulate(plant, x0, 1, 4000, h=2.5e-4)[-1]
    errors = [np.abs(_simulate(plant, x0, 1, round(1.0 / h), h=h)[-1] - exact).max()
              for h in (8e-3, 4e-3)]
    assert 12.0 < errors[0] / errors[1] < 20.0
