# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The joint of joint.xml and joint.c in Python: a motor, a shaft, a load, a position servo."""

import math

import numpy as np
from numpy.typing import NDArray
from simgap.model import (
    effect, free, machine as own_machine, Numbers, OneTest, push, reading, size, within,
)
from simgap.parts import compiled, friction, shaping

Array = NDArray[np.float64]

MOTOR, STIFFNESS, DAMPING = 2e-4, 50.0, 2e-3     # kg m^2, N m/rad, N m s/rad
GAIN, RATE_GAIN, LIMIT = 0.8, 0.04, 0.5          # N m/rad, N m s/rad, N m
LONGEST = 2e-5                                   # of a step [s]


@compiled
def run(time: Array, reference: Array, push: Array, load: float, coulomb: float, viscous: float,
        compliance: float, half_gap: float, load_friction: float, delay: float,
        out: Array) -> None:
    """Write motor angle [rad] and torque [N m] at each sample into `out`."""
    q = w = ql = wl = 0.0
    place = 0
    stiffness = 1.0 / (1.0 / STIFFNESS + compliance)
    for k in range(time.size):
        step = time[min(k + 1, time.size - 1)] - time[min(k, time.size - 2)]
        count = math.ceil(step / LONGEST)
        h = step / count
        for i in range(count):
            asked, place = shaping.held(time, reference, time[k] + i * h - delay, place)
            torque = shaping.limited(GAIN * (asked - q) - RATE_GAIN * w, LIMIT)
            if i == 0:
                out[k, 0], out[k, 1] = q, torque
            twist = q - ql
            shaft = (stiffness * (twist - shaping.limited(twist, half_gap))
                     + DAMPING * (w - wl))
            before, load_before = w, wl
            w = friction.rate_after(h, w, torque - shaft, coulomb, viscous, MOTOR)
            wl = friction.rate_after(h, wl, shaft + push[k], load_friction, 0.0, load)
            q += 0.5 * h * (before + w)
            ql += 0.5 * h * (load_before + wl)


def simulate(n: Numbers, test: OneTest) -> dict[str, Array]:
    """Return the readings, had the joint these numbers."""
    out = np.zeros((test.time.size, 2))
    run(test.time, test['reference_rad'], test.push['load'], n.load, n.coulomb, n.viscous,
        n.compliance, n.half_gap, n.load_friction, n.delay, out)
    return {'motor_angle': out[:, 0], 'torque': out[:, 1]}


machine = own_machine(
    simulate,
    base={'load': within(3e-4, 0.1, 'kg m^2'),
          'coulomb': free(0.0, 0.1, 'N m', start=0.03),
          'viscous': free(0.0, 5e-3, 'N m s/rad', start=8e-4)},
    readings={'motor_angle': reading('rad', noise=1e-3, column='motor_rad'),
              'torque': reading('N m', noise=5e-3, column='torque_Nm')},
    effects=[
        effect('gearbox.compliance', cause='gear and shaft twist',
               compliance=size(0.0, 1.0, 'rad/(N m)')),
        effect('gearbox.backlash', cause='there is a gap between the teeth',
               half_gap=size(0.0, 0.1, 'rad', step=1e-3)),
        effect('load.friction', cause='the bearings of the load rub',
               load_friction=size(0.0, 0.1, 'N m')),
        effect('controller.delay', cause='the bus takes time',
               delay=size(0.0, 0.02, 's', step=1e-3)),
    ],
    push={'load': push('load', 'torque on the load', 'N m', 0.02)},
    settles_s=0.4, blocks=('controller', 'motor', 'gearbox', 'load'), parallel=True)
