# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Evaluation of a run: plateaus, overshoot, settling, time at zero."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from antenna_drive.emulator.unit import FloatArray
import numpy as np

# A response has settled when it stays within this share of its final value.
SETTLING_BAND = 0.05


@dataclass(frozen=True)
class Response:
    """A step response: final value in the signal's unit, overshoot [1], settling time [s]."""

    final: float
    overshoot: float
    settling_s: float


def step_response(time: FloatArray, value: FloatArray, tail_s: float = 1.0) -> Response:
    """
    Read a step response that begins at time zero.

    time : [s], shape (n,)
    value : shape (n,)
    tail_s : length of the end of the run whose mean is the final value [s]
    """
    final = float(value[time > time[-1] - tail_s].mean())
    outside = np.flatnonzero(np.abs(value - final) > SETTLING_BAND * abs(final))
    settling = 0.0 if outside.size == 0 else float(time[min(outside[-1] + 1, time.size - 1)])
    return Response(final, float(value.max() / final - 1.0), settling)


@dataclass(frozen=True)
class BiasRange:
    """The bias voltage of a run: minimum and maximum [V], share of the time at zero [1]."""

    low_V: float
    high_V: float
    zero_fraction: float


def bias_range(time: FloatArray, voltage: FloatArray, after_s: float) -> BiasRange:
    """
    Read the range of the bias voltage [V], shape (n,), after the start-up.

    time : [s], shape (n,)
    voltage : [V], shape (n,)
    after_s : samples before this time are ignored [s]
    """
    kept = voltage[time >= after_s]
    return BiasRange(float(kept.min()), float(kept.max()), float(np.mean(kept <= 1e-9)))


def plateau(time: FloatArray, value: FloatArray, period: float, window: tuple[float, float],
            ) -> float:
    """
    Return the mean of a response in a window after each reversal, without the first period.

    time, value : shape (n,)
    period : of the square wave [s]; it is positive in its first half
    window : start and end after each reversal [s]

    Returns the mean of the signal times the sign of the command.
    """
    sign, since = _half_periods(time, period)
    used = (time >= period) & (since >= window[0]) & (since <= window[1])
    return float(np.mean(sign[used] * value[used]))


def deviation(time: FloatArray, value: FloatArray, period: float, window: tuple[float, float],
              ) -> float:
    """Return the rms of a signal in a window after each reversal; arguments as in `plateau`."""
    _, since = _half_periods(time, period)
    used = (time >= period) & (since >= window[0]) & (since <= window[1])
    return float(np.sqrt(np.mean(value[used] ** 2)))


def _half_periods(time: FloatArray, period: float) -> tuple[FloatArray, FloatArray]:
    """Return the command's sign and the time since its last reversal [s]."""
    half = 0.5 * period
    number = np.floor(time / half + 1e-9)
    return np.where(number % 2 == 0, 1.0, -1.0), time - number * half


def _mean(time: FloatArray, value: FloatArray, after: float = 0.0) -> float:
    """Return the mean from a time on, without the last sample, which begins another period."""
    return float(value[time >= after][:-1].mean())


def falls(values: Sequence[float]) -> float:
    """Return the largest rise between neighbours: below zero if the figures fall strictly."""
    return float(np.diff(values).max())


def falls_then_rises(values: Sequence[float]) -> float:
    """Return the largest step against 'falls, then rises', for the best turning point."""
    return min(max(falls(values[:turn + 1]), falls([-value for value in values[turn:]]))
               for turn in range(1, len(values) - 1))


# Evaluations of a signal: (time, value, arguments) to a number.
KINDS: dict[str, Callable[..., float]] = {
    'plateau': plateau,
    'deviation': deviation,
    'mean': _mean,
    'low': lambda time, value, after=0.0: bias_range(time, value, after).low_V,
    'high': lambda time, value, after=0.0: bias_range(time, value, after).high_V,
    'time_at_zero': lambda time, value, after=0.0: bias_range(time, value, after).zero_fraction,
    'final': lambda time, value, tail_s=1.0: step_response(time, value, tail_s).final,
    'overshoot': lambda time, value, tail_s=1.0: step_response(time, value, tail_s).overshoot,
    'settling': lambda time, value, tail_s=1.0: step_response(time, value, tail_s).settling_s,
}
TRENDS: dict[str, Callable[[Sequence[float]], float]] = {
    'falls': falls,
    'falls then rises': falls_then_rises,
}
