# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a test does to the drive, and the steps in which it is simulated.

The waveform of a test sheet is exact: its jumps are known to the microsecond. A command that is
known from its samples is a `RecordedCommand`.
"""

from dataclasses import dataclass
from functools import cached_property
import math
from typing import Any, TypeAlias

from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import record_of
from antenna_drive.physics import signal_generator
from antenna_drive.recording import sheet as sheets
from antenna_drive.recording.sheet_signal import test_signal_of
import numpy as np
from simgap.machine.contract import FloatArray

# Places within a step at which the command is read; jumps may be at its ends.
_PLACES = np.array([0.1, 0.5, 0.9])
_NO_BITS = np.ones(1)   # no test sheet has a pseudo-random sequence
_PARABOLA = np.linalg.inv(np.vander(_PLACES, 3, increasing=True))


@dataclass(frozen=True)
class SheetCommand:
    """The waveform of a test sheet, as the drive's own test signal plays it."""

    waveform: sheets.Waveform

    @cached_property
    def _record(self) -> Any:
        return record_of(test_signal_of(self.waveform))[0]

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the rate command [rad/s] at these times [s]."""
        command = np.empty(time.size)
        signal_generator.values(time, self._record, _NO_BITS, command)
        return command

    def knots(self, end: float) -> FloatArray:
        """Return the times up to `end` at which the command or its slope jumps [s]."""
        w = self.waveform
        if isinstance(w, (sheets.Square, sheets.Triangle)):
            period, phase = w.period_s or 1.0, w.phase or 0.0
            first = 0.0 if isinstance(w, sheets.Square) else 0.25
            cycles = np.arange(np.floor(phase) - 1.0, end / period + phase + 1.0, 0.5) + first
            times = (cycles - phase) * period
        elif isinstance(w, sheets.Knots):
            times = np.unique(w.times_s or ())
        else:
            start = w.start_s or 0.0
            sweep = (w.duration_s or 0.0) if isinstance(w, sheets.Chirp) else 0.0
            times = np.unique([start, start + sweep])
        return times[(times > 0.0) & (times < end)]


# An axis rate command over time.
CommandedRate: TypeAlias = SheetCommand | RecordedCommand


@dataclass(frozen=True)
class Bias:
    """A source of bias voltage: `before` until `at` [s], `after` from then on [V]."""

    before: float = 0.0
    after: float = 0.0
    at: float = 0.0


@dataclass(frozen=True)
class Longest:
    """How long a step of the integration may be."""

    usual: float  # at most so long [s]
    shortest: float = 0.0  # even where a wave asks for less [s]
    wave: float = math.inf  # angle by which a wave may turn in a step [rad]
    cycles: float = 0.0  # of the fastest wave per turn of the axis, 0 for none


def schedule(command: CommandedRate, bias: Bias, samples: FloatArray, longest: Longest,
             delay: float = 0.0) -> batch.Schedule:
    """
    Plan the integration of a test: no step reaches across a sample, a jump, or `longest`.

    samples : when the sensors are read, increasing, none before zero, shape (n,) [s]
    delay : by which the command comes late [s]
    """
    end = float(samples[-1])
    jumps = np.r_[command.knots(end) + delay, delay, bias.at]
    knots = np.unique(np.r_[0.0, samples, jumps[(jumps > 0.0) & (jumps < end)]])
    # a jump on a sample needs no step of its own
    knots = knots[np.r_[True, np.diff(knots) > 1e-9]]
    rate = command(0.5 * (knots[:-1] + knots[1:]) - delay)
    asked = longest.wave / np.maximum(longest.cycles * np.abs(rate), 1e-9)
    allowed = np.minimum(longest.usual, np.maximum(longest.shortest, asked))
    pieces = np.maximum(np.ceil(np.diff(knots) / allowed - 1e-6).astype(int), 1)
    first = np.repeat(knots[:-1], pieces)
    length = np.repeat(np.diff(knots) / pieces, pieces)
    number = np.arange(first.size) - np.repeat(np.r_[0, np.cumsum(pieces)[:-1]], pieces)
    start = first + number * length
    steps = np.zeros((start.size, batch.COLUMNS))
    steps[:, batch.LENGTH] = length
    places = start[:, np.newaxis] + _PLACES * length[:, np.newaxis]
    shape = command(places.ravel() - delay).reshape(places.shape) @ _PARABOLA.T
    steps[:, batch.COMMAND] = shape[:, 0]
    steps[:, batch.SLOPE] = shape[:, 1] / length
    steps[:, batch.CURVE] = shape[:, 2] / length ** 2
    rows = np.full(start.size + 1, -1)
    ends = np.r_[0.0, np.cumsum(length)]
    at = np.searchsorted(ends, samples - 1e-8)
    rows[np.minimum(at, start.size)] = np.arange(samples.size)
    return with_bias(batch.Schedule(steps, rows), bias)


def with_bias(plan: batch.Schedule, bias: Bias) -> batch.Schedule:
    """Return a plan with other voltages of the bias source, which steps at the same time."""
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    middle = np.cumsum(length) - 0.5 * length
    steps[:, batch.FIXED_BIAS] = np.where(middle < bias.at, bias.before, bias.after)
    return batch.Schedule(steps, plan.keep)
