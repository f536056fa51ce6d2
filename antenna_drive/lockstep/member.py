# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The protocol of a unit that takes part in a run, and of the one that owns it: the conductor.

Both are plain state machines: frames go in through `receive`, outputs to be published come
out of `go_on`. Who carries the frames, and how fast, is somebody else's affair.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Collection, Mapping, Sequence

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep.frame import all_finite, FrameLayout, HEADER, LATEST_BIRTH, NO_RUN
from antenna_drive.lockstep.inbox import DEPTH, Frame, Inbox, Refusal
import numpy as np


# How many of its frames each node remembers.
MEMORY = 1000

# How far an observer may fall behind: half of that.
SLACK = MEMORY // 2

# A run that goes on makes a step within this [s]; else another may take its place. The second
# holds where somebody has spoken falsely in a peer's name in the last MEMORY steps: a node that
# was stopped may go on, and what speaks against it may be false again. It holds, too, where the
# conductor waits for observers alone: a disk may take its time.
STANDSTILL_S = 0.2
DECEIVED_STANDSTILL_S = 5.0

# Progress of an observer that has not begun the run: it is waited for before the first step, as
# it could not keep what it gets of a run that it has yet to begin.
_NOT_BEGUN = -1.0


class Member:
    """
    A unit's part in the lock-step.

    It starts afresh when the conductor announces a new run, puts out its frame 0, and goes from
    step k to k + 1 when it holds step k of the conductor and of each of its inputs.

    Anybody can publish an announcement. The conductor makes no step of a run once it has
    announced the next; so whoever announces a run while this one goes on is not the conductor.
    An announcement waits until the run stands still, for longer after a false one, and is refused
    if the run goes on. Should it have been an invention all the same, the conductor's next
    announcement is followed from there, whichever of the two runs has the greater id.

    Attributes
    ----------
    run, step, step_s : the run (0.0: none yet), the step last put out, its length [s]
    resting : True when the conductor has said that no run is in progress
    fault : why the unit cannot go on in this run, '' if it can
    sources : of each input of the unit, the peer and the column of its value in a frame
    packed : the bytes of the outputs last put out

    """

    def __init__(self, unit: Unit, birth: float,
                 outputs: Mapping[str, Sequence[Signal]] = OUTPUTS,
                 conductor: str = TEST_SIGNAL, others: Collection[str] = (),
                 in_bulk: Collection[str] = ()) -> None:
        """
        Prepare a unit for its first run.

        Parameters
        ----------
        unit
            the unit to be stepped
        birth
            when this node was started [us of wall time]; it joins younger runs only
        outputs
            signals of each unit of the drive, by unit
        conductor
            name of the unit that owns the run
        others
            peers to wait for although the unit reads nothing from them
        in_bulk
            those of them that do not make every step

        Raises
        ------
        ValueError : an input of the unit names no signal of the drive

        """
        self.unit = unit
        self.birth = birth
        self.conductor = conductor
        self.layout = FrameLayout(unit.outputs)
        columns = self.sources = [_column(name, outputs) for name in unit.inputs]
        peers = {peer: None for peer, _ in columns}
        if unit.name != conductor:
            peers[conductor] = None
        peers.update(dict.fromkeys(others))
        peers.pop(unit.name, None)
        self.peers = tuple(peers)
        self.layouts = {peer: FrameLayout(outputs.get(peer, ())) for peer in peers}
        self.inbox = Inbox({peer: layout.length for peer, layout in self.layouts.items()},
                           in_bulk)
        self.step = 0
        self.step_s = 0.0
        self.resting = False
        self.fault = ''
        self._announced: Frame | None = None
        self._announced_at = 0
        self._deceived_at: int | None = None  # the step at which a frame was last found false
        # one memory: a numpy array is slow to write single numbers to
        self._numbers = array('d', bytes(2 * 8 * len(columns)))
        self._inputs = np.asarray(self._numbers).reshape(-1, 2)
        self.packed = bytes(self.layout.packed_size)
        self._shape = (len(unit.outputs), 2)
        self._reads_itself = any(peer == unit.name for peer, _ in columns)
        self._own_slots: list[Frame | None] = [None] * DEPTH
        self._read = [(self._own_slots if peer == unit.name else self.inbox.slots[peer], column)
                      for peer, column in columns]

    @property
    def run(self) -> float:
        """Return the id of the run in progress, 0.0 for none."""
        return self.inbox.run

    def receive(self, peer: str, frame: Frame) -> None:
        """Take in a frame or refuse it."""
        if self.inbox.accept(peer, frame) or not self._well_formed(peer, frame):
            return
        if peer == self.conductor:
            self._receive_from_conductor(frame)
        elif self.run == NO_RUN and frame[0] <= self.birth:
            # what a peer's history holds of runs before our time
            self.inbox.forget(frame[0])
        else:
            self.inbox.offer(peer, frame)
            self.inbox.hellos.clear()

    def _well_formed(self, peer: str, frame: Frame) -> bool:
        if self.inbox.well_formed(peer, frame):
            return True
        # No node makes such a frame: somebody else speaks in its name.
        self._deceived_at = self.step
        return False

    def _receive_from_conductor(self, frame: Frame) -> None:
        run, step, step_s = frame[:3]
        if run == NO_RUN:
            self.resting = True
        elif run == self.run:
            self.resting = False
            self.inbox.offer(self.conductor, frame)
        elif run <= self.birth:
            self.inbox.forget(run)
        elif step == 0.0 and step_s > 0.0 and not self.inbox.is_over(run):
            self._announced = frame
            self._announced_at = self.inbox.reached(self.conductor)
        else:
            self.inbox.refuse(self.conductor, Refusal.WRONG_RUN)

    def wanted(self) -> tuple[str, ...]:
        """Return the peers from whom a frame would be of use now."""
        if self.run == NO_RUN or self.fault:
            return (self.conductor,)
        holds = self.inbox.holds
        return tuple(peer for peer in self.peers if not holds(peer) or (
            # a new run may be announced while somebody else is waited for
            peer == self.conductor and self.inbox.has_room(peer)))

    def missing(self) -> tuple[str, ...]:
        """Return the peers without whom the next step cannot be made."""
        if self.run == NO_RUN or self.fault:
            return (self.conductor,)
        return self.inbox.missing()

    def go_on(self, stands_still: bool = True) -> FloatArray | None:
        """
        Start the run that was announced or make the next step, if everything for it is there.

        Parameters
        ----------
        stands_still
            whether the run in progress has made no step for a while: only then is it left for
            another

        Returns
        -------
        array of shape (len(outputs), 2), to be published as step `step` of run `run`; None if
        something is missing

        """
        if self._announced is not None:
            if self.inbox.reached(self.conductor) > self._announced_at:
                self._announced = None
                self._deceived_at = self.step
                self.inbox.refuse(self.conductor, Refusal.WRONG_RUN)
            elif stands_still or self.run == NO_RUN or self.fault:
                return self._begin_announced(self._announced)
        if self.run == NO_RUN or self.fault:
            return None
        return None if self.inbox.missing() else self._advance()

    @property
    def patience_s(self) -> float:
        """Return how long the run must stand still before it is left for another [s]."""
        deceived = self._deceived_at is not None and self.step - self._deceived_at <= MEMORY
        return DECEIVED_STANDSTILL_S if deceived else STANDSTILL_S

    def lost(self, peer: str) -> int:
        """Return how many frames came too far ahead of one of the peer's that is missing."""
        count = self.inbox.refused.get((peer, Refusal.TOO_FAR_AHEAD), 0)
        return count if count and peer in self.missing() else 0

    def steady(self) -> bool:
        """Return whether nothing is due but the next steps of the run in progress."""
        return (self.run != NO_RUN and not self.fault and self._announced is None
                and not self.inbox.holds_early)

    def follow(self, step: int, outputs: FloatArray) -> None:
        """Take over at `step` from whoever has made the steps up to it with this unit."""
        self.inbox.resume(step)
        self.step = step
        self._checked(outputs)

    def _begin_announced(self, frame: Frame) -> FloatArray | None:
        self._announced = None
        outputs = self._begin(frame[0], frame[2])
        self.inbox.offer(self.conductor, frame)
        return outputs

    def message(self) -> bytes:
        """Return the serialised message of the step last put out."""
        return self.layout.encode(self.run, self.step, self.step_s, self.packed)

    def _begin(self, run: float, step_s: float, step: int = 0) -> FloatArray | None:
        if self._deceived_at is not None:
            self._deceived_at -= self.step - step  # as many steps ago as before
        self.inbox.begin(run, step)
        self.step = step
        self.step_s = step_s
        self.resting = False
        self.fault = ''
        return self._checked(self.unit.start(step_s))

    def _advance(self) -> FloatArray | None:
        slot = self.step % DEPTH
        numbers = self._numbers
        place = 0
        for slots, column in self._read:
            frame = slots[slot]
            assert frame is not None
            numbers[place] = frame[column]
            numbers[place + 1] = frame[column + 1]
            place += 2
        outputs = self.unit.step(self.step, self._inputs)
        self.inbox.advance()
        self.step += 1
        return self._checked(outputs)

    def _checked(self, outputs: FloatArray) -> FloatArray | None:
        # A unit's own bad output is refused where it arises: nobody else ever sees it.
        outputs = np.asarray(outputs, dtype=np.float64)
        if outputs.shape != self._shape:
            self.fault = f'outputs of shape {outputs.shape}, wanted {self._shape}'
        else:
            packed = outputs.tobytes()
            values = self.layout.unpack(packed)
            if all_finite(values):
                self.packed = packed
                if self._reads_itself:
                    self._own_slots[self.step % DEPTH] = (
                        self.run, float(self.step), self.step_s, *values)
                return outputs
            signal = self.unit.outputs[
                int(np.argmin(np.isfinite(outputs).all(axis=1)))].name
            self.fault = f'{signal} is NaN or infinite'
        self.fault = f'{self.unit.name}: {self.fault} at step {self.step}'
        return None


class Guest(Member):
    """
    A member that nobody waits for, and that may join a run in the middle.

    It begins at the earliest step that every peer still remembers; `Unit.start` is called all
    the same. From there on it follows as any member does. While it reads what was sent before
    it came, its peers go on and forget: where such a frame is lost it joins again behind it.

    Attributes
    ----------
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


class Conductor(Member):
    """
    The member that owns the run: its id, its macro-step, its beginning and its end.

    It begins a run when it has heard from every other member, publishes step k + 1 only when
    it holds step k of every one, and begins afresh when one of them says hello and makes no more
    steps: that is a node that was started again. So it does when a member, or an observer that
    it waits for, has left for another run, which somebody invented. Observers are waited for
    too, at step 0 but not at every step: they may read in bulk, as long as they stay within what
    the others remember.
    """

    def __init__(self, unit: Unit, birth: float, step_s: float, last_step: int | None = None,
                 outputs: Mapping[str, Sequence[Signal]] = OUTPUTS,
                 observers: Collection[str] = ()) -> None:
        """
        Prepare to conduct every unit in `outputs` and the observers named.

        Parameters
        ----------
        unit, birth, outputs
            see Member
        step_s
            length of the macro-step [s]
        last_step
            the step at which a run ends; None for a run without end
        observers
            further members, which read the drive and say now and then how far they are

        """
        members = [name for name in outputs if name != unit.name]
        super().__init__(unit, birth, outputs, unit.name, (*members, *observers), observers)
        self.wanted_step_s = step_s
        self.last_step = last_step
        self.ended = False
        self.used = dict.fromkeys(observers, _NOT_BEGUN)
        self._heard: dict[str, float] = {}
        self._begin_again = True
        # Our step when a member said hello, or last spoke of another run.
        self._hello_at: dict[str, int] = {}
        self._elsewhere_at: dict[str, int] = {}
        # How far an observer was that then spoke of another run.
        self._strayed_at: dict[str, float] = {}

    def receive(self, peer: str, frame: Frame) -> None:
        """Take in a frame or refuse it; note who is there."""
        if self.inbox.accept(peer, frame) or not self._well_formed(peer, frame):
            return
        if self.run == NO_RUN:
            self._heard.setdefault(peer, 0.0)
            self._hear(peer, frame)
            self.inbox.forget(frame[0])
        elif frame[0] not in (NO_RUN, self.run) and not self.inbox.is_over(frame[0]):
            # nobody but the conductor makes runs
            self.inbox.refuse(peer, Refusal.WRONG_RUN)
            self._hear(peer, frame)
            if peer in self.used:
                self._strayed_at[peer] = self.used[peer]
            else:
                self._elsewhere_at[peer] = self.step
        elif peer in self.used and frame[0] == self.run:
            self.used[peer] = max(self.used[peer], frame[1])
        else:
            self.inbox.offer(peer, frame)
            for name, birth in self.inbox.hellos:
                self._heard[name] = max(self._heard[name], birth)
                if name in self.used or self.ended or self.fault:
                    self._begin_again = True
                if self._went_on_after_hello(name):
                    self._deceived_at = self.step
                self._hello_at[name] = self.step
            self.inbox.hellos.clear()

    def _hear(self, peer: str, frame: Frame) -> None:
        # A run beyond every birth is an invention, and no measure for runs to come.
        known = frame[1] if frame[0] == NO_RUN else frame[0]
        if known < LATEST_BIRTH:
            self._heard[peer] = max(self._heard[peer], known)

    def _went_on_after_hello(self, name: str) -> bool:
        """Tell whether a hello in a member's name was false, in the last MEMORY steps."""
        return DEPTH < self.step - self._hello_at.get(name, self.step) <= MEMORY

    @property
    def patience_s(self) -> float:
        """Return how long the run must stand still before somebody is believed to be gone [s]."""
        false = any(map(self._went_on_after_hello, self._hello_at))
        observers_alone = bool(self.used) and not self.inbox.missing()
        return DECEIVED_STANDSTILL_S if false or observers_alone else super().patience_s

    def _left(self, at: Mapping[str, int], peers: Collection[str]) -> bool:
        """Tell whether one of the peers has gone since: whoever goes on was spoken for."""
        return any(peer in at and self.step - at[peer] <= DEPTH for peer in peers)

    def unheard(self) -> tuple[str, ...]:
        """Return the members that have not been heard of yet."""
        return tuple(peer for peer in self.peers if peer not in self._heard)

    def wanted(self) -> tuple[str, ...]:
        """Return the members from whom a frame would be of use now."""
        if self.run == NO_RUN or self.ended:
            return self.peers
        missing = self.missing()
        # one whose frame of this step is here may say hello: it was killed after it
        return *missing, *(peer for peer in self.peers
                           if peer not in missing and self.inbox.has_room(peer))

    def missing(self) -> tuple[str, ...]:
        """Return the members without whom the next step cannot be made."""
        if self.run == NO_RUN:
            return self.unheard()
        missing = self.inbox.missing()
        if self.used:
            missing += self._behind()
        return missing

    def _behind(self) -> tuple[str, ...]:
        """Return the observers that have to catch up before the next step."""
        least = max(0, self.step - SLACK)
        if self.last_step is not None and self.step > self.last_step:
            least = self.step
        return tuple(name for name, used in self.used.items() if used < least)

    def steady(self) -> bool:
        """Return whether nothing is due but the next steps of the run in progress."""
        return (super().steady() and not self.ended and not self._begin_again
                and (self.last_step is None or self.step < self.last_step))

    def new_run(self, now: float, stands_still: bool = False) -> FloatArray | None:
        """
        Begin a run if one is due and everybody is there.

        Parameters
        ----------
        now
            wall time [us]; the run's id, unless somebody was born later by his own clock
        stands_still
            whether the run in progress has made no step for `patience_s`: only then is a member
            that said hello, or speaks of another run, believed to be gone

        Returns
        -------
        array of shape (len(outputs), 2), to be published as frame 0; None if no run is due

        """
        if stands_still and self._somebody_left():
            self._begin_again = True
        if not self._begin_again or self.unheard():
            return None
        self._begin_again = False
        self._hello_at.clear()
        self._elsewhere_at.clear()
        self._strayed_at.clear()
        self.ended = False
        self.used = dict.fromkeys(self.used, _NOT_BEGUN)
        run = max(float(int(now)), self.birth + 1.0, self.run + 1.0,
                  *(heard + 1.0 for heard in self._heard.values()))
        return self._begin(run, self.wanted_step_s)

    def _somebody_left(self) -> bool:
        missing = () if self.run == NO_RUN or self.ended else self.inbox.missing()
        behind = self._behind()
        # The last frames of a killed member may have reached us and not those who now wait for
        # them, members or observers: then they are missing, and it is not.
        return (bool(missing or behind) and self._left(self._hello_at, self.peers)
                or self._left(self._elsewhere_at, missing)
                or any(self._strayed_at.get(name) == self.used[name] for name in behind))

    def begin_again(self) -> None:
        """Leave the run in progress, if any, for a new one."""
        self._begin_again = True

    def go_on(self, stands_still: bool = True) -> FloatArray | None:
        """Make the next step if every member has made the last, and the run has not ended."""
        if self.run == NO_RUN or self.fault or self.ended or self._begin_again:
            return None
        if self.missing():
            return None
        if self.last_step is not None and self.step >= self.last_step:
            self._wait_for_the_last()
            return None
        return self._advance()

    def _wait_for_the_last(self) -> None:
        # Whoever holds the last step makes one more: by this we know that all have used it.
        if self.step == self.last_step:
            self.inbox.advance()
            self.step += 1
        else:
            self.ended = True


def _column(name: str, outputs: Mapping[str, Sequence[Signal]]) -> tuple[str, int]:
    unit, _, signal = name.partition('/')
    names = [known.name for known in outputs.get(unit, ())]
    if signal not in names:
        known_names = ', '.join(f'{key}/{item.name}' for key in outputs for item in outputs[key])
        raise ValueError(f'{name}: no such signal, known are {known_names}')
    return unit, len(HEADER) + 2 * names.index(signal)
