# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The last minute of every signal as least, greatest and last value of short intervals.

A strip chart of a thousand pixels cannot show sixty thousand samples. Of each interval the least
and the greatest value are kept, so no peak is lost. Memory does not grow. Nothing here needs ROS.
"""

from collections.abc import Mapping
import struct
from threading import Lock
from typing import Any, NamedTuple

from antenna_drive.lockstep.frame import HEADER, LARGEST_RUN, NO_RUN
from antenna_drive.physics.arrays import FloatArray
import numpy as np

# Length of an interval [s of simulated time], if the macro-step is not longer.
INTERVAL_S = 0.01
# How many are kept: one minute.
KEPT = 6000

# A step this far ahead of the last one was not made by the drive.
_FARTHEST = 100_000

_RUN, _STEP, _STEP_S, _SENDER = range(len(HEADER))
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
    Takes the frames of the units in any portions, from one thread; gives pieces to any other.

    run : the run in progress, 0 for none
    lost : steps of any unit that were missed after the first that was received
    """

    def __init__(self, signals: Mapping[str, int], conductor: str) -> None:
        """
        Begin with no run.

        signals : how many signals each unit puts out, in the order of the columns
        conductor : the unit whose frames tell the run
        """
        self._columns: dict[str, slice] = {}
        first = 0
        for unit, count in signals.items():
            self._columns[unit] = slice(first, first + count)
            first += count
        self._conductor = conductor
        self._lock = Lock()
        self._lows = np.full((KEPT, first), np.nan)
        self._highs = self._lows.copy()
        self._ends = self._lows.copy()
        self._now = np.full(first, np.nan)
        self._early: dict[str, FloatArray] = {}
        self.lost = 0
        self._begin(0, 1e-3)

    def _begin(self, run: int, step_s: float) -> None:
        self.run, self._step_s = run, step_s
        self._per = max(1, round(INTERVAL_S / step_s))
        self._newest = -1
        self._last = dict.fromkeys(self._columns, -1)
        self._senders: dict[str, float] = {}
        for ring in (self._lows, self._highs, self._ends):
            ring[:] = np.nan

    def take(self, unit: str, frames: FloatArray) -> None:
        """
        Take frames of a unit in the order in which they were sent.

        unit : that sent them
        frames : rows of a `FrameLayout`: header, then value and derivative of each signal; what is
            not finite or of another run is left out
        """
        with self._lock:
            early = self._early.pop(unit, None)
            if early is not None:
                frames = np.concatenate([early, frames])
            frames = frames[np.isfinite(frames).all(axis=1)]
            if unit == self._conductor:
                runs = frames[_plausible(frames)]
                if len(runs) and int(runs[-1, _RUN]) != self.run:
                    self._begin(int(runs[-1, _RUN]), float(runs[-1, _STEP_S]))
            mine = frames[frames[:, _RUN] == self.run]
            if unit != self._conductor and early is None and len(mine) < len(frames):
                # of a run that the conductor's frames, which are read first, did not tell yet
                self._early[unit] = frames[frames[:, _RUN] > self.run]
            if self.run and len(mine):
                # where two nodes have one name, those of the first: a mixture is no curve
                sender = self._senders.setdefault(unit, float(mine[0, _SENDER]))
                self._file(unit, mine[mine[:, _SENDER] == sender])

    def _file(self, unit: str, frames: FloatArray) -> None:
        last = self._last[unit]
        steps = frames[:, _STEP].astype(np.int64)
        fresh = (steps > last) & (frames[:, _STEP] < LARGEST_RUN)
        if last >= 0:
            fresh &= steps <= last + _FARTHEST
        # in order: what somebody else puts in between is left out
        fresh &= steps >= np.maximum.accumulate(np.where(fresh, steps, -1))
        steps, values = steps[fresh], frames[fresh, len(HEADER)::2]
        if not len(steps):
            return
        known = np.diff(steps, prepend=last if last >= 0 else steps[0] - 1)
        self.lost += int((known - 1)[known > 1].sum())
        self._last[unit] = int(steps[-1])
        columns = self._columns[unit]
        self._now[columns] = values[-1]
        intervals = steps // self._per
        begins = np.flatnonzero(np.diff(intervals, prepend=-1))
        numbers = intervals[begins]
        self._make_room(int(numbers[-1]))
        kept = numbers > self._newest - KEPT
        slots = numbers[kept] % KEPT
        for ring, least in ((self._lows, np.minimum), (self._highs, np.maximum)):
            found = least.reduceat(values, begins)[kept]
            ignore_nan = np.fmin if least is np.minimum else np.fmax
            ring[slots, columns] = ignore_nan(ring[slots, columns], found)
        complete = (steps % self._per == self._per - 1) & (intervals > self._newest - KEPT)
        self._ends[intervals[complete] % KEPT, columns] = values[complete]

    def _make_room(self, newest: int) -> None:
        """Forget the oldest intervals for those up to `newest`."""
        if newest <= self._newest:
            return
        forget = np.arange(max(self._newest + 1, newest - KEPT + 1), newest + 1) % KEPT
        for ring in (self._lows, self._highs, self._ends):
            ring[forget] = np.nan
        self._newest = newest

    def since(self, run: int, first: int) -> Piece:
        """
        Return what is known from interval `first` of `run` on, all that is kept for another run.

        The last interval may still grow: it comes again with the next piece.
        """
        with self._lock:
            last_step = min(self._last.values())
            last = last_step // self._per
            first = max(0, first if run == self.run else 0, self._newest - KEPT + 1)
            slots = np.arange(first, last + 1) % KEPT
            return Piece(self.run, first, self._per * self._step_s,
                         max(0, last_step) * self._step_s, self._step_s,
                         max(first, (last_step + 1) // self._per),
                         self._lows[slots], self._highs[slots], self._ends[slots],
                         self._now.copy())


def _plausible(frames: FloatArray) -> Any:
    run, step_s = frames[:, _RUN], frames[:, _STEP_S]
    return (run > NO_RUN) & (run < LARGEST_RUN) & (run % 1.0 == 0.0) & (step_s > 0.0)
