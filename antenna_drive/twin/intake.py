# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What comes from a real drive, as it comes: rubbish is counted by name, the rest is kept.

A sample is a signal, a time stamp and a number. What is no finite number, or beyond anything that
the drive can do, is left out. So is a stamp that is not later than the one before. Where the time
jumps, the samples before and after it do not belong together: a new stretch begins. Where nothing
comes, or too much of it is rubbish, `InputFaults` says so.
"""

from array import array
from collections import Counter, deque
import math

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.readings import RATE_COMMAND, READINGS
from antenna_drive.recording.recording import Recording, unit_of
from antenna_drive.recording.sheet import TestSheet
import numpy as np
from numpy.typing import NDArray
from simgap.logs.channel import Channel, make_channel, NANOSECONDS

# No drive of this kind shows more, in the unit of each signal.
_MOST = {RATE_COMMAND: 0.1, **{reading.signal: reading.sensor.most for reading in READINGS}}
# A stamp that is earlier than the one before by less is a message that came late [s].
LATE_S = 1.0
# Without a command for longer than this, nobody knows what the drive did [s].
HOLE_S = 0.5
# Input is bad if more than this share of a signal's samples of the last blocks was rubbish.
_RUBBISH_SHARE = 0.02
_RUBBISH_BLOCKS = 10


class Intake:
    """
    The samples of the last minutes.

    keep_s : how much of each signal is kept [s]
    """

    def __init__(self, keep_s: float = 300.0) -> None:
        self._keep_ns = int(keep_s * NANOSECONDS)
        self._stamps: dict[str, array[int]] = {}
        self._values: dict[str, array[float]] = {}
        self._taken: dict[str, int] = {}
        self.rubbish: Counter[tuple[str, str]] = Counter()
        self.accepted: Counter[str] = Counter()
        self.jumps: list[str] = []
        self.stretch = 0

    def put(self, name: str, stamp_ns: int, value: float) -> bool:
        """
        Take a sample; return whether it is a good one.

        name : 'unit/signal': the rate command, or one of the readings
        stamp_ns : of any clock, the same for all signals [ns]
        value : SI units, article amperes
        """
        what = _fault(name, value)
        if what:
            self.rubbish[name, what] += 1
            return False
        stamps = self._stamps.get(name)
        if stamps:
            since = (stamp_ns - stamps[-1]) / NANOSECONDS
            if since < -LATE_S:
                self._jump(f'the time jumped back by {-since:.3g} s')
            elif since <= 0.0:
                self.rubbish[name, 'late or repeated'] += 1
                return False
            elif name == RATE_COMMAND and since > HOLE_S:
                self._jump(f'no {RATE_COMMAND} for {since:.3g} s')
        self._stamps.setdefault(name, array('q')).append(stamp_ns)
        self._values.setdefault(name, array('d')).append(value)
        self.accepted[name] += 1
        return True

    def _jump(self, why: str) -> None:
        self.jumps.append(why)
        del self.jumps[:-20]
        self.stretch += 1
        self._stamps, self._values, self._taken = {}, {}, {}

    def new(self, name: str, until_ns: int | None = None,
            ) -> tuple[NDArray[np.int64], FloatArray]:
        """
        Return the samples that have not been taken yet.

        name : of the signal
        until_ns : leave those from this stamp on for later; None: take all [ns]
        """
        stamps = self._stamps.get(name)
        if stamps is None:
            return np.zeros(0, np.int64), np.zeros(0)
        first = self._taken.get(name, 0)
        found = np.array(stamps[first:], np.int64)
        count = found.size if until_ns is None else int(np.searchsorted(found, until_ns))
        values = np.array(self._values[name][first:first + count], np.float64)
        self._taken[name] = first + count
        return found[:count], values

    def again(self) -> None:
        """Give all that is kept once more."""
        self._taken = {}

    def forget(self) -> None:
        """Drop samples that were taken and are older than what is kept."""
        for name, stamps in self._stamps.items():
            if not stamps or stamps[0] > stamps[-1] - 2 * self._keep_ns:
                continue
            old = min(int(np.searchsorted(np.array(stamps, np.int64),
                                          stamps[-1] - self._keep_ns)), self._taken.get(name, 0))
            del stamps[:old]
            del self._values[name][:old]
            self._taken[name] = self._taken.get(name, 0) - old

    def newest(self) -> dict[str, int]:
        """Return the last stamp of each signal [ns]."""
        return {name: stamps[-1] for name, stamps in self._stamps.items() if stamps}

    def span_s(self, since_ns: int | None = None) -> float:
        """Return how much of the command is kept, from a stamp on [s]."""
        stamps = self._stamps.get(RATE_COMMAND)
        if not stamps:
            return 0.0
        begin = stamps[0] if since_ns is None else max(stamps[0], since_ns)
        return (stamps[-1] - begin) / NANOSECONDS

    def recording(self, sheet: TestSheet, since_ns: int | None = None) -> Recording:
        """
        Return what is kept as a recording, whose time counts from its first sample.

        sheet : of the test
        since_ns : leave out what is earlier [ns]
        """
        channels: dict[str, Channel] = {}
        first = min((stamps[0] for stamps in self._stamps.values() if stamps), default=0)
        begin = first if since_ns is None else max(first, since_ns)
        for name, stamps in self._stamps.items():
            time = np.array(stamps, np.int64)
            place = int(np.searchsorted(time, begin))
            if time.size > place:
                channels[name] = make_channel(
                    name, unit_of(name) or '1', time[place:] - begin,
                    np.array(self._values[name][place:], np.float64))
        return Recording(channels, sheet=sheet)


def _fault(name: str, value: float) -> str:
    """Return what is wrong with a number; '' if nothing is."""
    if math.isnan(value):
        return 'not a number'
    if math.isinf(value):
        return 'infinite'
    return '' if abs(value) <= _MOST.get(name, math.inf) else 'out of range'


def known(name: str) -> bool:
    """Return whether a twin has a use for a signal."""
    return name in _MOST


class InputFaults:
    """
    Watches the counts of an intake.

    stale : whether no sample has come for so long that the real drive has stopped
    """

    def __init__(self, intake: Intake, stale_s: float) -> None:
        """Watch an intake; without new samples for `stale_s`, the real drive has stopped [s]."""
        self._intake, self._stale_s = intake, stale_s
        self._last_put: tuple[int, float] = (0, -math.inf)
        self._before: deque[tuple[dict[str, int], dict[str, int]]] = deque(
            maxlen=_RUBBISH_BLOCKS)
        self.stale = False

    def look(self, now_s: float) -> None:
        """Look whether samples come, by the time of any steady clock [s]."""
        count = sum(self._intake.accepted.values())
        if count != self._last_put[0]:
            self._last_put = (count, now_s)
        self.stale = bool(count) and now_s - self._last_put[1] > self._stale_s

    def end_block(self) -> None:
        """Note the counts at the end of a block."""
        self._before.append((self._rubbish(), dict(self._intake.accepted)))

    def _rubbish(self) -> dict[str, int]:
        counts: dict[str, int] = {}
        for (name, _), count in self._intake.rubbish.items():
            counts[name] = counts.get(name, 0) + count
        return counts

    def found(self) -> dict[str, str]:
        """Return the signals of which too much was rubbish lately, and what it was."""
        found: dict[str, str] = {}
        if self._before:
            before, accepted = self._before[0]
            for name, count in self._rubbish().items():
                new = count - before.get(name, 0)
                good = self._intake.accepted[name] - accepted.get(name, 0)
                if new > max(_RUBBISH_SHARE * good, 3):
                    kinds = [kind for key, kind in self._intake.rubbish if key == name]
                    found[name] = f'{new} samples {" or ".join(kinds)}'
        return found
