# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A first model of a robot joint: one stiff body in a position and a velocity loop.

  python make_logs.py asymmetry logs
  python first.py logs/*.csv          # checks the model, diagnoses the logs, designs the next test
"""

import sys

import numpy as np
from numpy.typing import NDArray
import simgap
from simgap import effect, free, known, push, reading, ripple, size, within
from simgap.parts import compiled, friction, loop, wave
from simgap.parts.friction import Friction
from simgap.parts.loop import Cascade

Array = NDArray[np.float64]


@compiled
def run(time: Array, reference: Array, torque: Array, cascade: Cascade, rubbing: Friction,
        constant: float, inertia: float, ripple: tuple[float, float, float], out: Array) -> None:
    """Write angle [rad] and current [A] at each sample into `out`."""
    angle, rate, integral = out[0, 0], 0.0, 0.0
    for k in range(time.size):
        step = time[min(k + 1, time.size - 1)] - time[min(k, time.size - 2)]
        current, integral = loop.cascade(cascade, reference[k], 0.0, angle, rate, integral, step)
        out[k, 0], out[k, 1] = angle, current
        for _ in range(4):
            h = step / 4
            driving = (constant * current + torque[k]
                       + wave(angle, ripple[0], ripple[1], ripple[2]))
            moving = friction.direction(rate, driving)
            rate = friction.rate_after(h, rate, driving, friction.level(rubbing, moving, 0., 0.),
                                       friction.drag(rubbing, moving), inertia)
            angle += h * rate


def simulate(n: simgap.Numbers, test: simgap.OneTest) -> dict[str, Array]:
    """Return the readings, had the joint these numbers."""
    out = np.zeros((test.time.size, 2))
    out[0, 0] = test['motor_rad'][0]
    run(test.time, test['reference_rad'], test.push['load'], Cascade(20.0, 200.0, 0.4, 0.05, 8.0),
        Friction(coulomb=n.coulomb, viscous=n.viscous, asymmetry=n.asymmetry), n.torque_constant,
        n.inertia, (n.ripple_order, n.ripple_cosine, n.ripple_sine), out)
    return {'angle': out[:, 0], 'current': out[:, 1]}


def sweep(duration_s: float, random: np.random.Generator) -> simgap.Log:
    """Return a test that the robot may be asked to do: it swings faster and faster."""
    time = np.arange(0.0, duration_s, 1e-3)
    swing = np.sin(random.uniform(0.5, 2.0) * time * (1.0 + time / 4.0))
    return simgap.Log('sweep', time, {'reference_rad': random.uniform(0.3, 2.0) * swing})


machine = simgap.declare(
    simulate,
    base={'inertia': within(5e-4, 0.1, 'kg m^2'), 'torque_constant': known(0.102, 'N m/A'),
          'coulomb': free(0.0, 0.2, 'N m'), 'viscous': free(0.0, 5e-3, 'N m s/rad')},
    readings={'angle': reading('rad', noise=2e-3, column='motor_rad'),
              'current': reading('A', noise=0.02, column='current_A')},
    effects=[effect('motor.friction_asymmetry', cause='friction depends on the direction',
                    asymmetry=size(-0.6, 0.6)),
             ripple('motor.ripple', 'ripple', size(-0.1, 0.1, 'N m'), 'motor_rad',
                    cause='slots and commutation push by angle')],
    push={'load': push('load', 'torque on the load', 'N m', 0.02)},
    tests={'sweep': sweep}, limits={'angle': 2.5, 'current': 8.0}, settles_s=0.4, parallel=True)

if __name__ == '__main__':
    logs = simgap.read_logs(sys.argv[1:])
    print(simgap.check(machine, logs).summary())
    verdict = simgap.diagnose(machine, logs)
    print(verdict.summary())
    proposal = simgap.propose(machine, verdict, duration_s=8.0)
    print('next test:', proposal.tests[0].family if proposal.tests else 'none helps')
