# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A robot joint: motor, soft shaft and load, seen from the motor, under a cascaded loop."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from simgap.model import (
    effect, form, free, known, machine as own_machine, Numbers, OneTest, push, reading, ripple,
    shape, size, within, without_gaps,
)
from simgap.parts import compiled, coupling, friction, harmonics, loop, shaping, wave
from simgap.parts.friction import Friction
from simgap.parts.loop import Cascade

Array = NDArray[np.float64]
# Order, and the amplitudes of two harmonics.
Wave = tuple[float, tuple[float, float, float, float]]

TICK = 1e-3     # of the controller [s]
PARTS = 2       # steps of the integration in a tick
GEAR = 30.0


@compiled
def run(reference: Array, ticks: int, pushes: tuple[Array, Array, Array], cascade: Cascade,
        rubbing: Friction, bodies: tuple[float, float, float], shaft: tuple[float, float, float],
        hung: tuple[float, float], constant: float, lag: float, delay: float,
        ripple: Wave, weight: tuple[float, float], cyclic: Wave, integral: float, q: float,
        out: Array) -> None:
    """Write motor angle [rad] and current [A] at each tick into `out`."""
    on_motor, in_shaft, on_load = pushes
    motor, load, third = bodies
    stiffness, damping, half_gap = shaft
    ql = qh = q
    w = wl = wh = 0.0
    flowing, before = integral, q
    past = np.zeros(out.shape[0])
    for k in range(out.shape[0]):
        row = max(k - 1, 0) // ticks
        asked = reference[max(row - 1, 0)]
        if k > 0:
            asked += (reference[row] - asked) * (k - row * ticks) / ticks
        read = q + harmonics(q, cyclic[0], cyclic[1]) - cyclic[1][0] - cyclic[1][2]
        out[k, 0], out[k, 1] = read, flowing
        rate = (read - before) / TICK if k > 0 else 0.0
        before = read
        past[k], integral = loop.cascade(cascade, asked, 0.0, read, rate, integral, TICK)
        demand = shaping.delayed(past, k, delay / TICK)
        h = TICK / PARTS
        for _ in range(PARTS):
            current, flowing = shaping.lagged_mean(flowing, demand, lag, h)
            q, ql, qh = q + 0.5 * h * w, ql + 0.5 * h * wl, qh + 0.5 * h * wh
            twisting = in_shaft[row] + coupling.tooth_torque(
                q - ql, w - wl, half_gap, stiffness, damping)
            holding = hung[0] * (ql - qh) + hung[1] * (wl - wh)
            driving = (constant * current + on_motor[row] + harmonics(q, ripple[0], ripple[1])
                       - twisting)
            moving = friction.direction(w, driving)
            w = friction.rate_after(h, w, driving, friction.level(rubbing, moving, 0.0, q),
                                    friction.drag(rubbing, moving), motor)
            wl += h * (twisting + on_load[row] - holding
                       + wave(ql / GEAR, 1.0, weight[0], weight[1])) / load
            if third > 0.0:
                wh += h * holding / third
            q, ql, qh = q + 0.5 * h * w, ql + 0.5 * h * wl, qh + 0.5 * h * wh


def simulate(n: Numbers, test: OneTest) -> dict[str, Array]:
    """Return the readings, had the joint these numbers."""
    time, reference = test.time, test['reference_rad']
    ticks = max(round(float(np.median(np.diff(time))) / TICK), 1)
    out = np.zeros(((time.size - 1) * ticks + 1, 2))
    third = n.hung_share * n.load * (1.0 + n.load_change)
    turn = 2.0 * math.pi * n.hung_hz
    run(reference, ticks, (test.push['motor'], test.push['gearbox'], test.push['load']),
        Cascade(20.0, 200.0, 0.4, 0.1, 8.0 * (1.0 + n.limit_change)),
        Friction(coulomb=n.coulomb * n.coulomb_share, viscous=n.viscous * n.viscous_share,
                 asymmetry=n.asymmetry,
                 stribeck=n.stribeck, stribeck_rate=n.stribeck_rate, stribeck_shape=1.0),
        (n.motor, n.load * (1.0 + n.load_change) - third, third),
        (n.stiffness / (1.0 + n.softness), n.damping, n.half_gap),
        (third * turn ** 2, 2.0 * n.hung_damping * third * turn),
        n.constant * (1.0 + n.constant_change), n.current_lag, n.delay,
        (n.ripple_order, (n.ripple_cosine, n.ripple_sine, n.ripple_cosine_2, n.ripple_sine_2)),
        (n.weight_cosine, n.weight_sine),
        (n.cyclic_order, (n.cyclic_cosine, n.cyclic_sine, n.cyclic_cosine_2, n.cyclic_sine_2)),
        n.integral, reference[0] + n.start, out)
    keep = math.exp(-TICK / max(n.current_filter, 1e-9))
    out[:, 1] = lfilter([1.0 - keep], [1.0, -keep], out[:, 1], zi=keep * out[:1, 1])[0]
    at = np.arange(time.size) * float(ticks)
    return {'angle': np.interp(at - n.angle_late * ticks, np.arange(len(out)), out[:, 0]),
            'current': np.interp(at - n.current_late * ticks, np.arange(len(out)), out[:, 1])}


machine = own_machine(
    simulate,
    base={'motor': within(2e-4, 0.03, 'kg m^2', step=2e-6),
          'load': within(3e-4, 0.1, 'kg m^2', step=4e-6),
          'stiffness': within(8.0, 0.15, 'N m/rad'), 'damping': within(2e-3, 0.5, 'N m s/rad'),
          'constant': within(0.1, 0.03, 'N m/A', step=1e-3),
          'coulomb': within(0.03, 0.3, 'N m', step=2e-4),
          'viscous': within(8e-4, 0.4, 'N m s/rad'), 'current_lag': within(5e-4, 0.5, 's'),
          # the recorder asks one channel after the other
          'current_filter': known(0.0, 's'), 'coulomb_share': known(1.0),
          'viscous_share': known(1.0), 'angle_late': free(0.0, 1.0, 'sample'),
          'current_late': free(0.0, 1.0, 'sample')},
    per_test={'start': free(-0.05, 0.05, 'rad'), 'integral': free(-0.6, 0.6, 'A')},
    readings={'angle': reading('rad', noise=1e-3, model_error=2e-3, column='motor_rad'),
              'current': reading('A', noise=0.02, model_error=0.01, zero=0.02, gain=0.01,
                                 column='current_A')},
    effects=[
        effect('gearbox.compliance', cause='the shaft is softer', softness=size(0.0, 6.0)),
        effect('gearbox.backlash', cause='there is a gap between the teeth',
               half_gap=size(0.0, 0.2, 'rad', step=1e-3)),
        effect('motor.friction_asymmetry', cause='friction depends on the direction',
               asymmetry=size(-0.9, 0.9)),
        effect('motor.stribeck', cause='grease carries only in motion',
               stribeck=size(0.0, 0.15, 'N m'),
               stribeck_rate=shape(0.2, 20.0, 2.0, 'rad/s', step=0.05)),
        ripple('motor.torque_ripple', 'ripple', size(-0.1, 0.1, 'N m'), 'motor_rad', harmonics=2,
               cause='slots and commutation push by angle'),
        effect('motor.torque_constant', cause='the magnet is weaker',
               constant_change=size(-0.7, 0.5)),
        effect('controller.delay', cause='the bus takes time',
               delay=size(0.0, 0.006, 's', step=1e-4)),
        effect('controller.current_limit', cause='the drive gives less current',
               limit_change=size(-0.85, 0.5)),
        effect('load.inertia', cause='a payload', load_change=size(-0.5, 2.5)),
        effect('load.imbalance', cause='the weight pulls by angle',
               weight_cosine=size(-0.15, 0.15, 'N m'), weight_sine=size(-0.15, 0.15, 'N m')),
        effect('link.resonance', *(
            form(f'{hz:g} Hz', hung_share=size(0.0, 0.8),
                 hung_hz=shape(0.6 * hz, 1.6 * hz, hz, 'Hz', step=0.02 * hz),
                 hung_damping=shape(0.002, 0.2, 0.03))
            for hz in (4.0, 8.0, 16.0)), cause='a part of the link swings on its own'),
        ripple('encoder.cyclic_error', 'cyclic', size(-0.2, 0.2, 'rad'), 'motor_rad',
               orders=(1.0, 2.0), harmonics=2, cause='the encoder sits off its axis'),
    ],
    push={'motor': push('motor', 'torque on the motor', 'N m', 0.02),
          'gearbox': push('gearbox', 'torque in the shaft', 'N m', 0.02),
          'load': push('load', 'torque on the load', 'N m', 0.02)},
    settles_s=0.3, judged_hz=100.0, blocks=('controller', 'motor', 'gearbox', 'load', 'link'),
    parallel=True, log=lambda log: without_gaps(log, ['reference_rad'], settles_s=0.5))
