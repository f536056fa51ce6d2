# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The last minute of every signal as least, greatest and last value of short intervals.

A strip chart of a thousand pixels cannot show sixty thousand samples. Of each interval the least
and the greatest value are kept, so no peak is lost. Memory does not grow. Nothing here needs ROS.
"""

import struct
from threading import Lock
from typing import NamedTuple

from antenna_drive.physics.arrays import FloatArray
import numpy as np

# Length of an interval [s of simulated time], if the macro-step is not longer.
INTERVAL_S = 0.01
# How many are kept: one minute.
KEPT = 6000

# kind, number of intervals, number of signals, a reserve; run, number of the first interval, its
# length [s], time of the last step [s], macro-step [s]
_PACKED = struct.Struct('<4I5d')
SAMPLES = 1


class Piece(NamedTuple):
    """A part of the history: intervals that follow each other."""

    run: int
    first: int  # number of the first interval
    interval_s: float  # length of an interval [s]
    time_s: float  # time of the last step [s]
    step_s: float  # macro-step [s]
    resume: int  # number of the first interval that may still change: ask for it again
    lows: FloatArray  # shape (intervals, signals), NaN where nothing was received
    highs: FloatArray  # the same
    ends: FloatArray  # the same of the value at the last step of each interval
    now: FloatArray  # the last value of each signal, shape (signals,)

    def packed(self) -> bytes:
        """Return the bytes that the page reads: a header, then numbers of four bytes."""
        intervals, signals = self.lows.shape
        return _PACKED.pack(SAMPLES, intervals, signals, 0, float(self.run), float(self.first),
                            self.interval_s, self.time_s, self.step_s) + b''.join(
            part.astype('<f4').tobytes() for part in (self.lows, self.highs, self.now))


class History:
    """
    Takes the steps of a drive from one thread; gives pieces to any other.

    run : the run in progress, 0 for none
    """

    def __init__(self, signals: int) -> None:
        """Begin with no run; so many signals come with each step."""
        self._lock = Lock()
        self._lows = np.full((KEPT, signals), np.nan)
        self._highs, self._ends = self._lows.copy(), self._lows.copy()
        self._now = np.full(signals, np.nan)
        self.begin(0, 1e-3)

    def begin(self, run: int, step_s: float) -> None:
        """Forget all for a run with macro-steps of `step_s` [s]."""
        with self._lock:
            self.run, self._step_s = run, step_s
            self._per = max(1, round(INTERVAL_S / step_s))
            self._newest = self._last = -1
            for ring in (self._lows, self._highs, self._ends):
                ring[:] = np.nan

    def take(self, step: int, values: FloatArray) -> None:
        """
        Take a step of the run, later than those before.

        step : of the run
        values : of each signal, shape (signals,)
        """
        with self._lock:
            interval = step // self._per
            for begun in range(max(self._newest, interval - KEPT) + 1, interval + 1):
                for ring in (self._lows, self._highs, self._ends):
                    ring[begun % KEPT] = np.nan
            self._newest, self._last, self._now = interval, step, values
            slot = interval % KEPT
            np.fmin(self._lows[slot], values, out=self._lows[slot])
            np.fmax(self._highs[slot], values, out=self._highs[slot])
            if step % self._per == self._per - 1:
                self._ends[slot] = values

    def since(self, run: int, first: int) -> Piece:
        """
        Return what is known from interval `first` of `run` on, all that is kept for another run.

        The last interval may still grow: it comes again with the next piece.
        """
        with self._lock:
            first = max(0, first if run == self.run else 0, self._newest - KEPT + 1)
            slots = np.arange(first, self._newest + 1) % KEPT
            return Piece(self.run, first, self._per * self._step_s,
                         max(0, self._last) * self._step_s, self._step_s,
                         max(first, (self._last + 1) // self._per),
                         self._lows[slots], self._highs[slots], self._ends[slots],
                         self._now.copy())
