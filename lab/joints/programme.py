# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The programme of a case: three tests, as a user of the machine would take them.

The first one jumps between levels, the second goes to and fro, the third covers a band of
frequencies. A bus asks for positions at the rate of the recording.
"""

from collections.abc import Mapping
import math
from typing import Any

from lab.joints.mechanism import FloatArray, TICK_S
import numpy as np

RATES_HZ = (100, 125, 200, 250, 500)
DURATION_S = (8.0, 40.0)
REST_S = 0.3            # before the motion
SWEEP_HZ = (0.1, 8.0)
TONES = 8
Test = dict[str, Any]


def draw_tests(table: Mapping[str, Any], random: np.random.Generator) -> list[Test]:
    """
    Draw the three tests of a case: shape, duration [s] and the numbers of the shape.

    The table has reach, step, rate, greatest_rate, greatest_acceleration and may have lasts [s].
    """
    shapes = ('steps', str(random.choice(['triangle', 'sine'])),
              str(random.choice(['chirp', 'multisine'])))
    return [{'shape': shape, 'duration_s': duration, **_DRAW[shape](table, duration, random)}
            for shape in shapes
            for duration in [round(_between(table.get('lasts', DURATION_S), random), 2)]]


def reference(test: Test, times: FloatArray) -> FloatArray:
    """Return the position that the bus asks for at `times` in the test, shape (n,) [s]."""
    since = np.maximum(times - REST_S, 0.0)
    if test['shape'] == 'steps':
        places = np.searchsorted(test['from_s'], since, side='right') - 1
        return np.asarray(test['levels'])[places]
    if test['shape'] == 'triangle':
        part = (since / test['period_s'] + 0.25) % 1.0
        return np.asarray(test['amplitude'] * (1.0 - 4.0 * np.abs(part - 0.5)))
    if test['shape'] == 'sine':
        return np.asarray(test['amplitude'] * np.sin(2.0 * math.pi * since / test['period_s']))
    if test['shape'] == 'chirp':
        # the frequency grows by the same factor in each second
        low, high = test['from_Hz'], test['to_Hz']
        growth = math.log(high / low) / test['duration_s']
        cycles = low * (np.exp(growth * since) - 1.0) / growth
        return _amplitude(test, low * np.exp(growth * since)) * np.sin(2.0 * math.pi * cycles)
    found = np.zeros_like(since)
    for frequency, phase in zip(test['frequencies_Hz'], test['phases_rad'], strict=True):
        size = _amplitude(test, np.full_like(since, frequency)) / math.sqrt(TONES)
        found += size * np.sin(2.0 * math.pi * frequency * since + phase)
    return found * np.minimum(since / 1.0, 1.0)


def ticks_of(rate: int) -> int:
    """Return the ticks of the controller between two samples of the bus."""
    return round(1.0 / (rate * TICK_S))


def _amplitude(test: Test, frequency: FloatArray) -> FloatArray:
    """Return an amplitude within the limits of way, rate and acceleration."""
    turn = 2.0 * math.pi * frequency
    return np.minimum(np.minimum(test['way'], test['rate'] / turn),
                      test['acceleration'] / turn ** 2)


def _between(limits: tuple[float, float], random: np.random.Generator) -> float:
    """Return a number whose logarithm is uniform."""
    return math.exp(random.uniform(*np.log(limits)))


def _steps(table: Mapping[str, Any], duration: float, random: np.random.Generator) -> Test:
    starts, levels, level, t = [0.0], [0.0], 0.0, 0.2
    while t < duration:
        jump = _between(table['step'], random) * float(random.choice([-1.0, 1.0]))
        level += jump if abs(level + jump) <= table['reach'] else -jump
        starts.append(round(t, 3))
        levels.append(level)
        t += float(random.uniform(0.5, 2.5))
    return {'from_s': starts, 'levels': levels}


def _triangle(table: Mapping[str, Any], duration: float, random: np.random.Generator) -> Test:
    amplitude = table['reach'] * float(random.uniform(0.2, 0.9))
    # twice to and fro at least
    slowest = max(table['rate'][0], 8.0 * amplitude / duration)
    rate = _between((slowest, max(slowest, table['rate'][1])), random)
    return {'amplitude': amplitude, 'period_s': 4.0 * amplitude / rate}


def _sine(table: Mapping[str, Any], duration: float, random: np.random.Generator) -> Test:
    amplitude = table['reach'] * float(random.uniform(0.2, 0.9))
    fastest = min(table['greatest_rate'] / amplitude,
                  math.sqrt(table['greatest_acceleration'] / amplitude))
    slowest = 2.0 * math.pi * 3.0 / duration
    return {'amplitude': amplitude,
            'period_s': 2.0 * math.pi / _between((min(slowest, fastest), fastest), random)}


def _limits(table: Mapping[str, Any], random: np.random.Generator) -> Test:
    share = float(random.uniform(0.3, 0.8))
    return {'way': 0.5 * share * table['reach'], 'rate': share * table['greatest_rate'],
            'acceleration': share * table['greatest_acceleration']}


def _chirp(table: Mapping[str, Any], duration: float, random: np.random.Generator) -> Test:
    return {**_limits(table, random), 'from_Hz': _between((SWEEP_HZ[0], 0.4), random),
            'to_Hz': _between((3.0, SWEEP_HZ[1]), random)}


def _multisine(table: Mapping[str, Any], duration: float, random: np.random.Generator) -> Test:
    return {**_limits(table, random), 'frequencies_Hz': [
        round(_between((2.0 * SWEEP_HZ[0], SWEEP_HZ[1]), random), 3) for _ in range(TONES)],
        'phases_rad': [float(p) for p in random.uniform(0.0, 2.0 * math.pi, TONES)]}


_DRAW = {'steps': _steps, 'triangle': _triangle, 'sine': _sine, 'chirp': _chirp,
         'multisine': _multisine}
