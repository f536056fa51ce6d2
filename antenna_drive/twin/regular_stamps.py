# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
When the samples of a regular sender were taken, from stamps that are late now and then.

A message without a time of its own is stamped when it is sent. The sender takes samples at even
intervals, but sends some of them late: by a fraction of a millisecond mostly, and by many where it
had no processor. An axis that moves at 0.01 rad/s is elsewhere by 10 microrad after a millisecond.

A delay-locked loop follows the even times (F. Adriaensen, Using a DLL to filter time, 2005): its
phase and period follow the stamps with a bandwidth far below the rate of the samples, so a drift
of the sender's clock is followed and a single late stamp is not. A stamp that is late by more
than half a period belongs to the sample after a missing one, or to a sample in a queue that is
sent all at once. The stamps that follow tell which.
"""

from collections import deque
from itertools import pairwise
import math
from statistics import median

from antenna_drive.twin.intake import HOLE_S, LATE_S
import numpy as np
from simgap.logs.channel import NANOSECONDS

# Samples from which the period and the phase are learned.
LEARNED = 100
# A sender is regular if so many of these intervals differ by less from the median, in periods.
_ALIKE, _SHARE = 0.25, 0.7
# Bandwidth of the loop after learning, and in the end [Hz].
_BANDWIDTH_HZ = (0.5, 0.05)
# Errors count up to this, in periods; those of late stamps so much less, because stamps are seldom
# early.
_CLIP = 0.1
_LATE_COUNTS = 0.3
# How far ahead the stamps are looked at before one is settled [s].
AHEAD_S = 0.25
# So many errors of more than half a period in a row, and the sender has another rhythm.
_ASTRAY = 50


class RegularSamples:
    """Samples of signals whose stamps are those of messages, at even times."""

    def __init__(self) -> None:
        self._signals: dict[str, tuple[RegularStamps, deque[float]]] = {}
        self._last: dict[str, int] = {}

    def put(self, name: str, stamp_ns: int, value: float) -> list[tuple[str, int, float]]:
        """
        Take a sample; return those that are settled, of this signal.

        name : of the signal
        stamp_ns : of the message [ns]
        value : of the sample, also if it is rubbish

        Returns the name, time [ns] and value of each; after a pause, or if the time jumps back,
        those that waited come as they were stamped.
        """
        since = stamp_ns - self._last.get(name, stamp_ns - 1)
        if -LATE_S * NANOSECONDS <= since <= 0:
            return [(name, stamp_ns, value)]  # late or repeated, and told as such
        self._last[name] = stamp_ns
        flushed: list[tuple[str, int, float]] = []
        if name in self._signals and not 0 < since <= HOLE_S * NANOSECONDS:
            stamps, values = self._signals.pop(name)
            flushed = [(name, *item) for item in zip(stamps.waiting, values, strict=True)]
        stamps, values = self._signals.setdefault(name, (RegularStamps(), deque()))
        values.append(value)
        return flushed + [(name, time, values.popleft()) for time in stamps.put(stamp_ns)]


class RegularStamps:
    """
    The even times of one signal's samples.

    waiting : stamps of those that are not settled yet [ns]
    """

    def __init__(self) -> None:
        self.waiting: deque[int] = deque()
        self._learn()

    def _learn(self) -> None:
        self._period = 0.0  # [ns]; 0: not known
        self._zero = 0  # a stamp from which times count, as a float has no room for all of them
        self._next = 0.0  # when the next sample is taken [ns]
        self._irregular = False
        self._settled = self._astray = 0

    def put(self, stamp_ns: int) -> list[int]:
        """
        Take the stamp of the next sample; return the times of those that are settled.

        stamp_ns : later than the one before [ns]

        Returns the times of the oldest samples that were not settled yet, increasing but where
        another rhythm was learned; those of an irregular sender as they came [ns].
        """
        waiting = self.waiting
        waiting.append(stamp_ns)
        if self._period == 0.0 and not self._irregular:
            if len(waiting) < LEARNED:
                return []
            self._fit()
        settled: list[int] = []
        if self._irregular:
            settled.extend(waiting)
            waiting.clear()
            return settled
        while waiting and waiting[-1] - waiting[0] > AHEAD_S * NANOSECONDS:
            settled.append(self._settle())
            if self._period == 0.0:
                break
        return settled

    def _fit(self) -> None:
        """Take period and phase from the first stamps, or find that they are not regular."""
        stamps = list(self.waiting)
        steps = [later - earlier for earlier, later in pairwise(stamps)]
        period = median(steps)
        alike = sum(abs(step - period) < _ALIKE * period for step in steps)
        if alike < _SHARE * len(steps):
            self._irregular = True
            return
        # which of the even times each is; those of a queue share one, and are outnumbered
        index = np.cumsum([0, *(round(step / period) for step in steps)])
        self._zero = stamps[0]
        time = np.array(stamps) - self._zero
        half = len(stamps) // 2
        self._period = float(np.median((time[half:] - time[:-half])
                                       / (index[half:] - index[:-half])))
        # a first sample that was late is as many periods earlier as are needed for the others
        first = float(np.min(index - np.arange(index.size)))
        self._next = float(np.median(time - self._period * index)) + first * self._period

    def _settle(self) -> int:
        """Return the time of the oldest sample that waits."""
        self._next += self._missing() * self._period
        error = self.waiting.popleft() - self._zero - self._next
        time = self._zero + round(self._next)
        self._settled += 1
        rate = NANOSECONDS / self._period
        first, last = _BANDWIDTH_HZ
        omega = 2.0 * math.pi / rate * max(last, first / (1.0 + self._settled / rate))
        clip = _CLIP * self._period
        counted = max(error, -clip) if error < 0.0 else _LATE_COUNTS * min(error, clip)
        self._next += self._period + math.sqrt(2.0) * omega * counted
        self._period += omega * omega * counted
        self._astray = self._astray + 1 if abs(error) > 0.5 * self._period else 0
        if self._astray > _ASTRAY:
            self._learn()
        return time

    def _missing(self) -> int:
        """Return how many samples are missing before the oldest that waits."""
        expected = self._zero + round(self._next)
        if self.waiting[0] - expected < 0.5 * self._period:
            return 0
        late = [math.floor((stamp - expected) / self._period + 0.5) for stamp in self.waiting]
        allowed = late[-1]
        for place in reversed(late[:-1]):
            allowed = min(place, allowed - 1)
        return max(allowed, 0)
