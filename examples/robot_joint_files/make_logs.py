# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make logs of a joint with a given fault, as a robot would: a program of its own, in plain Python.

  python examples/robot_joint_files/make_logs.py compliance logs

writes logs/steps.csv and logs/sweep.csv. It shares no code with the three models: Runge-Kutta of
fourth order, and Karnopp's dead band for friction.
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
    'load_friction': {'load_friction': 0.02}, 'delay': {'delay': 0.004},
}
STEP, PARTS, DURATION = 4e-3, 20, 4.0
MOTOR, LOAD, COULOMB, VISCOUS = 2e-4, 3.1e-4, 0.025, 1e-3
STIFFNESS, DAMPING = 50.0, 2e-3
GAIN, RATE_GAIN, LIMIT = 0.8, 0.04, 0.5
BAND = 1e-3      # rate below which a body counts as at rest [rad/s]


def steps(t: float) -> float:
    """Return a reference that jumps to and fro [rad]."""
    return 0.4 if t % 1.0 < 0.5 else 0.0


def sweep(t: float) -> float:
    """Return a reference that swings faster and faster [rad]."""
    return 0.5 * math.sin(2.0 * math.pi * (0.5 * t + 0.5 * t * t))


def acceleration(rate: float, torque: float, level: float, inertia: float) -> float:
    """Return the acceleration of a body with dry friction [rad/s^2]."""
    if abs(rate) < BAND:
        return (torque - max(min(torque, level), -level)) / inertia
    return (torque - math.copysign(level, rate)) / inertia


def log_of(reference: Callable[[float], float], fault: dict[str, float],
           seed: int) -> NDArray[np.float64]:
    """Return time, reference, motor angle and torque of a test, shape (n, 4)."""
    random = np.random.default_rng(seed)
    half_gap, delay = fault.get('half_gap', 0.0), fault.get('delay', 0.0)
    load_level = fault.get('load_friction', 0.0)
    stiffness = 1.0 / (1.0 / STIFFNESS + fault.get('compliance', 0.0))

    def asked_at(t: float) -> float:
        """Return the late reference, which holds from sample to sample."""
        return reference(STEP * max(math.floor((t - delay) / STEP + 1e-6), 0))

    def drive(asked: float, q: float, w: float) -> float:
        return max(min(GAIN * (asked - q) - RATE_GAIN * w, LIMIT), -LIMIT)

    def slopes(asked: float, y: tuple[float, ...]) -> tuple[float, ...]:
        q, w, ql, wl = y
        twist = q - ql
        shaft = (stiffness * (twist - max(min(twist, half_gap), -half_gap))
                 + DAMPING * (w - wl))
        torque = drive(asked, q, w) - shaft - VISCOUS * w
        return (w if abs(w) >= BAND else 0.0, acceleration(w, torque, COULOMB, MOTOR),
                wl if load_level == 0.0 or abs(wl) >= BAND else 0.0,
                acceleration(wl, shaft, load_level, LOAD))

    y: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    rows, h = [], STEP / PARTS
    for k in range(round(DURATION / STEP)):
        t = k * STEP
        rows.append((t, reference(t), y[0] + 1e-3 * random.normal(),
                     drive(asked_at(t), y[0], y[1]) + 5e-3 * random.normal()))
        for i in range(PARTS):
            asked = asked_at(t + i * h)
            a = slopes(asked, y)
            b = slopes(asked, tuple(v + h / 2 * s for v, s in zip(y, a)))
            c = slopes(asked, tuple(v + h / 2 * s for v, s in zip(y, b)))
            d = slopes(asked, tuple(v + h * s for v, s in zip(y, c)))
            y = tuple(v + h / 6 * (p + 2 * q + 2 * r + s)
                      for v, p, q, r, s in zip(y, a, b, c, d))
    return np.array(rows)


def main(fault: str, folder: str) -> None:
    """Write the logs of a joint with a fault."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for seed, reference in enumerate((steps, sweep)):
        np.savetxt(Path(folder) / f'{reference.__name__}.csv',
                   log_of(reference, FAULTS[fault], seed), delimiter=',', comments='',
                   fmt='%.9g', header='time_s,reference_rad,motor_rad,torque_Nm')


if __name__ == '__main__':
    if len(sys.argv) != 3 or sys.argv[1] not in FAULTS:
        sys.exit(f'usage: make_logs.py FAULT FOLDER; faults: {", ".join(FAULTS)}')
    main(*sys.argv[1:])
