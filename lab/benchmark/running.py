# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A machine of mjcf.py under its controller, tick by tick, and what MuJoCo has no element for.

The controller is that of the joints' trial, which the data sheet describes. Friction that varies
with direction, place or time is MuJoCo's own friction, whose level is set anew in each tick.
"""

import math
from types import SimpleNamespace
from typing import Any

from lab.benchmark.mjcf import mjcf, Numbers, STEP_S
from lab.joints.mechanism import demanded, FloatArray, TICK_S
import numpy as np

# Where a motor's LuGre keeps its levels: Coulomb, and at rest.
_LUGRE = slice(3, 5)
_DEMANDED: Any = getattr(demanded, 'py_func', demanded)


def simulate(name: str, n: Numbers, asked: FloatArray, start: float, begin: int,
             wind: FloatArray) -> dict[str, FloatArray]:
    """
    Return what the sensors see at each tick from 0 on: 'position' and 'current', shape (n,).

    `asked` [rad or m] and `wind`, what pushes the last body [N m or N], hold one number a tick,
    shape (begin + n,); the first `begin` ticks pass before the recording. The machine rests at
    `start` [rad or m].
    """
    import mujoco  # installed by who makes cases
    model = mujoco.MjModel.from_xml_string(mjcf(name, n))
    data = mujoco.MjData(model)
    last = 'load' if name == 'joint' else 'motor'
    for place in {'motor', last}:
        data.joint(place).qpos = start
    if n.get('gravity'):
        data.joint('link').qpos = start / n['gear']
    last_dof = model.joint(last).dofadr[0]
    parts, digit = round(TICK_S / STEP_S), n['digit']
    history, clips = np.zeros((2, asked.size)), n.get('clips', math.inf)
    sheet = SimpleNamespace(**{'dead_zone': 0.0, **n})
    # the controller of the data sheet is compiled into another simulation; here it is Python
    before, integral = digit * math.floor(_encoder(n, -1.0, start) / digit + 0.5), 0.0
    for k in range(asked.size):
        t = (k - begin) * TICK_S
        read = _encoder(n, t, data.qpos[0])
        history[:, k] = read, min(max(data.act[0], -clips), clips)
        read = digit * math.floor(read / digit + 0.5)
        demand, integral = _DEMANDED(sheet, asked[k], read, before, integral)
        before = read
        if not (n.get('lost_every') and t % n['lost_every'] < n['lost_for']):
            data.ctrl[0] = demand
        _follow(model, n, t, data)
        data.qfrc_applied[last_dof] = wind[k] + n.get('shake', 0.0) * math.sin(
            2.0 * math.pi * n.get('shake_hz', 0.0) * t)
        mujoco.mj_step(model, data, parts)
    return {'position': history[0, begin:], 'current': history[1, begin:]}


def _encoder(n: Numbers, t: float, position: float) -> float:
    """Return what the encoder reads before its digit [rad or m]."""
    wave = n.get('encoder_error', 0.0) * math.sin(
        n.get('encoder_cycles', 1.0) * position + n.get('encoder_phase', 0.0))
    return position + wave + n.get('slip', 0.0) * (t >= n.get('slip_at', 0.0))


def _follow(model: Any, n: Numbers, t: float, data: Any) -> None:
    """Set the numbers that follow time, direction and place until the next tick."""
    if n.get('warming'):
        lost = n['warming'] * (1.0 - math.exp(-max(t, 0.0) / n['warming_time']))
        model.actuator_gear[0, 0] = n['constant'] * (1.0 - lost)
    if not any(n.get(key) for key in ('asymmetry', 'slope', 'spot', 'brake')):
        return
    position, rate = data.qpos[0], data.qvel[0]
    # at rest the drive pulls one way
    way = rate if abs(rate) > 1e-4 * n['rate_limit'] else data.qfrc_actuator[0]
    level = n['coulomb'] * (1.0 + n.get('asymmetry', 0.0) * math.copysign(1.0, way))
    level *= max(1.0 + n.get('slope', 0.0) * position, 0.05)
    if n.get('spot'):
        away = (position - n['spot_at']) / n['spot_width']
        level *= 1.0 + n['spot'] * math.exp(-away * away)
    if n.get('brake') and n['brake_from'] < t < n['brake_until']:
        level += n['brake']
    if n.get('bristles'):
        model.actuator_biasprm[1, _LUGRE] = level, level + n.get('stribeck', 0.0)
    else:
        model.dof_frictionloss[0] = level
