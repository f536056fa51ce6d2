# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The protocol of a reader that nobody waits for."""

from collections import Counter
from collections.abc import Mapping, Sequence

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep.frame import NO_RUN
from antenna_drive.lockstep.inbox import Frame
from antenna_drive.lockstep.member import Member, MEMORY


class Guest(Member):
    """
    A member that nobody waits for, and that may join a run in the middle.

    It begins at the earliest step that every peer still remembers; `Unit.start` is called all
    the same. From there on it follows as any member does. While it reads what was sent before
    it came, its peers go on and forget: where such a frame is lost it joins again behind it.

    joined : how many times it has joined a run
    """

    def __init__(self, unit: Unit, outputs: Mapping[str, Sequence[Signal]] = OUTPUTS,
                 conductor: str = TEST_SIGNAL) -> None:
        """Prepare to follow; see Member."""
        super().__init__(unit, 0.0, outputs, conductor)
        self.joined = 0
        self._first: dict[str, Frame] = {}

    def receive(self, peer: str, frame: Frame) -> None:
        """Take in a frame or refuse it."""
        if self.run != NO_RUN:
            super().receive(peer, frame)
            if (self.lost(peer) and self.run == self._joining()
                    and self.step < self._earliest() + MEMORY):
                self.inbox.refused.clear()
                self.inbox.begin(NO_RUN)
                self._first.clear()
        elif (self.inbox.well_formed(peer, frame) and frame[0] != NO_RUN
              and peer in self.missing()):
            self._first[peer] = frame

    def _joining(self) -> float:
        """Return the run that most peers speak of: one frame of one of them may be invented."""
        runs = Counter(frame[0] for frame in self._first.values())
        return max(runs, key=lambda run: (runs[run], run), default=NO_RUN)

    def _earliest(self) -> float:
        joining = self._joining()
        return max((frame[1] for frame in self._first.values() if frame[0] == joining),
                   default=0.0)

    def wanted(self) -> tuple[str, ...]:
        """Return the peers from whom a frame would be of use now."""
        return super().wanted() if self.run != NO_RUN else self.missing()

    def missing(self) -> tuple[str, ...]:
        """Return the peers without whom it cannot go on."""
        if self.run != NO_RUN:
            return super().missing()
        joining, earliest = self._joining(), self._earliest()
        return tuple(peer for peer in self.peers if peer not in self._first
                     or self._first[peer][0] != joining or self._first[peer][1] < earliest)

    def go_on(self, stands_still: bool = True) -> FloatArray | None:
        """Join the run in progress or make the next step; see Member."""
        if self.run != NO_RUN or self.missing():
            return super().go_on(stands_still)
        self.joined += 1
        outputs = self._begin(self._joining(), self._first[self.conductor][2],
                              int(self._earliest()))
        for peer, frame in self._first.items():
            self.inbox.offer(peer, frame)
        return outputs
