# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The test programme: three recordings, as a servo engineer would take them.

A slow square wave shows friction, gaps and the start of motion. A fast triangle shows load,
saturation, limits and the fade-out of the bias. A multisine or a chirp shows inertia, structure,
filters and delay. The three are recorded at different elevations, which separates gravity from
wind. Amplitudes and periods vary from case to case; the kinds of recording do not.
"""

import math
from typing import Any

from lab.antenna.sheet import CaseSheet, SensorGrade
import numpy as np

RECORDINGS = ('rec_a', 'rec_b', 'rec_c')
SOURCE_BIAS_V = (4.1, 8.3)      # 10 to 20 percent of the motors' largest current


def draw_sheets(tolerance: float, duration: float,
                random: np.random.Generator) -> tuple[CaseSheet, ...]:
    """
    Draw the test sheets of one case, one for each name in RECORDINGS, of `duration` [s].

    `tolerance` is the largest relative deviation of the machine from the reference.
    """
    fitted = 'new' if random.uniform() < 0.7 else 'old'
    pot = _rounded(random.uniform(0.65, 0.9), 3)
    elevations = random.permutation([
        _rounded(random.uniform(15.0, 30.0), 1), _rounded(random.uniform(40.0, 55.0), 1),
        _rounded(random.uniform(65.0, 80.0), 1)])
    circuit = {'type': 'circuit', 'bias_pot': pot, 'start': 'steady'}
    cold = {'type': 'circuit', 'bias_pot': pot, 'start': 'zero'}
    tests = (
        (slow_square(random), _slow_bias(circuit, random)),
        (fast_triangle(random), cold if random.uniform() < 0.5 else circuit),
        (_broad_band(duration, random), circuit))
    return tuple(
        CaseSheet(circuit=fitted, filter_1=fitted, bias=bias, waveform=shape,
                  elevation_deg=float(elevation), sensors=SensorGrade(),
                  parameter_tolerance=tolerance)
        for (shape, bias), elevation in zip(tests, elevations))


def _rounded(value: float, digits: int) -> float:
    return float(round(float(value), digits))


def log_uniform(low: float, high: float, digits: int, random: np.random.Generator) -> float:
    """Return a number whose logarithm is uniform from low to high, rounded."""
    return _rounded(math.exp(random.uniform(math.log(low), math.log(high))), digits)


def slow_square(random: np.random.Generator) -> dict[str, Any]:
    """Draw a slow square wave."""
    return {'type': 'square', 'amplitude_deg_s': log_uniform(0.02, 0.12, 4, random),
            'period_s': _rounded(random.uniform(5.0, 7.5), 2),
            'phase': float(random.choice([0.0, 0.25]))}


def _slow_bias(circuit: dict[str, Any], random: np.random.Generator) -> dict[str, Any]:
    way = random.uniform()
    voltage = _rounded(random.uniform(*SOURCE_BIAS_V), 2)
    if way < 0.3:
        return {'type': 'fixed', 'voltage_V': voltage}
    if way < 0.6:
        return {'type': 'fixed_step', 'voltage_V': voltage,
                'at_s': _rounded(random.uniform(8.0, 16.0), 1)}
    return circuit


def fast_triangle(random: np.random.Generator) -> dict[str, Any]:
    """Draw a fast triangle."""
    return {'type': 'triangle', 'amplitude_deg_s': _rounded(random.uniform(0.4, 0.685), 3),
            'period_s': _rounded(random.uniform(4.5, 7.0), 2), 'phase': 0.0}


def _broad_band(duration: float, random: np.random.Generator) -> dict[str, Any]:
    return chirp(duration, random) if random.uniform() < 0.3 else multisine(random)


def chirp(duration: float, random: np.random.Generator) -> dict[str, Any]:
    """Draw a chirp, which ends a second before the recording does."""
    return {'type': 'chirp', 'amplitude_deg_s': log_uniform(0.05, 0.1, 4, random),
            'f0_hz': 0.1, 'f1_hz': _rounded(random.uniform(6.0, 9.0), 1),
            'duration_s': duration - 2.0, 'start_s': 1.0}


def multisine(random: np.random.Generator) -> dict[str, Any]:
    """Draw a multisine with a period of 14 s."""
    count = 12
    # Whole cycles in half the recording: the second half repeats the first.
    low, high = 0.1, 8.0
    lines = np.unique(np.round(np.geomspace(low, high, count)
                               * np.exp(random.uniform(-0.15, 0.15, count)) * 14.0))
    frequencies = lines / 14.0
    weights = frequencies**-0.5
    weights /= math.sqrt(float(np.sum(weights**2)))
    return {'type': 'multisine', 'amplitude_deg_s': log_uniform(0.08, 0.2, 4, random),
            'frequencies_hz': [_rounded(f, 6) for f in frequencies],
            'weights': [_rounded(w, 4) for w in weights],
            'phases': [_rounded(p, 4) for p in random.uniform(0.0, 2.0 * math.pi, len(lines))],
            'start_s': 1.0}
