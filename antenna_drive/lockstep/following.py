# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The steps of a running drive, put together from the frames of its units by somebody who listens.

Unlike a member of the lock-step, who is there from step 0 on, a `Follower` may come at any time.
The units then send what they remember, which may have gaps: a follower begins behind the last of
them. It turns to another run when the conductor speaks of it and every unit has sent a step of it:
a frame that somebody invents begins no run. Nothing here needs ROS.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from antenna_drive.lockstep.frame import HEADER, NO_RUN, SENDER
from antenna_drive.lockstep.inbox import fault_of, Frame

# Units are a few steps apart at most; more incomplete steps than this are not genuine.
_DEPTH = 4096

# Runs of which frames are kept, and runs that are over and remembered as such.
_MOST_RUNS = 8
_MOST_PAST_RUNS = 16


class Step(NamedTuple):
    """One complete step of a drive."""

    run: int
    number: int
    step_s: float  # macro-step [s]
    numbers: list[float]  # of every signal its value and time derivative

    @property
    def values(self) -> list[float]:
        """Return the value of every signal."""
        return self.numbers[::2]


class _Run:
    """The frames of one run, until every unit has sent its own of a step."""

    def __init__(self) -> None:
        self.steps: dict[int, dict[str, Frame]] = {}
        self.complete: deque[int] = deque()
        self.next: int | None = None
        self.senders: dict[str, float] = {}
        # the conductor's newest step when every unit was heard: what is older are memories
        self.newest: int | None = None

    def has_begun(self, over: bool) -> bool:
        """Return whether all memories have come; drop those before their last gap."""
        if self.next is None:
            if not self.complete or not over and (
                    self.newest is None or self.complete[-1] < self.newest):
                return False
            known, first = set(self.complete), self.complete[-1]
            while first - 1 in known:
                first -= 1
            self.complete = deque(sorted(number for number in known if number >= first))
            for older in [number for number in self.steps if number < first]:
                del self.steps[older]
        return True

    def trim(self) -> None:
        """Drop half of too many incomplete steps: the farthest, or the oldest before the first."""
        numbers = list(self.steps)
        unwanted = (numbers[:_DEPTH // 2] if self.next is None
                    else sorted(numbers)[_DEPTH // 2:])
        for number in {*unwanted} - {*self.complete}:
            del self.steps[number]


class Follower:
    """
    Puts frames together to steps.

    lengths : how many numbers a frame of each unit has
    run : the run in progress, 0 for none
    lost : steps that were missed after the first that was seen, in all runs together
    refused : frames that are none: wrong length, NaN or infinite, no run, no step, another than
        was sent before, or of a second sender
    doubled : of each unit in whose name two have sent frames of one run, those two
    """

    def __init__(self, lengths: Mapping[str, int], conductor: str) -> None:
        """
        Prepare to follow.

        lengths : how many numbers a frame of each unit has, in the order of the signals
        conductor : the unit that owns the run: nobody else begins one
        """
        self.lengths = dict(lengths)
        self._conductor = conductor
        self._runs: dict[float, _Run] = {}
        self._past: deque[float] = deque(maxlen=_MOST_PAST_RUNS)
        self._announced = NO_RUN
        self.run = 0
        self.lost = 0
        self.refused = 0
        self.doubled: dict[str, tuple[float, float]] = {}
        self._over = False

    @property
    def senders(self) -> dict[str, float]:
        """Return whose frames of the run in progress are read, by unit."""
        return dict(self._runs[self.run].senders) if self.run else {}

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the units whose frame of the next step has not come."""
        run = self._runs.get(self._announced)
        frames = {} if run is None else run.steps.get(run.next or 0, {})
        return tuple(unit for unit in self.lengths if unit not in frames)

    def finish(self) -> None:
        """Expect no more frames: memories need not wait for newer ones."""
        self._over = True

    def receive(self, unit: str, frame: Frame) -> None:
        """Take in a frame of a unit."""
        if fault_of(frame, self.lengths[unit]) is not None:
            self.refused += 1
            return
        if frame[0] == NO_RUN or frame[0] in self._past:
            return
        if unit == self._conductor:
            self._announced = frame[0]
        if frame[0] not in self._runs:
            if len(self._runs) >= _MOST_RUNS:
                del self._runs[next(known for known in self._runs if known != self.run)]
            self._runs[frame[0]] = _Run()
        self._file(unit, frame, self._runs[frame[0]])

    def _file(self, unit: str, frame: Frame, run: _Run) -> None:
        number, sender = int(frame[1]), run.senders.setdefault(unit, frame[SENDER])
        if frame[SENDER] != sender:
            self.refused += 1
            self.doubled[unit] = sender, frame[SENDER]
            return
        if run.next is not None and number < run.next:
            return
        frames = run.steps.get(number)
        if frames is None:
            if len(run.steps) >= _DEPTH:
                run.trim()
            frames = run.steps[number] = {}
        if unit in frames:
            self.refused += frames[unit] != frame
            return
        frames[unit] = frame
        if run.newest is None and len(run.senders) == len(self.lengths):
            # A unit goes one step ahead of the conductor. The conductor may be waiting for the
            # follower, so the unit's last step need not become complete before this one begins.
            run.newest = max(number - (self._conductor not in of_step)
                             for number, of_step in run.steps.items())
        if len(frames) == len(self.lengths):
            run.complete.append(number)

    def steps(self) -> Iterator[Step]:
        """
        Yield the steps that are complete now, each once and in order.

        What is complete of one run comes before the first step of the next.
        """
        while True:
            following = self._runs.get(self._announced)
            stays = self._announced == self.run or following is None or not following.complete
            if self.run:
                yield from self._complete(self._runs[self.run], over=self._over or not stays)
            if stays or following is None:
                return
            self._turn(following)

    def _complete(self, run: _Run, over: bool) -> Iterator[Step]:
        while run.has_begun(over) and run.complete:
            number = run.complete.popleft()
            frames = run.steps.pop(number)
            if run.next is not None and number != run.next:
                if number < run.next:
                    continue
                # each unit sends in order: what is incomplete before a complete step stays so
                self.lost += number - run.next
                for older in [known for known in run.steps if known < number]:
                    del run.steps[older]
            run.next = number + 1
            numbers: list[float] = []
            for unit in self.lengths:
                numbers += frames[unit][len(HEADER):]
            yield Step(self.run, number, frames[self._conductor][2], numbers)

    def _turn(self, following: _Run) -> None:
        if self.run:
            over = self._runs.pop(self.run)
            self._past.append(self.run)
            # The conductor makes no step before all have made the last: that one we have missed.
            self.lost += sum(self._conductor in frames and number > (over.next or 0)
                             for number, frames in over.steps.items())
            following.next = 0
        self.run = int(self._announced)
