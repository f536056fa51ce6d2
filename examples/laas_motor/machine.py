# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A brushless motor without a gear, under proportional control of its speed.

The logs are those of LAAS (github.com/heitor-andrade/laas_anti_cogging, BSD-3-Clause). The data
sheet is what its log with acceleration and braking says: torque over inertia, friction. Nothing
here knows that a motor cogs, or that the controller may add a current against it: `along` alone
offers the position. lab/notebook/laas.md has what is found.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from simgap.model import free, Log, machine, Numbers, OneTest, push, reading, within
from simgap.parts import compiled

Array = NDArray[np.float64]

GAIN, LIMIT = 0.09, 2.0     # of the controller [A s/rad], [A]
TICK, BEHIND = 1e-3, 2      # of the controller [s]; its ticks from a speed to the current


@compiled
def run(reference: Array, added: Array, strength: float, viscous: float, dry: float, late: float,
        start: float, out: Array) -> None:
    """Write the speed that is read into `out` [rad/s]; `strength` is in rad/(s^2 A)."""
    rate, before = start, start
    for k in range(out.size):
        out[k] = (1.0 - late) * rate + late * before
        asked = GAIN * (reference[k] - out[max(k - BEHIND, 0)])
        driving = min(max(asked, -LIMIT), LIMIT) + added[k]
        before = rate
        rubbing = dry if rate > 0.0 else -dry
        rate += TICK * (strength * (driving - rubbing) - viscous * rate)


def closed_loop(numbers: Numbers, test: OneTest) -> dict[str, Array]:
    """Return the speed of motor and controller."""
    n, out = numbers, np.empty(test.time.size)
    run(test['reference'], test.push['cogging'], n.strength, n.viscous, n.dry, n.late,
        n.start, out)
    return {'speed': out}


def from_speed(numbers: Numbers, test: OneTest) -> dict[str, Array]:
    """Return the current that the controller asks for at the speed that was read."""
    seen = np.roll(test['speed'], BEHIND)
    seen[:BEHIND] = seen[BEHIND]
    asked = GAIN * (1.0 + numbers.gain) * (test['reference'] - seen)
    return {'current': np.clip(asked, -LIMIT, LIMIT)}


def even(log: Log) -> Log:
    """Return a log at the controller's ticks: its stamps are those of a computer."""
    ticks = np.arange(log.time.size, dtype=np.float64)
    return Log(log.name, TICK * ticks, log.columns, labels=log.labels)


motor = machine(
    closed_loop,
    base={'strength': within(5184.0, 0.05, 'rad/(s^2 A)'), 'viscous': within(0.46, 0.5, '1/s'),
          'dry': within(0.085, 0.3, 'A'), 'late': free(0.0, 1.0, '1', start=0.6)},
    per_test={'start': free(-10.0, 20.0, 'rad/s', start=6.28)},
    readings={'speed': reading('rad/s', noise=0.3)},
    push={'cogging': push('motor', 'torque on the rotor', 'A', 0.05)},
    settles_s=0.2, judged_hz=1000.0, along={'position': 'rad'}, log=even, parallel=True)

controller = machine(
    from_speed, base={'gain': within(0.0, by=0.05)},
    readings={'current': reading('A', noise=0.01)},
    settles_s=0.2, judged_hz=1000.0, along={'position': 'rad'}, log=even, parallel=True)
