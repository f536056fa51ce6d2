# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The rate command and the bias source of a test, for the compiled equations."""

import math
from typing import Any

from lab.antenna.compiled import compiled
import numpy as np
from numpy.typing import NDArray

SQUARE, TRIANGLE, MULTISINE, CHIRP, REST, KNOTS = 0, 1, 2, 3, 4, 5
MOST_SINES = 32
MOST_KNOTS = 512

TEST = np.dtype([(name, np.float64) for name in (
    'shape',                    # one of the constants above
    'amplitude',                # [rad/s]
    'period',                   # [s]
    'phase',                    # in periods
    'start', 'duration',        # [s]
    'first_frequency', 'last_frequency',              # of a chirp [Hz]
    'sines',                    # their number
    'knots',                    # their number; the rate is linear between two of them
    'bias_source',              # 0: share circuit, 1: a source
    'bias_voltage', 'bias_at',  # of the source [V], [s]
    'elevation',                # at the start [rad]
)] + [
    ('frequency', np.float64, (MOST_SINES,)),         # [Hz]
    ('weight', np.float64, (MOST_SINES,)),
    ('sine_phase', np.float64, (MOST_SINES,)),        # [rad]
    ('knot_time', np.float64, (MOST_KNOTS,)),         # ascending, equal at a jump [s]
    ('knot_rate', np.float64, (MOST_KNOTS,)),         # [rad/s]
])


@compiled
def between_knots(test: Any, t: float, middle: float) -> float:
    """Return the rate on the straight line between two knots, which `middle` selects [rad/s]."""
    low, high = 0, int(test.knots) - 1
    if middle < test.knot_time[0] or middle >= test.knot_time[high]:
        return 0.0
    while high - low > 1:
        half = (low + high) // 2
        if test.knot_time[half] <= middle:
            low = half
        else:
            high = half
    part = (t - test.knot_time[low]) / (test.knot_time[high] - test.knot_time[low])
    return test.knot_rate[low] + part * (test.knot_rate[high] - test.knot_rate[low])


@compiled
def command(test: Any, t: float, middle: float) -> float:
    """Return the rate command [rad/s] at `t` [s], on the branch that holds at `middle` [s]."""
    if test.shape == REST or middle < test.start:
        return 0.0
    if test.shape == SQUARE:
        cycle = (middle - test.start) / test.period + test.phase
        return test.amplitude if cycle - math.floor(cycle) < 0.5 else -test.amplitude
    if test.shape == TRIANGLE:
        cycle = (middle - test.start) / test.period + test.phase
        turn = math.floor(cycle + 0.25)         # quarter before the rise through zero
        place = (t - test.start) / test.period + test.phase - turn
        if cycle - turn < 0.25:
            return 4.0 * test.amplitude * place
        return 4.0 * test.amplitude * (0.5 - place)
    if test.shape == KNOTS:
        return between_knots(test, t, middle)
    if test.shape == MULTISINE:
        total = 0.0
        for k in range(int(test.sines)):
            total += test.weight[k] * math.sin(
                2.0 * math.pi * test.frequency[k] * (t - test.start) + test.sine_phase[k])
        return test.amplitude * total
    if middle > test.start + test.duration:
        return 0.0
    tau = t - test.start
    sweep = (test.last_frequency - test.first_frequency) / test.duration
    return test.amplitude * math.sin(
        2.0 * math.pi * (test.first_frequency * tau + 0.5 * sweep * tau * tau))


def corners(test: Any, end: float) -> NDArray[np.float64]:
    """Return the times between 0 and `end` at which the command or the bias is not smooth [s]."""
    times: list[float] = []
    if test['bias_source'] > 0.0:
        times.append(float(test['bias_at']))
    if test['shape'] in (SQUARE, TRIANGLE):
        period, phase, start = (float(test[name]) for name in ('period', 'phase', 'start'))
        shift = 0.0 if test['shape'] == SQUARE else 0.25
        last = math.ceil(2.0 * ((end - start) / period + phase)) + 1
        first = math.floor(2.0 * phase) - 1
        edges = [(0.5 * k + shift - phase) * period for k in range(first, last + 1)]
        times += [start, *(start + edge for edge in edges if start == 0.0 or edge > 0.0)]
    elif test['shape'] == KNOTS:
        times += test['knot_time'][:int(test['knots'])].tolist()
    elif test['shape'] != REST:
        times.append(float(test['start']))
        if test['shape'] == CHIRP:
            times.append(float(test['start'] + test['duration']))
    return np.array(sorted({t for t in times if 0.0 < t < end}))
