# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Where a node keeps its peers' frames until it needs them, and refuses what it must not use.

Frames may come in any order, twice, late or from somebody who should not send them: only
run and step decide. Nothing here needs ROS, and nothing here reads a clock.
"""

from collections import Counter, deque
from collections.abc import Collection, Mapping
from enum import Enum
import math

from antenna_drive.lockstep.frame import all_finite, LARGEST_RUN, LATEST_BIRTH, NO_RUN, SENDER

# A neighbour may be one step ahead and its neighbour two; four is the next power of two.
DEPTH = 4

# A peer that has heard of a new run sends its frame 0 before the conductor's may have come.
EARLY_FRAMES = 16

Frame = tuple[float, ...]


class Refusal(str, Enum):
    """Why a frame was not used."""

    WRONG_LENGTH = 'wrong length'
    NAN = 'NaN'
    INFINITE = 'infinite'
    NOT_A_STEP = 'step not a whole number'
    WRONG_RUN = 'wrong run'
    TOO_OLD = 'too old'
    TOO_FAR_AHEAD = 'too far ahead'
    DUPLICATE = 'duplicate'
    CONTRADICTION = 'contradicts an earlier frame'
    SECOND_SENDER = 'second sender'


def fault_of(frame: Frame, length: int) -> Refusal | None:
    """Return what is wrong with a frame in any run, if it should have so many numbers."""
    if len(frame) != length:
        return Refusal.WRONG_LENGTH
    if not all_finite(frame):
        return Refusal.NAN if any(map(math.isnan, frame)) else Refusal.INFINITE
    if not 0.0 <= frame[1] < LATEST_BIRTH or frame[1] % 1.0 != 0.0:
        return Refusal.NOT_A_STEP
    if not 0.0 <= frame[0] < LARGEST_RUN or frame[0] % 1.0 != 0.0:
        return Refusal.WRONG_RUN
    return None


class Inbox:
    """
    The frames of the run in progress, by peer and step.

    run, step : the run in progress (0.0: none) and the step whose frames are wanted next
    senders : who speaks for each peer in this run: whose frame of it was taken in first
    doubled : of each peer in whose name another has sent frames of this run, those two
    refused : how many frames were refused, by (peer, reason)
    hellos : births [us] of peers that said hello, in order of arrival; the owner empties it
    """

    def __init__(self, lengths: Mapping[str, int], in_bulk: Collection[str] = ()) -> None:
        """
        Take frames from the peers named in `lengths`, each with its number of doubles.

        Those `in_bulk` are not waited for at every step, and have no frame of one.
        """
        self.run = NO_RUN
        self.step = 0
        self.refused: Counter[tuple[str, Refusal]] = Counter()
        self.hellos: list[tuple[str, float]] = []
        self.senders: dict[str, float] = {}
        self.doubled: dict[str, tuple[float, float]] = {}
        self.slots: dict[str, list[Frame | None]] = {peer: [None] * DEPTH for peer in lengths}
        self._lengths = dict(lengths)
        self._stepping = {peer: slots for peer, slots in self.slots.items()
                          if peer not in in_bulk}
        self._early: deque[tuple[str, Frame, int]] = deque()
        self._past_runs: deque[float] = deque(maxlen=8)

    def begin(self, run: float) -> None:
        """Turn to a new run: forget the old one's frames and take in those that came early."""
        self.forget(self.run)
        self.run = run
        self.step = 0
        self.senders.clear()
        self.doubled.clear()
        for slots in self.slots.values():
            slots[:] = [None] * DEPTH
        early, self._early = self._early, deque()
        for peer, frame, _ in early:
            # Frames of other runs stay early: the next announcement may be on its way already.
            self.offer(peer, frame)

    def forget(self, run: float) -> None:
        """Let leftovers of a past run pass without counting them as refused."""
        if run != NO_RUN and run not in self._past_runs:
            self._past_runs.append(run)

    def is_over(self, run: float) -> bool:
        """Return whether this is a past run that is remembered."""
        return run in self._past_runs

    def refuse(self, peer: str, reason: Refusal) -> None:
        """Count a frame as refused."""
        self.refused[peer, reason] += 1

    def well_formed(self, peer: str, frame: Frame) -> bool:
        """Check everything about a frame that needs no knowledge of the run; count a refusal."""
        fault = fault_of(frame, self._lengths[peer])
        if fault is not None:
            self.refuse(peer, fault)
        return fault is None

    def offer(self, peer: str, frame: Frame) -> None:
        """Take in a well-formed frame, or refuse it and count why."""
        run = frame[0]
        if run == self.run and run != NO_RUN:
            self._file(peer, frame)
        elif run == NO_RUN:
            self.hellos.append((peer, frame[1]))
        elif run not in self._past_runs:
            # A peer may hear of the next run before we do. Its id may be smaller than ours: the
            # run in progress may be an invention.
            self._early.append((peer, frame, self.step))
            if len(self._early) > EARLY_FRAMES:
                self.refuse(self._early.popleft()[0], Refusal.WRONG_RUN)

    def advance(self) -> None:
        """Drop the frames of the current step and want the next."""
        slot = self.step % DEPTH
        for slots in self._stepping.values():
            slots[slot] = None
        self.step += 1
        # Nobody can announce a run and let this one go on: what came early and is still
        # waiting this many steps later belongs to no run.
        while self._early and self.step - self._early[0][2] > DEPTH:
            self.refuse(self._early.popleft()[0], Refusal.WRONG_RUN)

    @property
    def stepping(self) -> tuple[str, ...]:
        """Return the peers that are waited for at every step, the slowest first."""
        return tuple(self._stepping)

    @property
    def holds_early(self) -> bool:
        """Return whether frames of another run wait for their fate."""
        return bool(self._early)

    def holds(self, peer: str) -> bool:
        """Return whether the peer's frame of the current step is there."""
        return self.slots[peer][self.step % DEPTH] is not None

    def reached(self, peer: str) -> int:
        """Return the last step of this run of which the peer has sent its frame."""
        slots = self.slots[peer]
        return max((step for step in range(self.step, self.step + DEPTH)
                    if slots[step % DEPTH] is not None), default=self.step - 1)

    def missing(self) -> tuple[str, ...]:
        """Return the peers whose frame of the current step is not there."""
        slot = self.step % DEPTH
        return tuple([peer for peer, slots in self._stepping.items() if slots[slot] is None])

    def put_first(self, peer: str) -> None:
        """Name a peer first among the missing from now on, if it is waited for at every step."""
        if peer in self._stepping:
            self._stepping = {peer: self._stepping[peer], **self._stepping}

    def has_room(self, peer: str) -> bool:
        """Return whether the next frame of a peer in good order would find a place."""
        return self.slots[peer][(self.step + DEPTH - 1) % DEPTH] is None

    def speaks_for(self, peer: str, frame: Frame) -> bool:
        """
        Return whether a frame of this run is of the sender that speaks for the peer; else refuse.

        A node that is started again joins no run that began before it. So two senders of one run
        are two nodes of one name.
        """
        known = self.senders.get(peer, frame[SENDER])
        if frame[SENDER] == known:
            return True
        self.doubled[peer] = known, frame[SENDER]
        self.refuse(peer, Refusal.SECOND_SENDER)
        return False

    def _file(self, peer: str, frame: Frame) -> None:
        step = int(frame[1])
        ahead = step - self.step
        if not self.speaks_for(peer, frame):
            return
        if ahead < 0:
            self.refuse(peer, Refusal.TOO_OLD)
        elif ahead >= DEPTH:
            self.refuse(peer, Refusal.TOO_FAR_AHEAD)
        else:
            slots = self.slots[peer]
            held = slots[step % DEPTH]
            self.senders[peer] = frame[SENDER]
            if held is None:
                slots[step % DEPTH] = frame
            else:
                same = held == frame
                self.refuse(peer, Refusal.DUPLICATE if same else Refusal.CONTRADICTION)
