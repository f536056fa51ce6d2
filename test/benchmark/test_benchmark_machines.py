# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The machines by MuJoCo: closed forms, the joints' second program, and what each effect does."""

from __future__ import annotations

import math
from typing import Any

from lab.benchmark.cases import asked_at_ticks, base_prediction, draw_truths, make_recording, moved
from lab.benchmark.mjcf import mjcf
from lab.benchmark.running import simulate
from lab.joints.cases import moved as moved_by_the_second_program
from lab.joints.machines import BENCHMARK, kind_of
import numpy as np
import pytest

mujoco = pytest.importorskip('mujoco', reason="mujoco is not installed, see the extra 'mujoco'")

STILL = {'coulomb': [1.0] * 4, 'viscous': [1.0] * 4, 'wind': 0.0, 'filter': 0.0}


def truth_of(machine: str, **more: Any) -> dict[str, Any]:
    """Return a nominal machine without effects and days, with short tests."""
    truth = draw_truths(4, 2, [machine])[0]
    for test in truth['tests']:
        test['duration_s'] = 6.0
    return {**truth, 'effects': [], 'deviations': {}, 'nuisances': STILL, **more}


def numbers_of(machine: str, **more: float) -> dict[str, float]:
    """Return the data sheet's numbers, some of them changed."""
    return {**kind_of(machine).numbers({}, [], 1.0), **more}


def test_a_free_joint_turns_as_its_closed_form() -> None:
    # a constant current turns both bodies together; the shaft is stiff beside their inertia
    n = numbers_of('mujoco_joint', coulomb=0.0, viscous=0.0, current_limit=0.5)
    asked = np.full(401, 1e3)
    found = simulate('joint', n, asked, 0.0, 0, np.zeros(401))
    time = 1e-3 * np.arange(401)
    inertia = n['motor'] + n['load']
    # the current, and with it the rate, is late by its lag
    angle = 0.5 * n['constant'] * 0.5 / inertia * (time - n['current_lag']) ** 2
    assert found['current'][100:] == pytest.approx(0.5, rel=1e-6)
    assert found['position'][200:] == pytest.approx(angle[200:], rel=5e-3)


def test_a_carriage_slides_to_rest_as_its_closed_form() -> None:
    # kicked by wind, without a drive: Coulomb friction takes the same from the rate each second
    n = numbers_of('mujoco_axis', viscous=0.0, current_limit=0.0)
    wind = np.zeros(1001)
    wind[:100] = 625.0
    position = simulate('axis', n, np.zeros(1001), 0.0, 0, wind)['position']
    rate = (625.0 - 25.0) / 60.0 * 0.1
    assert np.gradient(position, 1e-3)[100] == pytest.approx(rate, rel=0.01)
    assert np.gradient(position, 1e-3)[600] == pytest.approx(rate - 25.0 / 60.0 * 0.5, rel=0.01)


def test_weight_pulls_by_the_angle_of_the_link() -> None:
    n = numbers_of('mujoco_joint', coulomb=0.0, viscous=0.0, current_limit=0.0, gravity=0.05,
                   gravity_phase=0.7)
    position = simulate('joint', n, np.zeros(61), 3.0, 0, np.zeros(61))['position']
    pull = 0.05 * math.sin(3.0 / 30.0 + 0.7) / (n['motor'] + n['load'])
    # the link adds 1 percent of inertia, and the shaft swings about the mean
    assert position[60] - 3.0 == pytest.approx(0.5 * pull * 0.06 ** 2, rel=0.1)


def test_a_soft_shaft_swings_at_its_frequency() -> None:
    n = numbers_of('mujoco_joint', coulomb=0.0, viscous=0.0, damping=0.0, current_limit=0.0)
    model = mujoco.MjModel.from_xml_string(mjcf('joint', n))
    data = mujoco.MjData(model)
    data.joint('motor').qpos = 0.01
    twist = []
    for _ in range(4000):
        mujoco.mj_step(model, data)
        twist.append(data.joint('motor').qpos[0] - data.joint('load').qpos[0])
    turns = np.flatnonzero(np.diff(np.sign(twist)) > 0.0)
    frequency = (turns.size - 1) / ((turns[-1] - turns[0]) * model.opt.timestep)
    exact = math.sqrt(8.0 * (1.0 / 2e-4 + 1.0 / 3e-4)) / (2.0 * math.pi)
    assert frequency == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize('machine', BENCHMARK)
def test_healthy_machines_of_both_programs_differ_by_noise_at_most(machine: str) -> None:
    truth, noise = truth_of(machine), kind_of(machine).table['noise']
    for recording in range(3):
        found = moved(truth, recording, 0.0)[2]
        other = moved_by_the_second_program({**truth, 'machine': BENCHMARK[machine]}, recording,
                                            0.0)[2]
        for name, values in found.items():
            # the scale of the axis is finer than its friction is alike
            assert np.sqrt(np.mean((values - other[name]) ** 2)) < 1.5 * noise[name]


@pytest.mark.parametrize('machine', BENCHMARK)
def test_every_effect_shows_and_stays_finite(machine: str) -> None:
    kind, random, truth = kind_of(machine), np.random.default_rng(0), truth_of(machine)
    assert len(kind.catalogue) >= 10 and len(kind.outside) >= 10
    healthy = moved(truth, 0, 0.0)[2]
    for key, cause in {**kind.catalogue, **kind.outside}.items():
        effects = [{'id': key, 'size': 1.0, 'parameters': cause.draw(1.0, random)}]
        found = moved({**truth, 'effects': effects}, 0, 0.0)[2]
        change = max(float(np.sqrt(np.mean((found[name] - healthy[name]) ** 2)))
                     / kind.table['noise'][name] for name in found)
        # the law of the controller is that of the task, so a stop need not be reached in each test
        assert np.isfinite(change) and (change > 1.0 or key in (
            'outside.soft_stop', 'outside.lost_commands')), key


def test_the_base_model_has_none_of_the_effects() -> None:
    for machine, name in BENCHMARK.items():
        model = mujoco.MjModel.from_xml_string(mjcf(name, numbers_of(machine)))
        assert model.nu == 1 and model.neq == 0 and model.njnt == (2 if name == 'joint' else 1)
        assert not model.jnt_stiffness.any() and not model.actuator_delay.any()
        assert not model.tendon_lengthspring.any() and not model.tendon_frictionloss.any()
        assert not model.dof_dampingpoly.any() and not model.tendon_stiffnesspoly.any()


def test_the_drive_goes_from_sample_to_sample_one_sample_late() -> None:
    found = asked_at_ticks(np.array([0.0, 4.0, 4.0]), 4, 2)
    assert found.tolist() == [0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4]


def test_a_recording_has_the_digits_of_the_recorder_and_the_kept_test_a_base() -> None:
    truth = draw_truths(4, 3, ['mujoco_joint'])[1]
    for test in truth['tests']:
        test['duration_s'] = 3.0
    columns = make_recording(truth, 0)
    for name, digit in (('motor_rad', 9.58738e-5), ('current_A', 0.004)):
        steps = columns[name] / digit
        assert steps == pytest.approx(np.round(steps), abs=1e-6)
    base = base_prediction(truth, 3)
    assert set(base) == set(columns) - {'reference_rad'}
    assert base['time_s'].size == base['current_A'].size
