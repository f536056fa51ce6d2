# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
One integrator for every unit: classical Runge-Kutta between switchings, which are located in time.

Between two switchings (a tooth meets its neighbour, a rotor sticks) a unit's equations are
smooth. A step that would run past a switching is cut where the switching happens, so that the
fourth order of the method, and a smooth dependence on every parameter, survive backlash and
stiction with steps of a millisecond.
"""

from collections.abc import Callable
from typing import Any

from antenna_drive.physics.arrays import FloatArray, IntArray
import numpy as np
from simgap.laws.compiling import inner

# Halvings of a step in the search for a switching: 1 ms is narrowed down to less than 1 ns.
_HALVINGS = 21
# A unit that switches more often than this in one step is stepped on without location.
_SWITCHINGS_LIMIT = 40

# Rows of the work space: four slopes, the slope at the end, two trial states.
_WORK_ROWS = 7


def work_space(states: int) -> FloatArray:
    """Return the scratch memory that `advance` needs for a unit of so many states."""
    return np.zeros((_WORK_ROWS, states))


def located_runge_kutta(
    rates: Callable[..., Any], switch: Callable[..., Any], states: int = 0,
    inputs_jump: bool = True,
) -> Callable[..., Any]:
    """
    Make the compiled function that advances one unit over one macro-step.

    rates : compiled (t, x, mode, u, p, dx): writes the time derivative of the states x for a
        frozen mode into dx; t [s] runs from the start of the macro-step, u are the inputs of
        shape (n, 2), value and time derivative at t = 0, p the unit's parameters
    switch : compiled (t, x, mode, u, p, commit) -> bool: tells whether the mode no longer holds;
        if commit is true it also writes the new mode and resets states
    states : how many there always are, which compiles to straight code; 0 if their number varies
    inputs_jump : True if u may jump between macro-steps: the mode at their start is then looked at
        again

    Returns the compiled function (x, mode, u, p, h, steps, work): it advances x and mode in place
    over the macro-step h [s] in so many equal steps; work is from `work_space`.
    """
    step_to, settle, locate = _runge_kutta(rates, states), _settling(switch), _location(switch)

    @inner
    def advance(
            x: FloatArray, mode: IntArray, u: Any, p: Any, h: float, steps: int, work: FloatArray,
    ) -> None:
        n, step = states if states else x.size, h / steps
        k5, y, z = work[4], work[5], work[6]
        if inputs_jump:
            settle(0.0, x, mode, u, p)
        t, done, switchings = 0.0, 0, 0
        while done < steps:
            end = (done + 1) * step
            dt = end - t
            step_to(t, end, x, mode, u, p, work)
            if switchings < _SWITCHINGS_LIMIT and switch(end, y, mode, u, p, False):
                rates(end, y, mode, u, p, k5)
                high = locate(t, dt, x, mode, u, p, work)
                t += high * dt
                for j in range(n):
                    x[j] = z[j]
                switchings += 1
                settle(t, x, mode, u, p)
                if high == 1.0:
                    done, t = done + 1, end
            else:
                for j in range(n):
                    x[j] = y[j]
                done, t = done + 1, end
                if switchings == _SWITCHINGS_LIMIT:
                    settle(t, x, mode, u, p)

    return advance


def _runge_kutta(rates: Callable[..., Any], states: int) -> Callable[..., Any]:
    """Make the compiled step from t to `end`: its slopes and the state y into the work space."""
    @inner
    def step_to(t: float, end: float, x: FloatArray, mode: IntArray, u: Any, p: Any,
                work: FloatArray) -> None:
        n = states if states else x.size
        k1, k2, k3, k4, y = work[0], work[1], work[2], work[3], work[5]
        dt = end - t
        rates(t, x, mode, u, p, k1)
        for j in range(n):
            y[j] = x[j] + 0.5 * dt * k1[j]
        rates(t + 0.5 * dt, y, mode, u, p, k2)
        for j in range(n):
            y[j] = x[j] + 0.5 * dt * k2[j]
        rates(t + 0.5 * dt, y, mode, u, p, k3)
        for j in range(n):
            y[j] = x[j] + dt * k3[j]
        rates(end, y, mode, u, p, k4)
        for j in range(n):
            y[j] = x[j] + dt / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])

    return step_to


def _settling(switch: Callable[..., Any]) -> Callable[..., Any]:
    """Make the compiled function that switches until the mode holds."""
    @inner
    def settle(t: float, x: FloatArray, mode: IntArray, u: Any, p: Any) -> None:
        # one switching may call for another: a body that stops may break away at once
        for _ in range(4):
            if not switch(t, x, mode, u, p, True):
                break

    return settle


def _location(switch: Callable[..., Any]) -> Callable[..., Any]:
    """Make the compiled search for the share of dt at which the mode ceases to hold."""
    @inner
    def locate(t: float, dt: float, x: FloatArray, mode: IntArray, u: Any, p: Any,
               work: FloatArray) -> float:
        # the cubic through both ends and their slopes stands in for the path between
        k1, k5, y, z = work[0], work[4], work[5], work[6]
        low = 0.0
        high = 1.0
        for _ in range(_HALVINGS):
            s = 0.5 * (low + high)
            _cubic(x, k1, y, k5, dt, s, z)
            if switch(t + s * dt, z, mode, u, p, False):
                high = s
            else:
                low = s
        _cubic(x, k1, y, k5, dt, high, z)
        return high

    return locate


@inner
def _cubic(
        x: FloatArray, dx: FloatArray, y: FloatArray, dy: FloatArray, dt: float, s: float,
        z: FloatArray,
) -> None:
    """Write the cubic Hermite interpolation between x and y at the fraction s of dt into z."""
    s2 = s * s
    s3 = s2 * s
    a = 2.0 * s3 - 3.0 * s2 + 1.0
    b = (s3 - 2.0 * s2 + s) * dt
    c = 3.0 * s2 - 2.0 * s3
    d = (s3 - s2) * dt
    for j in range(x.size):
        z[j] = a * x[j] + b * dx[j] + c * y[j] + d * dy[j]
