# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A MuJoCo model as a machine: against closed forms, and what is told of mistakes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from simgap.model import check_model, load_model, Log, ModelError, OwnMachine

pytest.importorskip('mujoco', reason="mujoco is not installed, see the extra 'mujoco'")

# An oscillator of 2 kg m^2, 8 N m/rad and 0.4 N m s/rad: 2 rad/s, damped with 0.1 1/s.
MJCF = """\
<mujoco>
  <option timestep="0.002" integrator="RK4" gravity="0 0 0"/>
  <worldbody><body name="disc">
    <joint name="hinge" axis="0 0 1" armature="1.999" stiffness="8" damping="0.4"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.001 0.001 0.001"/>
  </body></worldbody>
  <actuator><motor name="motor" joint="hinge" gear="2"/></actuator>
  <sensor>
    <jointpos name="angle" joint="hinge"/><jointvel name="rate" joint="hinge"/>
    <framepos name="place" objtype="body" objname="disc"/>
  </sensor>
</mujoco>
"""
YAML = """\
mujoco: disc.xml
inputs: {motor: torque}
starts: {joint.hinge.qpos: angle}
base:
  inertia: {share: 0.2, unit: kg m^2, sets: joint.hinge.armature}
readings:
  angle: {unit: rad, noise: 1.0e-3}
  rate: {unit: rad/s, noise: 1.0e-3}
effects:
  disc.damping: {numbers: {damping: {size: [0.0, 1.0], adds: joint.hinge.damping}}}
  disc.soft: {numbers: {soft: {size: [0.0, 0.1], adds_to_inverse: joint.hinge.stiffness}}}
push:
  disc: {label: torque on the disc, unit: N m, size: 0.8, into: hinge}
"""


def log_of(torque: float = 0.0, start: float = 0.3) -> Log:
    time = np.arange(5.0, 15.0, 0.01)
    course = free_course(time - 5.0, start, 0.4, 8.0, 2.0)
    return Log('turn', time, {'torque': np.full(time.size, torque), 'angle': course[0],
                              'rate': course[1]})


def free_course(time: np.ndarray, start: float, damping: float, stiffness: float,
                inertia: float) -> tuple[np.ndarray, np.ndarray]:
    """Return angle and rate of the oscillator that is let go at an angle."""
    decay = 0.5 * damping / inertia
    turn = np.sqrt(stiffness / inertia - decay ** 2)
    angle = start * np.exp(-decay * time) * (np.cos(turn * time)
                                             + decay / turn * np.sin(turn * time))
    rate = -start * np.exp(-decay * time) * (turn + decay ** 2 / turn) * np.sin(turn * time)
    return angle, rate


def machine_of(folder: Path, log: Log, yaml: str = YAML, mjcf: str = MJCF) -> OwnMachine:
    (folder / 'disc.xml').write_text(mjcf)
    (folder / 'disc.yaml').write_text(yaml)
    return OwnMachine(load_model(f'{folder}/disc.yaml'), [log])


@pytest.mark.parametrize(('point', 'damping', 'stiffness', 'inertia'), [
    ({}, 0.4, 8.0, 2.0), ({'inertia': 0.3}, 0.4, 8.0, 2.3),
    ({'disc.damping.damping': 0.6}, 1.0, 8.0, 2.0),
    ({'disc.soft.soft': 0.05}, 0.4, 1.0 / (1.0 / 8.0 + 0.05), 2.0)])
def test_an_oscillator_moves_as_its_closed_form(
        point: dict[str, float], damping: float, stiffness: float, inertia: float,
        tmp_path: Path) -> None:
    log = log_of()
    found = machine_of(tmp_path, log).predict(point, 0)
    angle, rate = free_course(log.time - 5.0, 0.3, damping, stiffness, inertia)
    np.testing.assert_allclose(found, np.column_stack([angle, rate]), atol=2e-8)


def test_inputs_and_pushes_turn_it(tmp_path: Path) -> None:
    """A constant torque moves the rest; a motor's has a gear of 2."""
    log = log_of(torque=0.4)
    machine = machine_of(tmp_path, log)
    moved = 0.1 + free_course(log.time - 5.0, 0.2, 0.4, 8.0, 2.0)[0]
    np.testing.assert_allclose(machine.predict({}, 0)[:, 0], moved, atol=2e-8)
    pushed = machine.simulate_disturbed({}, machine.disturbance_inputs[0], [np.ones_like])[0]
    moved = 0.2 + free_course(log.time - 5.0, 0.1, 0.4, 8.0, 2.0)[0]
    np.testing.assert_allclose(pushed[:, 0], moved, atol=2e-8)


def test_neither_inputs_nor_pushes_are_needed(tmp_path: Path) -> None:
    log = log_of()
    yaml = YAML.replace('inputs: {motor: torque}\n', '').partition('push:')[0]
    expected = np.column_stack(free_course(log.time - 5.0, 0.3, 0.4, 8.0, 2.0))
    np.testing.assert_allclose(machine_of(tmp_path, log, yaml).predict({}, 0), expected,
                               atol=2e-8)


def test_runs_leave_nothing_behind_in_any_thread(tmp_path: Path) -> None:
    machine = machine_of(tmp_path, log_of())
    points = [{}, {'inertia': 0.3}, {'disc.damping.damping': 0.6}, {}]
    alone = [machine.predict(point, 0) for point in points]
    np.testing.assert_array_equal(alone[0], alone[3])
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda point: machine.predict(point, 0), 4 * points))
    for k, one in enumerate(found):
        np.testing.assert_array_equal(one, alone[k % 4])


def test_check_model_finds_nothing_wrong(tmp_path: Path) -> None:
    log = log_of(torque=0.4)
    checked = check_model(machine_of(tmp_path, log).model, [log])
    assert checked.faults == []


def test_a_run_that_diverges_ends_in_no_number(tmp_path: Path) -> None:
    mjcf = MJCF.replace('stiffness="8"', 'stiffness="1e9"').replace('RK4', 'Euler')
    found = machine_of(tmp_path, log_of(), mjcf=mjcf).predict({}, 0)
    assert not np.isfinite(found[-1]).any()


@pytest.mark.parametrize(('old', 'new', 'words'), [
    ('sets: joint.hinge.armature', 'sets: joint.hindge.armature',
     'base.inertia.sets: joint.hindge.armature: no joint hindge, did you mean hinge?'),
    ('sets: joint.hinge.armature', 'sets: joint.hinge.armour', 'no number armour in joint'),
    ('sets: joint.hinge.armature', 'sets: jont.hinge.armature', 'did you mean joint'),
    ('sets: joint.hinge.armature', 'sets: armature', 'give KIND.NAME.FIELD'),
    ('sets: joint.hinge.armature', 'sets: body.disc.inertia', 'give inertia[0] to [2]'),
    ('sets: joint.hinge.armature', 'sets: option.timestep', 'give step_s'),
    ('adds: joint.hinge.damping', 'adds: joint.hinge.type', 'no number type in joint'),
    ('{motor: torque}', '{engine: torque}', 'inputs: no actuator engine'),
    ('  angle: {', '  angel: {column: angle, ', 'readings.angel: no sensor angel, did you mean'),
    ('  angle: {', '  angle: {from: place, ', 'sensor place has 3 values'),
    ('into: hinge', 'into: disc', 'push.disc: no joint disc'),
])
def test_a_name_that_the_file_lacks_is_told(old: str, new: str, words: str,
                                            tmp_path: Path) -> None:
    with pytest.raises(ModelError) as refusal:
        machine_of(tmp_path, log_of(), YAML.replace(old, new, 1))
    assert str(refusal.value).startswith(f'{tmp_path}/disc.yaml: ')
    assert words in str(refusal.value)


def test_a_file_that_is_no_mjcf_is_told(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match='disc.xml: .*XML'):
        machine_of(tmp_path, log_of(), mjcf='<mujoco>')


def test_fields_with_several_values_and_options_are_places(tmp_path: Path) -> None:
    yaml = YAML.replace('joint.hinge.armature', '"body.disc.inertia[2]"').replace(
        'adds: joint.hinge.damping', 'adds: "option.gravity[1]"').replace(
        'starts: {joint.hinge.qpos: angle}', 'starts: {joint.hinge.qvel: rate}')
    mjcf = MJCF.replace('armature="1.999"', '').replace('0.001 0.001 0.001', '2 2 2')
    log = log_of()
    started = Log('turn', log.time, {**log.columns, 'rate': np.full(log.time.size, 0.5)})
    found = machine_of(tmp_path, started, yaml, mjcf).predict({'inertia': 0.2}, 0)
    decay, inertia = 0.2 / 2.2, 2.2
    turn = np.sqrt(8.0 / inertia - 0.25 * (0.4 / inertia) ** 2)
    time = log.time - 5.0
    expected = 0.5 / turn * np.exp(-decay * time) * np.sin(turn * time)
    np.testing.assert_allclose(found[:, 0], expected, atol=2e-8)
