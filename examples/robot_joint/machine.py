# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A robot joint: a motor behind a gear, in a position and a velocity loop. All at the motor."""

import math

import numpy as np
from numpy.typing import NDArray
from simgap.model import (
    effect, free, known, machine as own_machine, Numbers, OneTest, push, reading, ripple, size,
    within,
)
from simgap.parts import compiled, coupling, friction, loop, shaping, wave
from simgap.parts.friction import Friction
from simgap.parts.loop import Cascade

Array = NDArray[np.float64]

TEETH = 1e-3    # compliance of a gearbox in good order [rad/(N m)]


@compiled
def run(time: Array, reference: Array, pushes: tuple[Array, Array, Array], cascade: Cascade,
        rubbing: Friction, constant: float, motor: float, load: float, compliance: float,
        half_gap: float, delay: float, ripple: tuple[float, float, float], out: Array) -> None:
    """Write motor angle [rad] and current [A] at each sample into `out`."""
    on_motor, in_gear, on_load = pushes
    q = ql = out[0, 0]
    w = wl = integral = 0.0
    place = 0
    stiffness = 1.0 / (TEETH + compliance)
    damping = 0.02 * math.sqrt(stiffness * motor)
    for k in range(time.size):
        out[k, 0] = q
        step = time[min(k + 1, time.size - 1)] - time[min(k, time.size - 2)]
        wanted, place = shaping.held(time, reference, time[k] - delay, place)
        out[k, 1], integral = loop.cascade(cascade, wanted, 0.0, q, w, integral, step)
        count = coupling.steps_for(step, stiffness, damping, motor, load)
        h = step / count
        for _ in range(count):
            shaft = in_gear[k] + coupling.tooth_torque(
                q - ql, w - wl, half_gap, stiffness, damping)
            driving = (constant * out[k, 1] + on_motor[k]
                       + wave(q, ripple[0], ripple[1], ripple[2]) - shaft)
            moving = friction.direction(w, driving)
            w = friction.rate_after(h, w, driving, friction.level(rubbing, moving, 0.0, q),
                                    friction.drag(rubbing, moving), motor)
            wl += h * (shaft + on_load[k]) / load
            q += h * w
            ql += h * wl


def simulate(n: Numbers, test: OneTest) -> dict[str, Array]:
    """Return the readings, had the joint these numbers."""
    out = np.zeros((test.time.size, 2))
    out[0, 0] = n.start
    run(test.time, test['reference_rad'],
        (test.push['motor'], test.push['gearbox'], test.push['load']),
        Cascade(n.position_gain, 200.0, n.velocity_gain, 0.05, 8.0),
        Friction(coulomb=n.coulomb, viscous=n.viscous, asymmetry=n.asymmetry, stribeck=n.stribeck,
                 stribeck_rate=0.5), n.torque_constant, n.motor, n.load, n.compliance, n.half_gap,
        n.delay, (n.ripple_order, n.ripple_cosine, n.ripple_sine), out)
    return {'motor_angle': out[:, 0], 'current': out[:, 1]}


machine = own_machine(
    simulate,
    base={'motor': known(2e-4, 'kg m^2'), 'load': within(3e-4, 0.1, 'kg m^2'),
          'torque_constant': within(0.1, 0.05, 'N m/A'), 'coulomb': free(0.0, 0.2, 'N m'),
          'viscous': free(0.0, 5e-3, 'N m s/rad'), 'position_gain': known(20.0, '1/s'),
          'velocity_gain': known(0.4, 'A s/rad')},
    per_test={'start': free(-0.1, 0.1, 'rad', start=0.0)},
    readings={'motor_angle': reading('rad', noise=2e-3, column='motor_rad'),
              'current': reading('A', noise=0.02, column='current_A')},
    effects=[
        effect('gearbox.compliance', cause='gear and shaft twist',
               compliance=size(0.0, 1.0, 'rad/(N m)', tolerance=0.2 * TEETH)),
        effect('gearbox.backlash', cause='there is a gap between the teeth',
               half_gap=size(0.0, 0.2, 'rad', step=2e-3)),
        effect('motor.friction_asymmetry', cause='friction depends on the direction',
               asymmetry=size(-0.6, 0.6)),
        effect('motor.stribeck', cause='grease carries only in motion',
               stribeck=size(0.0, 0.2, 'N m')),
        ripple('motor.ripple', 'ripple', size(-0.1, 0.1, 'N m'), 'motor_rad',
               cause='slots and commutation push by angle'),
        effect('controller.delay', cause='the bus takes time',
               delay=size(0.0, 0.02, 's', step=1e-3)),
    ],
    push={'motor': push('motor', 'torque on the motor', 'N m', 0.02),
          'gearbox': push('gearbox', 'torque in the gear', 'N m', 0.02),
          'load': push('load', 'torque on the load', 'N m', 0.02)},
    settles_s=0.4, blocks=('controller', 'motor', 'gearbox', 'load'), parallel=True)
