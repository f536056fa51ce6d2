# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make logs of a joint with a given fault, as a robot would: a program of its own, in plain Python.

  python examples/robot_joint/make_logs.py compliance logs

writes logs/steps.csv and logs/sweep.csv. It shares no code with the model or the ready parts:
another integrator (Runge-Kutta of fourth order), another friction law (Karnopp's dead band).
"""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
import sys

import numpy as np
from numpy.typing import NDArray

FAULTS: dict[str, dict[str, float]] = {
    'nothing': {}, 'compliance': {'compliance': 0.3}, 'backlash': {'half_gap': 0.04},
    'asymmetry': {'asymmetry': 0.25}, 'ripple': {'ripple': 0.02}, 'delay': {'delay': 0.004},
    'push': {'push': 0.06},
}
STEP, PARTS, DURATION = 1e-3, 20, 8.0
MOTOR, LOAD, CONSTANT, COULOMB, VISCOUS = 2e-4, 3.1e-4, 0.102, 0.03, 8e-4
BAND = 2e-3      # rate below which the motor counts as at rest [rad/s]


def steps(t: float) -> float:
    """Return a reference that jumps to and fro [rad]."""
    return 0.4 if t % 2.0 < 1.0 else 0.0


def sweep(t: float) -> float:
    """Return a reference that swings faster and faster [rad]."""
    return 2.0 * math.sin(2.0 * math.pi * (0.3 * t + 0.15 * t * t))


def log_of(reference: Callable[[float], float], fault: dict[str, float],
           seed: int) -> NDArray[np.float64]:
    """Return time, reference, motor angle and current of a test, shape (n, 4)."""
    random = np.random.default_rng(seed)
    half_gap = fault.get('half_gap', 0.0)
    stiffness = 1.0 / (1e-3 + fault.get('compliance', 0.0))
    damping = 0.02 * math.sqrt(stiffness * MOTOR)
    asymmetry, ripple = fault.get('asymmetry', 0.0), fault.get('ripple', 0.0)
    current = 0.0

    def slopes(t: float, y: tuple[float, ...]) -> tuple[float, ...]:
        q, w, ql, wl = y
        at_rest = abs(w) < BAND
        w = 0.0 if at_rest else w
        outside = fault.get('push', 0.0) * (3.0 < t < 3.6)
        twist, rate = q - ql, w - wl
        pressed = twist - max(min(twist, half_gap), -half_gap)
        shaft = stiffness * pressed + damping * rate if pressed else 0.0
        shaft = max(shaft, 0.0) if pressed > 0.0 else min(shaft, 0.0)
        if not half_gap:
            shaft = stiffness * twist + damping * rate
        torque = CONSTANT * current + ripple * math.sin(6.0 * q) - VISCOUS * w - shaft
        level = COULOMB * (1.0 + math.copysign(asymmetry, torque if at_rest else w))
        rubbing = max(min(torque, level), -level) if at_rest else math.copysign(level, w)
        return w, (torque - rubbing) / MOTOR, wl, (shaft + outside) / LOAD

    y: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    integral, rows, h = 0.0, [], STEP / PARTS
    for k in range(round(DURATION / STEP)):
        t = k * STEP
        asked = 20.0 * (reference(max(t - fault.get('delay', 0.0), 0.0)) - y[0])
        error = max(min(asked, 200.0), -200.0) - y[1]
        grown = integral + 0.4 * error * STEP / 0.05
        current = max(min(0.4 * error + grown, 8.0), -8.0)
        if current == 0.4 * error + grown:  # the integral stands still at the limit
            integral = grown
        rows.append((t, reference(t), y[0] + 2e-3 * random.normal(),
                     current + 0.02 * random.normal()))
        for i in range(PARTS):
            now = t + i * h
            a = slopes(now, y)
            b = slopes(now + h / 2, tuple(v + h / 2 * d for v, d in zip(y, a)))
            c = slopes(now + h / 2, tuple(v + h / 2 * d for v, d in zip(y, b)))
            d = slopes(now + h, tuple(v + h * s for v, s in zip(y, c)))
            y = tuple(v + h / 6 * (p + 2 * q + 2 * r + s)
                      for v, p, q, r, s in zip(y, a, b, c, d))
    return np.array(rows)


def main(fault: str, folder: str) -> None:
    """Write the logs of a joint with a fault."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for seed, reference in enumerate((steps, sweep)):
        np.savetxt(Path(folder) / f'{reference.__name__}.csv',
                   log_of(reference, FAULTS[fault], seed), delimiter=',', comments='',
                   fmt='%.9g', header='time_s,reference_rad,motor_rad,current_A')


if __name__ == '__main__':
    if len(sys.argv) != 3 or sys.argv[1] not in FAULTS:
        sys.exit(f'usage: make_logs.py FAULT FOLDER; faults: {", ".join(FAULTS)}')
    main(*sys.argv[1:])
