# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
One hinge of a robot's MJCF or URDF, with what hangs on it, as a machine of two small files.

All other joints stand still, so what hangs on the joint is one body: its mass, its inertia about
the joint, and where gravity pulls. Between motor and body is a twist, a joint of its own that a
tendon holds. The tendon is stiff, unless an effect makes it soft or gives it a gap. The texts are
joint_machine.yaml and joint_machine.xml, in which $words stand for what a robot's file says.
"""

from collections.abc import Iterator, Mapping, Sequence
import math
import os
from pathlib import Path
import re
from string import Template
from typing import Any

import mujoco
import numpy as np
from simgap.inputs.schema import mapping_of, nearest
from simgap.machine.contract import FloatArray
from simgap.model.declared import ModelError

# Dry friction that stops within a few steps: MuJoCo's own is so soft that a joint creeps.
DRY = {'solreffriction': '0.002 1', 'solimpfriction': '0.999 0.999 1'}
# The twist: a joint behind that of the motor, in one body with it, and the tendon that holds it.
TWIST = Template('<joint name="${joint}_twist" type="hinge" axis="$line" pos="$pos" armature="0" '
                 'damping="$loss" frictionloss="0" stiffness="0" limited="false"/>')
TEETH = Template('<tendon><fixed name="${joint}_teeth" stiffness="$stiffness" '
                 'springlength="$gap"><joint joint="${joint}_twist" coef="1"/></fixed></tendon>')

_STEP = 5e-4  # longest of the machine [s]
_STIFF, _LOSS = 0.4, 0.015  # turn of the stiffest twist in a step [rad]; its damping ratio
_ROTOR = 0.1  # inertia of a motor by that of its load, where the file does not know it


def robot(path: Path) -> mujoco.MjModel:
    """Return the model in an MJCF or URDF file; ModelError if there is none."""
    try:
        if path.suffix != '.urdf':
            return mujoco.MjModel.from_xml_path(str(path))
        # a URDF tells every inertia, and its meshes are seldom where MuJoCo looks for them
        return mujoco.MjModel.from_xml_string(re.sub(
            r'<(visual|collision)\b.*?</\1>', '', path.read_text(encoding='utf-8'), flags=re.S))
    except ValueError as error:
        raise ModelError(f'{path}: {error}') from None


def _servo(words: Sequence[str]) -> dict[str, float]:
    """Return kp [N m/rad], kv [N m s/rad] and limit [N m] of a drive, as far as they are told."""
    told, kinds = f'--drive {" ".join(words)}', {
        'position': ('kp', 'kv', 'limit'), 'ros2_control': ('p', 'd', 'u_clamp_max')}
    given = {name: value for name, _, value in (word.partition('=') for word in words[1:])}
    names = kinds.get(words[0], kinds['position'])
    try:
        found = {name: float(value) for name, value in mapping_of('', given, names).items()}
    except ValueError as error:
        raise ModelError(f'{told}: {error}') from None
    if words[0] not in kinds or not found.get(names[0], 0.0) > 0.0:
        raise ModelError(f'{told}: allowed are position kp=.. kv=.. limit=.. and ros2_control '
                         'p=.. d=.. u_clamp_max=.., the first one above 0')
    return {name: found[own] for name, own in zip(kinds['position'], names) if own in found}


def machine_of_joint(path: Path, joint: str, out: Path, drive: Sequence[str] = (),
                     rotor: float | None = None, pose: Mapping[str, float] | None = None,
                     columns: Sequence[str] = ()) -> dict[Path, str]:
    """
    Return the texts of a machine: of the YAML file `out`, and of the MJCF beside it.

    drive : words of the option of that name; none for the file's own actuator
    rotor : inertia of the motor as the joint feels it [kg m^2]; None for the file's armature
    pose : where other joints stand, by name [rad]
    columns : of the logs: reference, position and, if it is read, effort

    Raises ModelError, in a line, if that is no joint of which a machine can be made.
    """
    model = robot(path)
    number = _joint(model, joint, path)
    data = mujoco.MjData(model)
    for name, angle in (pose or {}).items():
        data.qpos[model.jnt_qposadr[_joint(model, name, path)]] = angle
    mujoco.mj_forward(model, data)
    words = {'joint': joint, 'file': path.name, 'xml': out.with_suffix('.xml').name,
             'path': os.path.relpath(path, out.parent),
             **dict(zip(('reference', 'position', 'effort'), columns, strict=False)),
             **_body(model, data, number, rotor)}
    words |= _drive(model, number, _servo(drive) if drive else {}, words, path)
    told = {name: value if isinstance(value, str) else text_of(value)
            for name, value in words.items() if value is not None}
    told |= {'twist': TWIST.substitute(told), 'teeth': TEETH.substitute(told)}
    yaml, xml = (Path(__file__).with_name(f'joint_machine{suffix}').read_text(encoding='utf-8')
                 for suffix in ('.yaml', '.xml'))
    return {out.with_suffix('.xml'): Template(xml).substitute(told),
            out: '\n'.join(_entries(yaml, told))}


def _entries(text: str, words: Mapping[str, str]) -> Iterator[str]:
    """Yield the entries of a YAML; one with a $word that the robot's file lacks is left out."""
    for entry in re.split(r'\n(?=  \w|\w)', text):
        try:
            yield Template(entry).substitute(words)
        except KeyError:
            continue


def text_of(values: float | FloatArray) -> str:
    return ' '.join(f'{value:.9g}' for value in np.atleast_1d(values))


def _joint(model: mujoco.MjModel, name: str, path: Path) -> int:
    """Return the number of a hinge; ModelError if there is none."""
    hinges = {model.joint(k).name: k for k in range(model.njnt)
              if model.jnt_type[k] == mujoco.mjtJoint.mjJNT_HINGE}
    if name not in hinges:
        raise ModelError(f'{path}: no hinge {name}{nearest(name, hinges)}; there are '
                         f'{", ".join(hinges) or "none"}')
    return hinges[name]


def _body(model: mujoco.MjModel, data: mujoco.MjData, number: int,
          rotor: float | None) -> dict[str, Any]:
    """Return what hangs on a joint, and its friction and twist, as words of the texts."""
    freedom, body = model.jnt_dofadr[number], model.jnt_bodyid[number]
    column = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, column, np.eye(model.nv)[freedom])
    armature, coulomb, viscous = (float(values[freedom]) for values in (
        model.dof_armature, model.dof_frictionloss, model.dof_damping))
    line, mass, gravity = data.xaxis[number], model.body_subtreemass[body], model.opt.gravity
    arm = data.subtree_com[body] - data.xanchor[number]
    arm = arm - line * (line @ arm)  # what lies along the joint's line moves nothing
    moved, known = float(column[freedom]) - armature, rotor or armature
    rotor = known or _ROTOR * moved
    both = rotor * moved / (rotor + moved)
    step = min(float(model.opt.timestep), _STEP)
    stiffness = both * (_STIFF / step) ** 2
    loss = 2.0 * _LOSS * math.sqrt(stiffness * both)
    pull = float(mass * np.linalg.norm(np.cross(arm, gravity - line * (line @ gravity))))
    return {
        'line': line, 'pos': np.zeros(3), 'centre': arm, 'mass': mass, 'pull': pull,
        'inertia': max(moved - mass * float(arm @ arm), 1e-9), 'rotor': rotor, 'moved': moved,
        'rotor_share': 0.2 if known else 0.9,
        'rotor_known': 'as told' if known else 'guessed: give --rotor',
        'coulomb': coulomb, 'viscous': viscous, 'less': -coulomb, 'less_drag': -viscous,
        'heavy': 'gravity tells it' if pull > 1e-9 else None,
        'dry_known': "the file's" if coulomb else None, **DRY,
        'drag_known': "the file's" if viscous else None, 'gravity': gravity, 'step': step,
        'spring': model.jnt_stiffness[number].flat[0],
        'rest': model.qpos_spring[model.jnt_qposadr[number]],
        'integrator': 'Euler RK4 implicit implicitfast discrete'.split()[model.opt.integrator],
        'stiffness': stiffness, 'gap': '0 0', 'loss': loss, 'much_loss': 50.0 * loss,
        # a healthy gearbox may be twice as soft as the stiffest, the softest swings at 5 Hz
        'rigid': 1.0 / stiffness, 'soft': 1.0 / (both * (2.0 * math.pi * 5.0) ** 2)}


def _drive(model: mujoco.MjModel, number: int, told: Mapping[str, float],
           words: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return what moves a joint as words of the texts: as told, or else the file's actuator."""
    gain, bias, gear, limit = told.get('kp', 0.0), np.zeros(3), 1.0, told.get('limit', 0.0)
    bias[1:] = -gain, -told.get('kv', 0.0)
    if not told:
        own = [k for k in range(model.nu) if model.actuator_trntype[k] == 0
               and model.actuator_trnid[k, 0] == number]
        if len(own) != 1 or model.actuator_dyntype[own[0]]:
            raise ModelError(f'{path}: {len(own)} actuators of {words["joint"]}, wanted is one '
                             'without dynamics; give --drive position kp=.. kv=.. limit=..')
        k, gear = own[0], float(model.actuator_gear[own[0], 0])
        gain, bias = float(model.actuator_gainprm[k, 0]), model.actuator_biasprm[k, :3]
        limit = float(model.actuator_forcerange[k, 1]) * model.actuator_forcelimited[k]
    if model.jnt_actfrclimited[number]:
        limit = min(limit or math.inf, float(model.jnt_actfrcrange[number, 1]) / abs(gear))
    stiff = -bias[1] * gear ** 2
    torque = limit * abs(gear) or max(0.3 * stiff, words['pull']) or 1.0
    attributes: dict[str, float | FloatArray] = {'gear': gear, 'gainprm': gain, 'biasprm': bias}
    if limit:
        attributes['forcerange'] = np.array([-limit, limit])
    return {
        'drive': 'biastype="affine" ' + ' '.join(
            f'{name}="{text_of(value)}"' for name, value in attributes.items()),
        'some': 0.3 * torque, 'some_drag': 0.3 * torque, 'little': 0.1 * torque,
        'nudge': 0.04 * torque, 'noise': 1e-3, 'effort_noise': 0.01 * torque,
        'settles': max(0.1, 10.0 * math.sqrt((words['rotor'] + words['moved']) / stiff))
        if stiff > 0.0 else 0.5,
        'limited': 0.5 if limit else None, 'sure': 0.02 if stiff > 0.0 else None,
        'rate_sure': 0.02 if bias[2] else None, 'effort_sure': 0.05 if 'effort' in words else None}
