# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
EMPS: a carriage on a ball screw, driven by a DC motor in a position loop.

The model is that of A. Janot, M. Gautier, M. Brunot, 'Data set and reference models of EMPS': one
mass with symmetric friction. The effects are what it may lack. lab/notebook/emps.md has what is
found.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from simgap.model import (
    effect, free, machine as own_machine, Numbers, OneTest, push, reading, ripple, shape, size,
    within,
)
from simgap.parts import compiled, friction, shaping, wave
from simgap.parts.friction import Friction

Array = NDArray[np.float64]

POSITION_GAIN, VELOCITY_GAIN = 160.18, 243.45    # of the loop [1/s], [V s/m]
FORCE_PER_VOLT, VOLT_LIMIT = 35.15, 10.0         # of the drive [N/V], [V]
LEAD = 0.005                                     # of the screw [m/rev]
MIDDLE = 0.12                                    # of the travel [m]
PARTS = 2                                        # steps of the integration in a sample


@compiled
def run(time: Array, reference: Array, added: Array, force: Array, mass: float,
        rubbing: Friction, slope: float, distance: float, offset: float, spring: float,
        rate: float, gain: float, lag: float, ripple: tuple[float, float, float],
        out: Array) -> None:
    """Write the carriage's position at each sample [m] into `out`; all in SI units."""
    position, before, before_that = out[0], out[0] - 1e-3 * rate, out[0] - 2e-3 * rate
    end, bent = 0.0, 1.0
    for k in range(time.size - 1):
        step = time[k + 1] - time[k]
        asked = shaping.limited(
            POSITION_GAIN * VELOCITY_GAIN * (reference[k] - position)
            - VELOCITY_GAIN * (position - before_that) / (2.0 * step) + added[k], VOLT_LIMIT)
        before_that, before = before, position
        for _ in range(PARTS):
            h = step / PARTS
            volt, end = shaping.lagged_mean(end, asked, lag, h)
            angle = 2.0 * math.pi / LEAD * position
            driving = (FORCE_PER_VOLT * (1.0 + gain) * volt + force[k] - offset
                       - spring * (position - MIDDLE)
                       + wave(angle, ripple[0], ripple[1], ripple[2]))
            moving = friction.direction(rate, driving)
            share = 1.0 + slope * (position - MIDDLE)
            level = share * friction.level(rubbing, moving, 0.0, angle)
            if distance > 0.0:
                bent = friction.presliding(bent, rate, distance, h)
                driving -= level * bent
                level = 0.0
            rate = friction.rate_after(h, rate, driving, level,
                                       share * friction.drag(rubbing, moving), mass)
            position += h * rate
        out[k + 1] = position


def simulate(numbers: Numbers, test: OneTest) -> dict[str, Array]:
    """Return the position, had the machine these numbers."""
    n = numbers
    out = np.empty(test.time.size)
    out[0] = test['position_m'][0]
    rubbing = Friction(
        coulomb=n.coulomb, viscous=n.viscous, viscous_asymmetry=n.viscous_asymmetry,
        thinning=n.thinning, thinning_rate=0.1, stribeck=n.stribeck,
        stribeck_rate=n.stribeck_rate, stribeck_shape=1.0)
    # a voltage that is known to have been added; the logs as recorded have no such column
    added = test['added_V'] if 'added_V' in test.log.columns else np.zeros(test.time.size)
    run(test.time, test['reference_m'], added, test.push['force'], n.mass, rubbing,
        n.friction_slope, n.presliding, n.offset, n.spring, n.start_rate, n.gain, n.lag,
        (n.ripple_order, n.ripple_cosine, n.ripple_sine), out)
    return {'position': out}


machine = own_machine(
    simulate,
    base={
        'mass': within(95.11, 0.05, 'kg'),
        'viscous': within(203.5, 0.8, 'N s/m'),
        'coulomb': within(20.39, 0.8, 'N'),
        'lag': free(0.0, 2e-3, 's', start=0.0),  # of the current, not given
        'offset': within(-3.165, by=4.0, unit='N'),
    },
    per_test={'start_rate': free(0.0, 0.02, 'm/s')},
    readings={'position': reading('m', noise=2e-7, digit=1e-7, model_error=5e-7,
                                  column='position_m')},
    effects=[
        effect('guide.friction_asymmetry', cause='friction depends on the direction',
               viscous_asymmetry=size(-0.6, 0.6)),
        effect('guide.thinning', cause='grease thins as it is sheared', thinning=size(0.0, 0.8)),
        effect('guide.stribeck', cause='grease carries only in motion',
               stribeck=size(0.0, 20.0, 'N'), stribeck_rate=shape(0.002, 0.1, 0.02, 'm/s')),
        effect('guide.presliding', cause='friction builds up over a distance after a reversal',
               presliding=size(0.0, 2e-4, 'm', step=1e-6)),
        effect('guide.friction_by_position', cause='the guide is tighter at one end',
               friction_slope=size(-2.0, 2.0, '1/m')),
        effect('cable.spring', cause='a cable or a slope pushes towards one end',
               spring=size(-100.0, 100.0, 'N/m')),
        ripple('motor.torque_ripple', 'ripple', size(-8.0, 8.0, 'N'),
               lambda log: 2.0 * math.pi / LEAD * log['position_m'],
               cause='slots, commutation or a bent screw push by angle'),
        effect('drive.gain', cause='force per volt differs', gain=size(-0.2, 0.2)),
    ],
    push={'force': push('carriage', 'force', 'N', 5.0)},
    settles_s=0.3,
    judged_hz=100.0,
    blocks=('controller', 'drive', 'motor', 'guide', 'carriage'),
    parallel=True,
)
