# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A joint of an MJCF or URDF as a machine, and its corrected file replayed in plain MuJoCo."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
import pytest
from simgap.cli import main
from simgap.inputs.xml_text import XmlText
from simgap.machine.contract import FloatArray
from simgap.model import load_model, Log, OwnMachine
from simgap.verdict.record import Verdict

mujoco = pytest.importorskip('mujoco', reason="mujoco is not installed, see the extra 'mujoco'")

MJCF = """\
<mujoco model="arm">
  <!-- A joint as a user has it: two bodies, a shape, a keyframe. -->
  <option timestep="0.001"/>
  <worldbody>
    <body name="link" pos="0 0 1">
      <joint name="elbow" axis="0 1 0"
             armature='2e-3' frictionloss="0.02" damping="0.01"/>  <!-- from the data sheet -->
      <inertial pos="0.1 0 0" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/>
      <body name="tool" pos="0.2 0 0"><inertial pos="0 0 0" mass="0.1"
            diaginertia="1e-4 1e-4 1e-4"/></body>
    </body>
  </worldbody>
  <actuator>
    <position name="servo" joint="elbow" kp="8" kv="0.4" forcerange="-2 2"/>
  </actuator>
  <keyframe><key name="home" qpos="0.1"/></keyframe>
</mujoco>
"""
URDF = """\
<robot name="arm">
  <link name="base"/>
  <link name="link">
    <inertial><origin xyz="0.1 0 0"/><mass value="0.2"/>
      <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://arm/missing.stl"/></geometry></visual>
  </link>
  <link name="tool">
    <inertial><mass value="0.1"/>
      <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="elbow" type="revolute">
    <parent link="base"/><child link="link"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="2" velocity="9"/>  <!-- from the data sheet -->
    <dynamics friction="0.02" damping="0.01"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="link"/><child link="tool"/>
    <origin xyz="0.2 0 0"/></joint>
</robot>
"""
TIME: FloatArray = 0.002 * np.arange(700, dtype=np.float64)
# at rest at first: a delay of MuJoCo begins with a control of 0
REFERENCE = np.where(TIME < 0.1, 0.0, np.where(TIME % 0.5 < 0.25, 0.5, -0.1))
LOG = Log('steps', TIME, {'reference': REFERENCE, 'position': 0.0 * TIME, 'effort': 0.0 * TIME})
# What was asked for: how far a replay may be from the prediction, as a share of its range.
APART = 0.02


def made(folder: Path, robot: str = MJCF, *options: str) -> tuple[OwnMachine, Path]:
    """Return the machine that the command line makes of a robot, and its file."""
    path = folder / ('arm.urdf' if robot.startswith('<robot') else 'arm.xml')
    path.write_text(robot)
    out = folder / 'elbow.yaml'
    assert main(['machine-from', str(path), '--joint', 'elbow', *options, '--out', str(out)]) == 0
    return OwnMachine(load_model(str(out)), [LOG]), out


def replayed(mjcf: Path) -> NDArray[np.float64]:
    """Return angle and torque of the joint in plain MuJoCo, held from sample to sample."""
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    data = mujoco.MjData(model)
    steps = round(0.002 / model.opt.timestep)
    found = np.empty((TIME.size, 2))
    joint = model.joint('elbow')
    for k, asked in enumerate(REFERENCE):
        data.ctrl[0] = asked
        for i in range(steps):
            before = data.qpos[joint.qposadr[0]]
            mujoco.mj_step(model, data)
            if i == 0:
                found[k] = before, data.qfrc_actuator[joint.dofadr[0]]
    return found


def corrected(machine: OwnMachine, yaml: Path, target: Path,
              point: dict[str, float]) -> list[tuple[str, float, float, str]]:
    """Write the file that a verdict with a point corrects; return what is said of each number."""
    from simgap.model.corrected import corrected, found_of, source_of
    verdict = SimpleNamespace(machine=machine, best=SimpleNamespace(
        state=SimpleNamespace(point=lambda: point)))
    source, joint = source_of(yaml, target)
    data, rows = corrected(source, found_of(cast(Verdict, verdict), joint))
    target.write_bytes(data)
    return rows


@pytest.mark.parametrize(('robot', 'options'), [
    (MJCF, []), (URDF, ['--drive', 'position', 'kp=8', 'kv=0.4', '--rotor', '2e-3']),
    (URDF, ['--drive', 'ros2_control', 'p=8', 'd=0.4', '--rotor', '2e-3'])])
def test_what_hangs_on_a_joint_moves_as_the_robot_does(robot: str, options: list[str],
                                                       tmp_path: Path) -> None:
    """Inertia by Steiner's theorem, and the static torque of gravity, by hand."""
    machine, out = made(tmp_path, robot, *options)
    model = mujoco.MjModel.from_xml_path(str(out.with_suffix('.xml')))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = 1e-3 + 0.2 * 0.1 ** 2 + 1e-4 + 0.1 * 0.2 ** 2
    column = np.zeros(2)
    mujoco.mj_mulM(model, data, column, np.array([0.0, 1.0]))
    np.testing.assert_allclose(column, inertia, rtol=1e-6)
    np.testing.assert_allclose(data.qfrc_bias, -9.81 * (0.2 * 0.1 + 0.1 * 0.2), rtol=1e-6)
    assert model.dof_armature[0] == 2e-3 and model.actuator_forcerange[0].tolist() == [-2.0, 2.0]
    names = {effect.name for effect in machine.model.effects}
    assert {'gearbox.backlash', 'motor.ripple', 'joint.stribeck', 'encoder.zero'} <= names


FAULTS: dict[str, dict[str, float]] = {
    'nothing': {}, 'friction': {'joint.friction.friction': 0.05, 'viscous': 0.002},
    'compliance': {'gearbox.compliance.compliance': 0.1},
    'backlash': {'gearbox.backlash.half_gap': 0.03}, 'delay': {'controller.delay.delay': 0.0075},
    'limit': {'drive.limit.limit_share': -0.5}, 'gain': {'controller.gain.gain_share': 0.4},
    'rate gain': {'controller.rate_gain.rate_gain_share': -0.5},
    'mass': {'link.mass.mass_share': 0.8, 'rotor': 2e-4},
}


@pytest.mark.parametrize('fault', FAULTS)
def test_a_corrected_file_does_what_was_predicted(fault: str, tmp_path: Path) -> None:
    """In plain MuJoCo, within two percent of the range of angle and torque."""
    machine, yaml = made(tmp_path)
    rows = corrected(machine, yaml, tmp_path / 'fixed.xml', FAULTS[fault])
    assert [name for name, _, _, where in rows if not where] == []
    predicted = machine.predict(FAULTS[fault], 0)
    apart = np.sqrt(np.mean((replayed(tmp_path / 'fixed.xml') - predicted) ** 2, axis=0))
    assert (apart < APART * np.ptp(predicted, axis=0)).all(), apart / np.ptp(predicted, axis=0)
    if fault != 'nothing':
        # or the test would pass without a correction
        uncorrected = replayed(tmp_path / 'arm.xml') - predicted
        assert (np.sqrt(np.mean(uncorrected ** 2, axis=0)) > 1.5 * apart).any()


def test_a_corrected_file_differs_only_where_something_was_found(tmp_path: Path) -> None:
    machine, yaml = made(tmp_path)
    corrected(machine, yaml, tmp_path / 'fixed.xml', {
        'joint.friction.friction': 0.03, 'gearbox.backlash.half_gap': 0.02})
    before, after = MJCF.splitlines(), (tmp_path / 'fixed.xml').read_text().splitlines()
    kept = [line for line in before if line in after]
    assert [line for line in before if line not in after] == [
        '  <option timestep="0.001"/>', before[6], before[15]]
    assert [line for line in after if line in before] == kept
    assert '''armature='2e-3' frictionloss="0.05"''' in after[6].replace('"0.002"', "'2e-3'")
    assert after[6].endswith('<!-- from the data sheet -->')
    assert after[7].strip().startswith('<joint name="elbow_twist"')
    assert 'qpos="0.1 0"' in after[16]
    mujoco.MjModel.from_xml_path(str(tmp_path / 'fixed.xml'))


def test_a_corrected_urdf_says_what_it_can(tmp_path: Path) -> None:
    machine, yaml = made(tmp_path, URDF, '--drive', 'position', 'kp=8', 'kv=0.4')
    rows = corrected(machine, yaml, tmp_path / 'fixed.urdf', {
        'joint.friction.friction': 0.03, 'link.mass.mass_share': 0.5,
        'drive.limit.limit_share': -0.5, 'controller.delay.delay': 0.004})
    assert {name for name, _, _, where in rows if not where} == {'delay'}
    from simgap.model.robot_joint import robot
    model = robot(tmp_path / 'fixed.urdf')
    assert model.dof_frictionloss.tolist() == [0.05] and model.dof_damping.tolist() == [0.01]
    assert model.jnt_actfrcrange.tolist() == [[-1.0, 1.0]]
    np.testing.assert_allclose(model.body_mass[1], 0.45)
    assert (tmp_path / 'fixed.urdf').read_text().count('\n') == URDF.count('\n')


def test_laws_that_mujoco_lacks_act(tmp_path: Path) -> None:
    """Steady friction is the law's: a joint that follows a ramp needs that much more torque."""
    flat = MJCF.replace('<option timestep="0.001"/>', '<option timestep="0.001" gravity="0 0 0"/>')
    made(tmp_path, flat)
    ramp = Log('ramp', TIME, {'reference': 0.5 * TIME, 'position': 0.0 * TIME,
                              'effort': 0.0 * TIME})
    machine = OwnMachine(load_model(f'{tmp_path}/elbow.yaml'), [ramp])

    def torque(**point: float) -> Any:
        return machine.predict({name.replace('__', '.'): value for name, value in point.items()},
                               0)[400:, 1]

    # a reference that is held for a sample makes a small saw-tooth, which differences lack
    plain = torque()
    more = torque(joint__friction_asymmetry__asymmetry=0.5) - plain
    np.testing.assert_allclose(more, 0.5 * 0.02, rtol=0.01)
    more = torque(joint__load_friction__load_share=0.1) - plain
    np.testing.assert_allclose(more, (0.02 + 0.01 * 0.5) * (1.0 / 0.9 - 1.0), rtol=0.1)
    np.testing.assert_array_equal(torque(), plain)
    wavy = machine.predict({'motor.ripple.motor_ripple_cosine@8': 0.1}, 0)[400:]
    drive = wavy[:, 1] + 0.1 * np.cos(8.0 * wavy[:, 0])
    assert np.std(drive) < 0.5 * np.std(wavy[:, 1])


@pytest.mark.parametrize(('options', 'words'), [
    (['--joint', 'elbw'], 'no hinge elbw, did you mean elbow?'),
    (['--joint', 'elbow', '--drive', 'position', 'kp=x'], 'could not convert string to float'),
    (['--joint', 'elbow', '--drive', 'position', 'ki=1'], 'ki: no such entry'),
    (['--joint', 'elbow', '--drive', 'pid', 'kp=1'], 'allowed are position kp=..'),
    (['--joint', 'elbow', '--drive', 'position', 'kv=1'], 'the first one above 0')])
def test_mistakes_are_told_in_a_line(options: list[str], words: str, tmp_path: Path,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'arm.xml').write_text(MJCF)
    assert main(['machine-from', f'{tmp_path}/arm.xml', *options, '--out',
                 f'{tmp_path}/elbow.yaml']) == 2
    said = capsys.readouterr().err
    assert words in said and said.count('\n') == 1
    assert not (tmp_path / 'elbow.yaml').exists()


def test_text_keeps_what_is_not_changed() -> None:
    data = b'<!-- a > b --><a x = "1>2">\n  <b y=\'3\' /> <!-- c -->\n</a>\n'
    text = XmlText(data)
    assert bytes(text) == data
    text.change(text.root.find('b')[0], y='4', z='5')
    text.insert('<c/>', text.root.find('b')[0])
    assert bytes(text) == (b'<!-- a > b --><a x = "1>2">\n  <b y="4" z="5" /> <!-- c -->\n'
                           b'  <c/>\n</a>\n')
