# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The test signals: value and slope of each waveform at any time, Fig. 18 and its like.

A jump lies on a macro-step: the value at a jump is the one after it, and the slope the one to
its right, so that nobody ever takes a difference across it.
"""

import math
from typing import Any

from antenna_drive.parameters.waveforms import TestSignal, Waveform
from antenna_drive.physics.arrays import FloatArray
from antenna_drive.physics.block import output_rows, put, Signal, Source
from antenna_drive.physics.compiling import compiled
import numpy as np
from numpy.typing import NDArray
from simgap.laws.compiling import inner

OUTPUTS = (
    Signal('rate_command', 'rad/s', 'axis rate command'),
    Signal('external_torque', 'N m', 'test torque at the axis, zero unless asked for'),
)
OUTPUT = output_rows(OUTPUTS)
(ZERO, SQUARE, SAW_TOOTH, SAW_TOOTH_JUMP, STEP, SINE, CHIRP, MULTISINE, PRBS,
 EXTERNAL, KNOTS) = range(11)
# A time this share of a period before a jump counts as after it: k * h is not exact.
_ON_TIME = 1e-9
# Length of the shift register of the pseudo-random binary sequence: it repeats after 1023 bits.
_PRBS_ORDER = 10


def prbs_bits() -> NDArray[np.float64]:
    """Return one period of the pseudo-random binary sequence, as +1 and -1, shape (1023,)."""
    # scipy.signal takes a second of processor time to import, which only this unit has need of
    from scipy.signal import max_len_seq
    bits, _ = max_len_seq(_PRBS_ORDER)
    return 2.0 * bits.astype(np.float64) - 1.0


@inner
def _cycle(t: float, p: Waveform) -> float:
    """Return where in its period the waveform is, from 0 up to but not including 1."""
    cycles = t / p.period + p.phase
    return max(0.0, cycles - math.floor(cycles + _ON_TIME))


@inner
def _saw_tooth(s: float) -> tuple[float, float]:
    """Return a symmetric triangle that begins at zero and rises, and its slope per period."""
    rise = 4.0 * s - 1.0
    if rise < 0.0:
        rise += 4.0
    falls = 0.25 - _ON_TIME <= s < 0.75 - _ON_TIME
    return abs(rise - 2.0) - 1.0, -4.0 if falls else 4.0


@inner
def _between_knots(t: float, p: Waveform) -> tuple[float, float]:
    """Return value and slope on the straight line between two points; zero outside of them."""
    last = p.knot_times_count - 1
    soon = t + _ON_TIME
    if soon < p.knot_times[0] or soon >= p.knot_times[last]:
        return 0.0, 0.0
    right = 1
    while p.knot_times[right] <= soon:
        right += 1
    begin, value = p.knot_times[right - 1], p.knot_values[right - 1]
    slope = (p.knot_values[right] - value) / (p.knot_times[right] - begin)
    return value + slope * (t - begin), slope


@inner
def _shape(t: float, p: Waveform, bits: FloatArray) -> tuple[float, float]:
    """Return value and slope of the waveform of amplitude 1, t seconds after its start."""
    kind = p.waveform
    two_pi = 2.0 * math.pi
    if kind == SQUARE:
        return (1.0 if _cycle(t, p) < 0.5 - _ON_TIME else -1.0), 0.0
    if kind == SAW_TOOTH:
        # it jumps nowhere: what is a little before a period's end need not count as after it
        cycles = t / p.period + p.phase
        value, slope = _saw_tooth(cycles - math.floor(cycles))
        return value, slope / p.period
    if kind == SAW_TOOTH_JUMP:
        s = _cycle(t, p)
        return (2.0 * s if s < 0.5 - _ON_TIME else 2.0 * s - 2.0), 2.0 / p.period
    if kind == STEP:
        return 1.0, 0.0
    if kind == SINE:
        angle = two_pi * (t / p.period + p.phase)
        return math.sin(angle), two_pi / p.period * math.cos(angle)
    if kind == CHIRP:
        if t > p.sweep_time:
            return 0.0, 0.0
        growth = (p.sweep_to - p.sweep_from) / p.sweep_time
        angle = two_pi * (p.sweep_from + 0.5 * growth * t) * t
        return math.sin(angle), two_pi * (p.sweep_from + growth * t) * math.cos(angle)
    if kind == MULTISINE:
        value = 0.0
        slope = 0.0
        for j in range(p.frequencies_count):
            omega = two_pi * p.frequencies[j]
            value += p.weights[j] * math.sin(omega * t + p.phases[j])
            slope += p.weights[j] * omega * math.cos(omega * t + p.phases[j])
        return value, slope
    if kind == PRBS:
        return bits[int(t / p.bit_time + _ON_TIME) % bits.size], 0.0
    if kind == KNOTS:
        return _between_knots(t, p)
    return 0.0, 0.0


@inner
def waveform(t: float, p: Waveform, bits: FloatArray) -> tuple[float, float]:
    """
    Return value and slope of a test signal at a time.

    t : time since the waveform was chosen [s]
    p : Waveform
    bits : from `prbs_bits`
    """
    if p.waveform == EXTERNAL:
        return p.offset + p.external, 0.0
    since = t - p.start_after
    if since < -_ON_TIME * p.period:
        return p.offset, 0.0
    value, slope = _shape(max(since, 0.0), p, bits)
    return p.offset + p.amplitude * value, p.amplitude * slope


@compiled
def values(t: FloatArray, p: Waveform, bits: FloatArray, y: FloatArray) -> None:
    """
    Write the values of a test signal at any times.

    t : times since the waveform was chosen [s], shape (n,)
    p : record of Waveform
    bits : from `prbs_bits`; any array if the waveform is another
    y : receives the values, shape (n,)
    """
    for i in range(t.size):
        y[i] = waveform(t[i], p, bits)[0]


@compiled
def sample(
        first: int, count: int, h: float, origins: FloatArray, records: Any, bits: FloatArray,
        y: FloatArray,
) -> None:
    """
    Write both test signals at `count` macro-steps.

    first, count : number of the first macro-step, and how many
    h : macro-step [s]
    origins : time at which each waveform was chosen [s], shape (2,)
    records : the record of TestSignal, in an array of one: numba looks anew at a single record in
        every call, which takes longer than the rest
    bits : from `prbs_bits`
    y : receives value and derivative of the outputs, shape (count, 2, 2)
    """
    p = records[0]
    for i in range(count):
        t = (first + i) * h - p.delay
        value, slope = waveform(t - origins[OUTPUT.rate_command], p.rate, bits)
        put(y[i], OUTPUT.rate_command, value, slope)
        value, slope = waveform(t - origins[OUTPUT.external_torque], p.torque, bits)
        put(y[i], OUTPUT.external_torque, value, slope)


SOURCE = Source(kind=TestSignal, bare='rate', outputs=OUTPUTS)
