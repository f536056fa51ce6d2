# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
The steps of a running drive, put together from the frames of its units by somebody who listens.

Unlike a member of the lock-step, who is there from step 0 on, a follower may come at any time: it
begins with the first step of which it gets every unit's frame. Nothing here needs ROS.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from antenna_drive.lockstep.frame import all_finite, HEADER, NO_RUN

Frame = tuple[float, ...]

# Units are a few steps apart at most; one that is so far ahead waits for somebody we lost.
_DEPTH = 4096


class Step(NamedTuple):
    """One complete step: its run and number, the macro-step [s], the value of every signal."""

    run: int
    number: int
    step_s: float
    values: list[float]


class Follower:
    """
    Puts frames together to steps.

    Attributes
    ----------
    run : the run in progress, 0 for none
    lost : steps of this run that were missed after the first that was seen
    refused : frames that are none: wrong length, NaN or infinite

    """

    def __init__(self, lengths: Mapping[str, int], conductor: str) -> None:
        """
        Prepare to follow.

        Parameters
        ----------
        lengths
            how many numbers a frame of each unit has, in the order of the signals
        conductor
            the unit that owns the run: nobody else begins one

        """
        self._lengths = dict(lengths)
        self._conductor = conductor
        self._frames: dict[str, deque[Frame]] = {
            unit: deque(maxlen=_DEPTH) for unit in self._lengths}
        self._next: int | None = None
        self.run = 0
        self.lost = 0
        self.refused = 0

    def receive(self, unit: str, frame: Sequence[float]) -> None:
        """Take in a frame of a unit."""
        if len(frame) != self._lengths[unit] or not all_finite(frame):
            self.refused += 1
            return
        run = int(frame[0])
        if frame[0] == NO_RUN or run < self.run:
            return
        if unit == self._conductor and run > self.run:
            self.run, self._next, self.lost = run, None, 0
        self._frames[unit].append(tuple(frame))

    def steps(self) -> Iterator[Step]:
        """Yield the steps that are complete now, each once and in order."""
        while True:
            heads = []
            for frames in self._frames.values():
                while frames and (frames[0][0] < self.run or (
                        self._next is not None and frames[0][0] == self.run
                        and frames[0][1] < self._next)):
                    frames.popleft()
                if not frames or frames[0][0] != self.run or not self.run:
                    return
                heads.append(frames[0])
            number = int(max(head[1] for head in heads))
            if self._next is None:
                self._next = number
            if number > self._next:
                self.lost += number - self._next
                self._next = number
            if any(head[1] != number for head in heads):
                continue  # somebody is behind: his frames up to here go unused
            values: list[float] = []
            for frames in self._frames.values():
                values += frames.popleft()[len(HEADER)::2]
            self._next = number + 1
            yield Step(self.run, number, heads[0][2], values)
