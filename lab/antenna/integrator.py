# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Dormand and Prince's 5(4) pair with dense output, stopped at every switching.

The state is smooth between two switchings, so the pair keeps its order. When a margin becomes
negative within a step, bisection on the dense output locates the moment to 1e-12 s. The switch is
thrown there and the integration restarts. Sources: Dormand and Prince, J. Comp. Appl. Math. 6
(1980) 19; Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.5 and II.6.
"""

from typing import Any

from lab.antenna.compiled import compiled, inner
from lab.antenna.equations import (
    AXIS_FRICTION, derivative, FRICTION, LOAD_SIGN, ModeArray, MOTOR_AT, MOTOR_SIZE, STATES,
    SWITCHES, W, W_A,
)
from lab.antenna.laws import FloatArray
from lab.antenna.machine import Records
import numpy as np

# Reasons for which an integration ends.
DONE, STEP_TOO_SMALL, NOT_FINITE, CHATTER, TOO_MANY_STEPS = 0, 1, 2, 3, 4

TIME_RESOLUTION = 1e-12     # of a switching [s]
STEP_FLOOR = 1e-11          # a smaller step means failure [s]
LONGEST_STEP = 5e-3         # short enough not to miss two switchings of one body [s]
CHATTER_LIMIT = 400         # switchings without progress in time
MOST_STEPS = 5_000_000      # a test normally takes some ten thousand

A = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
    [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
    [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]])
C = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
DENSE = np.array([
    -12715105075 / 11282082432, 0.0, 87487479700 / 32700410799, -10690763975 / 1880347072,
    701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423])


@compiled
def interpolate(part: float, y: FloatArray, k: FloatArray, end: FloatArray, step: float,
                out: FloatArray) -> None:
    """Evaluate the dense output at `part` of the step, 0 to 1."""
    rest = 1.0 - part
    for n in range(STATES):
        change = end[n] - y[n]
        bend = step * k[0, n] - change
        snap = change - step * k[6, n] - bend
        last = 0.0
        for stage in range(7):
            last += DENSE[stage] * k[stage, n]
        out[n] = y[n] + part * (change + rest * (bend + part * (snap + rest * step * last)))


@compiled
def violated(margin: FloatArray) -> bool:
    """Return whether any switch must be thrown."""
    for k in range(SWITCHES):
        if margin[k] < 0.0:
            return True
    return False


@compiled
def rate_state(which: int) -> int:
    """Return the index of the rate of a body that sticks and slips; -1 for other switches."""
    if which == AXIS_FRICTION:
        return W_A
    if FRICTION <= which < FRICTION + 2:
        return MOTOR_AT + (which - FRICTION) * MOTOR_SIZE + W
    return -1


@compiled
def throw(which: int, t: float, middle: float, y: FloatArray, mode: ModeArray,
          machine: Records, test: Any, scratch: FloatArray, margin: FloatArray) -> None:
    """Move one switch whose margin is negative to its next position."""
    rate = rate_state(which)
    if which == LOAD_SIGN:
        mode[which] = -mode[which]
    elif mode[which] != 0:
        mode[which] = 0
        if rate >= 0:
            y[rate] = 0.0
    else:
        # Try the positive side; if it is not valid, the negative one is.
        mode[which] = 1
        derivative(t, middle, y, mode, machine, test, scratch, margin)
        if (scratch[rate] if rate >= 0 else margin[which]) < 0.0:
            mode[which] = -1


@compiled
def settle(t: float, middle: float, y: FloatArray, mode: ModeArray, machine: Records,
           test: Any, dy: FloatArray, margin: FloatArray) -> int:
    """Throw switches until all margins hold; fill derivatives and margins; return the count."""
    # teeth that meet may break a stuck body loose at the same moment, hence the loop
    for count in range(2 * SWITCHES):
        derivative(t, middle, y, mode, machine, test, dy, margin)
        if not violated(margin):
            return count
        which = 0
        while not margin[which] < 0.0:
            which += 1
        throw(which, t, middle, y, mode, machine, test, dy, margin)
    derivative(t, middle, y, mode, machine, test, dy, margin)
    return 2 * SWITCHES


@inner
def attempt(t: float, middle: float, h: float, y: FloatArray, mode: ModeArray, machine: Records,
            test: Any, scale: FloatArray, k: FloatArray, end: FloatArray,
            margin: FloatArray) -> float:
    """Fill slopes, state and margins at the end of a step; return its error over `scale`."""
    for stage in range(1, 7):
        for n in range(STATES):
            total = 0.0
            for past in range(stage):
                total += A[stage, past] * k[past, n]
            end[n] = y[n] + h * total
        derivative(t + C[stage] * h, middle, end, mode, machine, test, k[stage], margin)
    worst = 0.0
    for n in range(STATES):
        total = 0.0
        for stage in range(7):
            total += ERROR[stage] * k[stage, n]
        worst = max(worst, abs(h * total) / scale[n])
        if not np.isfinite(end[n]):
            worst = np.inf
    return worst


@inner
def first_switching(t: float, middle: float, h: float, y: FloatArray, mode: ModeArray,
                    machine: Records, test: Any, k: FloatArray, end: FloatArray,
                    probe: FloatArray, scratch: FloatArray,
                    margin: FloatArray) -> tuple[bool, float]:
    """Return whether a switch must be thrown in a step, and at which share of it, 0 to 1."""
    low, high = 0.0, 1.0
    thrown = violated(margin)
    for probe_at in range(1, 3):
        part = probe_at / 3.0
        interpolate(part, y, k, end, h, probe)
        derivative(t + part * h, middle, probe, mode, machine, test, scratch, margin)
        if violated(margin):
            thrown, high = True, part
            break
        low = part
    if not thrown:
        return False, 1.0
    while (high - low) * h > TIME_RESOLUTION and high - low > 1e-15:
        part = 0.5 * (low + high)
        interpolate(part, y, k, end, h, probe)
        derivative(t + part * h, middle, probe, mode, machine, test, scratch, margin)
        if violated(margin):
            high = part
        else:
            low = part
    return True, high


@compiled
def integrate(machine: Records, test: Any, start: FloatArray, mode: ModeArray,
              corners: FloatArray, samples: FloatArray, tolerance: float, scale: FloatArray,
              out: FloatArray, statistics: ModeArray) -> int:
    """
    Integrate to the last sample; fill `out`, (len(samples), STATES); return DONE or a failure.

    `start` (STATES,) and `mode` (SWITCHES,) hold at t = 0 and are overwritten with the last ones.
    At `corners` an input is not smooth; they and `samples` ascend from 0 [s]. `tolerance` is the
    largest error of one step in units of `scale`, the typical size of each state. `statistics`
    (3,) becomes the steps taken, the steps rejected and the switchings.
    """
    end_of_all = samples[-1]
    y, end, probe = start, np.empty(STATES), np.empty(STATES)
    k = np.zeros((7, STATES))
    margin = np.zeros(SWITCHES)
    scratch = np.empty(STATES)
    t, sample, corner, step = 0.0, 0, 0, 1e-4
    idle, fresh = 0, True
    while sample < len(samples) and samples[sample] <= 0.0:
        out[sample] = y
        sample += 1
    while t < end_of_all:
        while corner < len(corners) and corners[corner] <= t:
            corner += 1
        stop = corners[corner] if corner < len(corners) else end_of_all
        stop = min(stop, end_of_all)
        middle = 0.5 * (t + stop)
        if fresh:
            statistics[2] += settle(t, middle, y, mode, machine, test, k[0], margin)
            fresh = False
        whole = False
        h = min(step, LONGEST_STEP)
        if t + h >= stop - STEP_FLOOR:
            h, whole = stop - t, True
        worst = attempt(t, middle, h, y, mode, machine, test, scale, k, end, margin)
        growth = 0.9 * (tolerance / max(worst, 1e-6 * tolerance))**0.2
        if worst > tolerance:
            statistics[1] += 1
            step = h * max(0.2, growth)
            if step < STEP_FLOOR:
                return STEP_TOO_SMALL if np.isfinite(worst) else NOT_FINITE
            continue
        statistics[0] += 1
        if statistics[0] > MOST_STEPS:
            return TOO_MANY_STEPS
        step = h * min(5.0, max(0.2, growth))
        thrown, high = first_switching(t, middle, h, y, mode, machine, test, k, end, probe,
                                       scratch, margin)
        reached = stop if whole and high == 1.0 else t + high * h
        while sample < len(samples) and samples[sample] <= reached:
            interpolate((samples[sample] - t) / h, y, k, end, h, out[sample])
            sample += 1
        if thrown:
            interpolate(high, y, k, end, h, probe)
            idle = idle + 1 if high * h < 1e-9 else 0
            if idle > CHATTER_LIMIT:
                return CHATTER
            y[:] = probe
            step = max(min(step, h), 1e-6)
            fresh = True
        else:
            y[:] = end
            k[0] = k[6]
            if whole:
                fresh = True        # an input or its slope jumps here
        t = reached
    return DONE
