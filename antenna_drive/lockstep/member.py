# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The protocol of a unit that takes part in a run.

A member is a plain state machine, as is the `Conductor`, who owns the run: frames go in through
`receive`, outputs to be published come out of `go_on`. Others carry the frames.
"""

from collections.abc import Collection, Mapping, Sequence

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep.frame import (
    all_finite, FrameLayout, HEADER, new_sender, NO_RUN, SENDER,
)
from antenna_drive.lockstep.inbox import DEPTH, Frame, Inbox, Refusal
import numpy as np

# How many of its frames each node remembers.
MEMORY = 1000
# A wait for a single peer [s]; after it, whatever may come ends a wait.
BRIEF_WAIT_S = 0.02

# A run that goes on makes a step within this [s]; else another may take its place. The second
# holds where somebody has spoken falsely in a peer's name in the last MEMORY steps: a node that
# was stopped may go on, and what speaks against it may be false again. It holds, too, where the
# conductor waits for observers alone: a disk may take its time.
STANDSTILL_S = 0.2
DECEIVED_STANDSTILL_S = 5.0


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

    run, step, step_s : the run (0.0: none yet), the step last put out, its length [s]
    sender : the identity of this member in all of its frames
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

        unit : the unit to be stepped
        birth : when this node was started [us of wall time]; it joins younger runs only
        outputs : signals of each unit of the drive, by unit
        conductor : name of the unit that owns the run
        others : peers to wait for although the unit reads nothing from them
        in_bulk : those of them that do not make every step

        Raises ValueError: an input of the unit names no signal of the drive.
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
        self.sender = new_sender()
        self.fault = ''
        self._rests_at: tuple[float, int] | None = None
        self._announced: Frame | None = None
        self._announced_at = 0
        self._deceived_at: int | None = None  # the step at which a frame was last found false
        self._inputs = np.zeros((len(columns), 2))
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

    @property
    def resting(self) -> bool:
        """Return whether the conductor said after its last step that no run is in progress."""
        return self._rests_at == (self.run, self.inbox.reached(self.conductor))

    def receive(self, peer: str, frame: Frame) -> None:
        """Take in a frame or refuse it."""
        if not self._well_formed(peer, frame):
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
            # Others of its name, and what it said of earlier runs, tell nothing of this one.
            if self.run == NO_RUN or step_s == self.run and (
                    frame[SENDER] == self.inbox.senders.get(self.conductor)):
                self._rests_at = (self.run, self.inbox.reached(self.conductor))
        elif run == self.run:
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

        stands_still : whether the run in progress has made no step for a while: only then is it
            left for another

        Returns an array of shape (len(outputs), 2), to be published as step `step` of run `run`;
        None if something is missing.
        """
        if self._announced is not None:
            if self.inbox.reached(self.conductor) > self._announced_at:
                self._announced = None
                self._deceived_at = self.step
                self.inbox.refuse(self.conductor, Refusal.WRONG_RUN)
            elif stands_still or self.run == NO_RUN or self.fault:
                frame, self._announced = self._announced, None
                outputs = self._begin(frame[0], frame[2])
                self.inbox.offer(self.conductor, frame)
                return outputs
        if self.run == NO_RUN or self.fault:
            return None
        return None if self.inbox.missing() else self._advance()

    @property
    def patience_s(self) -> float:
        """Return how long the run must stand still before it is left for another [s]."""
        deceived = self._deceived_at is not None and self.step - self._deceived_at <= MEMORY
        return DECEIVED_STANDSTILL_S if deceived else STANDSTILL_S

    def steady(self) -> bool:
        """Return whether nothing is due but the next steps of the run in progress."""
        return (self.run != NO_RUN and not self.fault and self._announced is None
                and not self.inbox.holds_early)

    def follow(self, step: int, outputs: FloatArray) -> None:
        """Take over at `step` from whoever has made the steps up to it with this unit."""
        self.inbox.step = self.step = step
        self._checked(outputs)

    def message(self) -> bytes:
        """Return the serialised message of the step last put out."""
        return self.layout.encode(self.run, self.step, self.step_s, self.sender, self.packed)

    def hello(self) -> bytes:
        """Return the serialised message that this member is here and takes part in no run."""
        return self.layout.hello(self.birth, self.sender)

    def _begin(self, run: float, step_s: float) -> FloatArray | None:
        if self._deceived_at is not None:
            self._deceived_at -= self.step  # as many steps ago as before
        self.inbox.begin(run)
        self.step = 0
        self.step_s = step_s
        self.fault = ''
        return self._checked(self.unit.start(step_s))

    def _advance(self) -> FloatArray | None:
        for row, (slots, column) in zip(self._inputs, self._read):
            frame = slots[self.step % DEPTH]
            assert frame is not None
            row[:] = frame[column:column + 2]
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
            values = outputs.ravel().tolist()
            if all_finite(values):
                self.packed = outputs.tobytes()
                if self._reads_itself:
                    self._own_slots[self.step % DEPTH] = (
                        self.run, float(self.step), self.step_s, self.sender, *values)
                return outputs
            signal = self.unit.outputs[
                int(np.argmin(np.isfinite(outputs).all(axis=1)))].name
            self.fault = f'{signal} is NaN or infinite'
        self.fault = f'{self.unit.name}: {self.fault} at step {self.step}'
        return None


def _column(name: str, outputs: Mapping[str, Sequence[Signal]]) -> tuple[str, int]:
    unit, _, signal = name.partition('/')
    names = [known.name for known in outputs.get(unit, ())]
    if signal not in names:
        known_names = ', '.join(f'{key}/{item.name}' for key in outputs for item in outputs[key])
        raise ValueError(f'{name}: no such signal, known are {known_names}')
    return unit, len(HEADER) + 2 * names.index(signal)
