# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A linear axis: a carriage on a ball screw under a position loop over a velocity loop."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from simgap.model import (
    effect, free, known, Log, machine as own_machine, Numbers, OneTest, push, reading, ripple,
    shape, size, within, without_gaps,
)
from simgap.parts import compiled, friction, harmonics, loop, shaping
from simgap.parts.friction import Friction
from simgap.parts.loop import Cascade

Array = NDArray[np.float64]
# Order, and the amplitudes of two harmonics.
Wave = tuple[float, tuple[float, float, float, float]]

TICK = 1e-3     # of the controller [s]
PARTS = 2       # steps of the integration in a tick
LEAD = 5e-3     # of the screw [m/rev]


@compiled
def run(reference: Array, ticks: int, push: Array, cascade: Cascade, rubbing: Friction,
        mass: float, slope: float, distance: float, spring: float, constant: float, lag: float,
        delay: float, ripple: Wave, cyclic: Wave, flowing: float, x: float, bent: float,
        out: Array) -> None:
    """Write position [m] and current [A] at each tick into `out`."""
    v, before, integral = 0.0, x, 0.0
    past = np.full(out.shape[0], flowing)
    for k in range(out.shape[0]):
        row = max(k - 1, 0) // ticks
        asked = reference[max(row - 1, 0)]
        if k > 0:
            asked += (reference[row] - asked) * (k - row * ticks) / ticks
        angle = 2.0 * math.pi / LEAD * x
        read = x + harmonics(angle, cyclic[0], cyclic[1])
        out[k, 0], out[k, 1] = read, flowing
        rate = (read - before) / TICK if k > 0 else 0.0
        before = read
        past[k], integral = loop.cascade(cascade, asked, 0.0, read, rate, integral, TICK)
        demand = shaping.delayed(past, k, delay / TICK)
        h = TICK / PARTS
        for _ in range(PARTS):
            current, flowing = shaping.lagged_mean(flowing, demand, lag, h)
            x += 0.5 * h * v
            angle = 2.0 * math.pi / LEAD * x
            driving = (constant * current + push[row] - spring * x
                       + harmonics(angle, ripple[0], ripple[1]))
            moving = friction.direction(v, driving)
            share = max(1.0 + slope * x, 0.05)
            level = share * friction.level(rubbing, moving, 0.0, angle)
            if distance > 0.0:
                bent = friction.presliding(bent, v, distance, h)
                driving -= level * bent
                level = 0.0
            v = friction.rate_after(h, v, driving, level, friction.drag(rubbing, moving), mass)
            x += 0.5 * h * v


def simulate(n: Numbers, test: OneTest) -> dict[str, Array]:
    """Return the readings, had the axis these numbers."""
    time, reference = test.time, test['reference_m']
    ticks = max(round(float(np.median(np.diff(time))) / TICK), 1)
    out = np.zeros(((time.size - 1) * ticks + 1, 2))
    run(reference, ticks, test.push['carriage'],
        Cascade(30.0, 0.4, 100.0, 0.0, 12.0 * (1.0 + n.limit_change)),
        Friction(coulomb=n.coulomb * n.coulomb_share, viscous=n.viscous * n.viscous_share,
                 asymmetry=n.asymmetry,
                 stribeck=n.stribeck, stribeck_rate=n.stribeck_rate, stribeck_shape=1.0),
        n.mass * (1.0 + n.mass_change), n.friction_slope, n.presliding, n.spring,
        n.constant * (1.0 + n.constant_change), n.current_lag, n.delay,
        (n.ripple_order, (n.ripple_cosine, n.ripple_sine, n.ripple_cosine_2, n.ripple_sine_2)),
        (n.cyclic_order, (n.cyclic_cosine, n.cyclic_sine, n.cyclic_cosine_2, n.cyclic_sine_2)),
        -3000.0 * n.start, reference[0] + n.start, -3000.0 * n.start * n.constant / n.coulomb, out)
    keep = math.exp(-TICK / max(n.current_filter, 1e-9))
    out[:, 1] = lfilter([1.0 - keep], [1.0, -keep], out[:, 1], zi=keep * out[:1, 1])[0]
    at = np.arange(time.size) * float(ticks)
    return {'position': np.interp(at - n.position_late * ticks, np.arange(len(out)), out[:, 0]),
            'current': np.interp(at - n.current_late * ticks, np.arange(len(out)), out[:, 1])}


def tidy(log: Log) -> Log:
    """Return a log with even rows, and the angle of the screw."""
    log = without_gaps(log, ('reference_m',), settles_s=0.5)
    angle = 2.0 * math.pi / LEAD * log['position_m']
    return Log(log.name, log.time, {**log.columns, 'screw_rad': angle}, log.constants, log.labels)


machine = own_machine(
    simulate,
    base={'mass': within(60.0, 0.05, 'kg'), 'constant': within(60.0, 0.03, 'N/A'),
          'coulomb': within(25.0, 0.3, 'N'), 'viscous': within(150.0, 0.4, 'N s/m'),
          'current_lag': within(5e-4, 0.5, 's'),
          # the recorder asks one channel after the other
          'current_filter': known(0.0, 's'), 'coulomb_share': known(1.0),
          'viscous_share': known(1.0), 'position_late': free(0.0, 1.0, 'sample'),
          'current_late': free(0.0, 1.0, 'sample')},
    per_test={'start': free(-2.5e-4, 2.5e-4, 'm')},
    readings={'position': reading('m', noise=2e-6, model_error=5e-6, column='position_m'),
              'current': reading('A', noise=0.03, model_error=0.015, zero=0.02, gain=0.01,
                                 column='current_A')},
    effects=[
        effect('guide.friction_asymmetry', cause='friction depends on the direction',
               asymmetry=size(-0.9, 0.9)),
        effect('guide.stribeck', cause='grease carries only in motion',
               stribeck=size(0.0, 80.0, 'N'),
               stribeck_rate=shape(0.001, 0.1, 0.01, 'm/s', step=2e-4)),
        effect('guide.tight_end', cause='the guide is tighter at one end',
               friction_slope=size(-8.0, 8.0, '1/m')),
        effect('guide.presliding', cause='friction builds up over a distance after a reversal',
               presliding=size(0.0, 6e-4, 'm', tolerance=3e-6, step=1e-6)),
        effect('cable.spring', cause='a cable pulls to the middle',
               spring=size(-600.0, 600.0, 'N/m')),
        ripple('screw.ripple', 'ripple', size(-50.0, 50.0, 'N'), 'screw_rad',
               orders=(1.0, 2.0), harmonics=2, cause='a bent screw pushes by angle'),
        effect('drive.force_constant', cause='the magnet is weaker',
               constant_change=size(-0.7, 0.5)),
        effect('drive.delay', cause='the bus takes time',
               delay=size(0.0, 0.01, 's', step=2e-4)),
        effect('drive.current_limit', cause='the drive gives less current',
               limit_change=size(-0.85, 0.5)),
        effect('carriage.mass', cause='a payload', mass_change=size(-0.5, 2.0)),
        ripple('scale.cyclic_error', 'cyclic', size(-2e-4, 2e-4, 'm'), 'screw_rad',
               orders=(1.0, 2.0), harmonics=2, cause='the encoder sits off the axis of the screw'),
    ],
    push={'carriage': push('carriage', 'force on the carriage', 'N', 5.0)},
    settles_s=0.3, judged_hz=100.0, blocks=('drive', 'screw', 'guide', 'carriage', 'scale'),
    parallel=True, log=tidy)
