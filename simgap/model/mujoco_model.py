# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A MuJoCo model (MJCF) as the simulation of a machine.

A place is KIND.NAME.FIELD, with [INDEX] where the field, of MuJoCo's mjModel without its prefix,
has several values: joint.motor.damping, actuator.servo.biasprm[1], joint.motor.qpos (where it
starts), or option.gravity[2]. What MuJoCo lacks is law.JOINT.FIELD: a number of the friction of a
hinge or slide, `parts.friction.Friction`, beside the joint's own frictionloss and damping, or
ripple_order, ripple_cosine, ripple_sine, of a wave of torque by its angle.
"""

from collections.abc import Iterable
import copy
from pathlib import Path
import re
from threading import local

import mujoco
from mujoco.rollout import Rollout
import numpy as np
from simgap.inputs.schema import nearest
from simgap.machine.contract import FloatArray
from simgap.model.declared import ModelError
from simgap.model.simulator import Ports
from simgap.parts import friction, wave

_PLACE = re.compile(r'(?P<kind>\w+)\.(?:(?P<name>.+)\.)?(?P<field>\w+)(?:\[(?P<index>\d+)\])?')
# Prefixes of the arrays of mjModel, and the kind by which an object is found.
_KINDS = {
    'joint': ('jnt_', mujoco.mjtObj.mjOBJ_JOINT), 'body': ('body_', mujoco.mjtObj.mjOBJ_BODY),
    'geom': ('geom_', mujoco.mjtObj.mjOBJ_GEOM), 'site': ('site_', mujoco.mjtObj.mjOBJ_SITE),
    'tendon': ('tendon_', mujoco.mjtObj.mjOBJ_TENDON),
    'actuator': ('actuator_', mujoco.mjtObj.mjOBJ_ACTUATOR),
    'equality': ('eq_', mujoco.mjtObj.mjOBJ_EQUALITY)}
# Coordinates and degrees of freedom of a joint of each type: free, ball, slide, hinge.
_COORDINATES, _FREEDOMS = (7, 4, 1, 1), (6, 3, 1, 1)
# Fields of the state, in which a run starts.
_STARTS = ('qpos', 'qvel', 'act')
_STATE = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
# What MuJoCo says of a run that diverges.
_DIVERGED = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL,
             mujoco.mjtWarning.mjWARN_BADQACC)
# A law is Friction's numbers but for coulomb and viscous, which the joint has, and a ripple.
_LAW = {**{name: value for name, value in friction.Friction._field_defaults.items()
           if name not in ('coulomb', 'viscous')},
        'ripple_order': 1.0, 'ripple_cosine': 0.0, 'ripple_sine': 0.0}
# Those of which one that is not 0 lets it act.
_SIZES = [not name.endswith(('_rate', '_shape', '_order')) for name in _LAW]
_INPUTS = int(mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_QFRC_APPLIED)

# A fit also tries numbers with which a run diverges. MuJoCo would write each to standard error
# and to a file in the working directory.
mujoco.set_mju_user_warning(lambda text: None)


class MujocoModel:
    """
    A simulation with an MJCF file; see `Simulator`.

    Inputs are actuators, pushes joints, outputs sensors with one value. Raises ModelError if the
    file cannot be read, or lacks a port.
    """

    parallel = True

    def __init__(self, path: Path, ports: Ports) -> None:
        try:
            self._model = mujoco.MjModel.from_xml_path(str(path))
        except ValueError as error:
            raise ModelError(f'{path}: {error}') from None
        # a run that diverges ends in NaN, and does not begin again
        self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.longest_step_s = float(self._model.opt.timestep)
        self._places = tuple(ports.places)
        spare = _Worker(self._model)
        self.defaults = np.array([float(spare.cell(place, key)[0])
                                  for place, key in ports.places.items()])
        # since MuJoCo 4 an actuator may have several controls; its first one is meant
        controls = getattr(self._model, 'actuator_ctrladr', range(self._model.nu))
        actuators = [controls[_id(self._model, mujoco.mjtObj.mjOBJ_ACTUATOR, 'actuator', *item)]
                     for item in ports.inputs.items()]
        joints = [_id(self._model, mujoco.mjtObj.mjOBJ_JOINT, 'joint', *item)
                  for item in ports.pushes.items()]
        self._columns = [*actuators, *(self._model.nu + self._model.jnt_dofadr[joints])]
        self._sensors = [self._sensor(*item) for item in ports.outputs.items()]
        self._local = local()

    def run(self, values: FloatArray, start_s: float, step_s: float,
            inputs: FloatArray) -> FloatArray:
        if not hasattr(self._local, 'worker'):
            self._local.worker = _Worker(self._model, self._places)
        controls = np.zeros((len(inputs), self._model.nu + self._model.nv))
        controls[:, self._columns] = inputs
        return self._local.worker.run(values, start_s, step_s, controls)[:, self._sensors]

    def _sensor(self, name: str, key: str) -> int:
        found = _id(self._model, mujoco.mjtObj.mjOBJ_SENSOR, 'sensor', name, key,
                    f'add one such as <sensor><jointpos name="{name}" joint="..."/></sensor>')
        if self._model.sensor_dim[found] != 1:
            raise ModelError(f'{key}: sensor {name} has {self._model.sensor_dim[found]} values, '
                             'allowed is 1')
        return int(self._model.sensor_adr[found])


class _Worker:
    """A model and its data that one thread uses, run after run."""

    def __init__(self, model: mujoco.MjModel, places: Iterable[str] = ()) -> None:
        self._model = copy.copy(model)
        self._data = mujoco.MjData(self._model)
        self._laws: dict[int, FloatArray] = {}  # by joint
        cells = [(place, self.cell(place, '')) for place in places]
        self._parameters = [(k, cell) for k, (place, cell) in enumerate(cells)
                            if not _is_start(place)]
        self._starts = [(k, cell) for k, (place, cell) in enumerate(cells) if _is_start(place)]
        self._rollout = Rollout(nthread=0)

    def run(self, values: FloatArray, start_s: float, step_s: float,
            controls: FloatArray) -> FloatArray:
        """Return the data of all sensors at the beginning of each step, shape (n, sensors)."""
        for k, cell in self._parameters:
            cell[0] = values[k]
        self._model.opt.timestep = step_s
        mujoco.mj_setConst(self._model, self._data)
        mujoco.mj_resetData(self._model, self._data)
        for k, cell in self._starts:
            cell[0] = values[k]
        self._data.time = start_s
        state = np.empty(mujoco.mj_stateSize(self._model, _STATE))
        mujoco.mj_getState(self._model, self._data, state, _STATE)
        if any(law[_SIZES].any() for law in self._laws.values()):
            return self._stepped(controls)
        # a step reads the sensors before it moves the bodies
        _, sensors = self._rollout.rollout(self._model, self._data, state, controls[np.newaxis],
                                           control_spec=_INPUTS)
        found = np.asarray(sensors[0])
        if any(self._data.warning[kind].number for kind in _DIVERGED):
            found[round((self._data.time - start_s) / step_s):] = np.nan
        return found

    def _stepped(self, controls: FloatArray) -> FloatArray:
        """Return what `run` does, of a run in which laws give each step its friction."""
        model, data = self._model, self._data
        found = np.empty((len(controls), model.nsensordata))
        loss, damping = model.dof_frictionloss, model.dof_damping
        own = [(model.jnt_qposadr[joint], dof, loss[dof], damping[dof], friction.Friction(
            loss[dof], damping[dof], *law[:-3].tolist()), law[-3:].tolist())
            for joint, law in self._laws.items() for dof in (model.jnt_dofadr[joint],)]
        for k, row in enumerate(controls):
            data.ctrl[:], data.qfrc_applied[:] = row[:model.nu], row[model.nu:]
            for place, dof, _, _, law, ripple in own:
                angle, rate = data.qpos[place], data.qvel[dof]
                loss[dof] = friction.level(law, rate, data.qfrc_actuator[dof], angle)
                damping[dof] = friction.drag(law, rate)
                data.qfrc_applied[dof] += wave(angle, *ripple)
            mujoco.mj_step(model, data)
            found[k] = data.sensordata
        for _, dof, level, drag, *_ in own:
            loss[dof], damping[dof] = level, drag
        return found

    def cell(self, place: str, key: str) -> FloatArray:
        """Return a place's cell in model or data, shape (1,), to be written; or ModelError."""
        parts = _PLACE.fullmatch(place)
        if parts is None or (parts['name'] is None) != (parts['kind'] == 'option'):
            raise ModelError(f'{key}: {place}: give KIND.NAME.FIELD, such as joint.motor.damping, '
                             'or option.FIELD')
        values = self._field(place, key, parts['kind'], parts['name'], parts['field'])
        if values is None or values.dtype != np.float64:
            raise ModelError(f'{key}: {place}: no number {parts["field"]} in {parts["kind"]}; '
                             "the fields are those of MuJoCo's mjModel")
        index = int(parts['index'] or 0)
        if index >= values.size or (values.size > 1 and parts['index'] is None):
            raise ModelError(f'{key}: {place}: {parts["field"]} has {values.size} values; give '
                             f'{parts["field"]}[0] to [{values.size - 1}]')
        return values[index:index + 1]

    def _field(self, place: str, key: str, kind: str, name: str, field: str) -> FloatArray | None:
        """Return the values of a field of an object, shape (k,); None if there is none."""
        model = self._model
        if kind == 'option':
            found = getattr(model.opt, field, None)
            if field == 'timestep':
                raise ModelError(f'{key}: {place}: give step_s in the model file')
            return found if isinstance(found, np.ndarray) else None
        if kind == 'law' and field in _LAW:
            joint = _id(model, mujoco.mjtObj.mjOBJ_JOINT, 'joint', name, f'{key}: {place}')
            law = self._laws.setdefault(joint, np.array(list(_LAW.values())))
            return law[(at := list(_LAW).index(field)):at + 1]
        if kind not in _KINDS:
            raise ModelError(f'{key}: {place}: no such kind{nearest(kind, _KINDS)}; there are '
                             f'{", ".join(_KINDS)}, option, law with {", ".join(_LAW)}')
        prefix, code = _KINDS[kind]
        number = _id(model, code, kind, name, f'{key}: {place}')
        if kind == 'joint':
            shape = model.jnt_type[number]
            first, freedom = model.jnt_qposadr[number], model.jnt_dofadr[number]
            coordinates = slice(first, first + _COORDINATES[shape])
            freedoms = slice(freedom, freedom + _FREEDOMS[shape])
            if field in ('qpos', 'qvel'):
                return self._data.qpos[coordinates] if field == 'qpos' else (
                    self._data.qvel[freedoms])
            if field in ('qpos0', 'qpos_spring'):
                return getattr(model, field)[coordinates]
            if hasattr(model, f'dof_{field}'):
                return getattr(model, f'dof_{field}')[freedoms].reshape(-1)
        if kind == 'actuator' and field == 'act':
            first = model.actuator_actadr[number]
            return self._data.act[first:first + 1] if first >= 0 else None
        found = getattr(model, prefix + field, None)
        return found[number:number + 1].reshape(-1) if isinstance(found, np.ndarray) else None


def _is_start(place: str) -> bool:
    parts = _PLACE.fullmatch(place)
    return parts is not None and parts['field'] in _STARTS


def _id(model: mujoco.MjModel, kind: mujoco.mjtObj, word: str, name: str, key: str,
        remedy: str = 'name it in the MJCF file') -> int:
    """Return the index of an object; ModelError if the model has none of that name."""
    found = mujoco.mj_name2id(model, kind, name)
    if found < 0:
        names: list[str] = []
        while (known := mujoco.mj_id2name(model, kind, len(names))) is not None:
            names.append(known)
        raise ModelError(f'{key}: no {word} {name}{nearest(name, names)}; {remedy}')
    return int(found)
