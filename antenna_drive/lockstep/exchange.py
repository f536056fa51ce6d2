# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The compiled exchange of one member: when it may run, and what it and the member tell each other.

The member stays the owner of the protocol. Before the loop runs, the member's frames and step
are copied into the loop's arrays; when the loop returns, they are copied back. In between nobody
but the loop touches them. Nothing here needs ROS.
"""

from collections.abc import Mapping, Sequence
import ctypes
from functools import cache
from pathlib import Path
import time
from typing import Any, Protocol

from antenna_drive.emulator.unit import FloatArray, Unit
from antenna_drive.lockstep import compiled_loop as loop
from antenna_drive.lockstep.compiled_loop import Call, Peer, Reading, Time, Word
from antenna_drive.lockstep.compiled_unit import CompiledForm, form_of
from antenna_drive.lockstep.conductor import Conductor, NEVER
from antenna_drive.lockstep.delays import empty_counts
from antenna_drive.lockstep.frame import CDR_LITTLE_ENDIAN, HEADER, SENDER
from antenna_drive.lockstep.inbox import DEPTH, Frame
from antenna_drive.lockstep.member import BRIEF_WAIT_S, Member
from antenna_drive.lockstep.pace import Pace
from antenna_drive.physics.arrays import IntArray
from antenna_drive.physics.compiling import generated
import numpy as np

# After this the loop returns, so that Python can answer signals [s].
LIMIT_S = 0.1

_LOOP = """
# {unit}
@compiled
def exchange(s, memory):
    while True:
        reason = gather(s)
        if reason == 0:
            reason = may_step(s)
        if reason != 0:
            return reason
        read_inputs(s)
        advance(s.words[{step}], s.times[{step_s}], s.u, s.y, memory)
        reason = put_out(s)
        if reason != 0:
            return reason
"""


class FrameChannel(Protocol):
    """
    What carries the frames: C functions and what they are called with, all as addresses.

    calls : a function for each name in `Call`
    publisher, guard, wait_set : of the node
    subscriptions : of each peer
    readings : row in the outputs, scale and publisher of each; row TIME is the simulated time
    incoming : a serialised message to take frames into, as words
    allocator : the five words that end a serialised message
    """

    calls: Mapping[str, int]
    publisher: int
    guard: int
    wait_set: int
    subscriptions: Mapping[str, int]
    readings: Sequence[tuple[int, float, int]]
    incoming: IntArray
    allocator: Sequence[int]

    def read(self, message: bytes) -> Frame:
        """Return the numbers of a message of another layout, none if it cannot be read."""

    def trim(self) -> None:
        """Give back the memory of a message larger than any of ours."""


@cache
def _compiled(name: str, advance: Any, folder: Path) -> Any:
    """Return the compiled loop for a `CompiledForm`: (state, memory) -> reason."""
    text = _LOOP.format(unit=name, step=Word.step, step_s=Time.step_s)
    names = {'advance': advance, 'gather': loop.gather, 'may_step': loop.may_step,
             'read_inputs': loop.read_inputs, 'put_out': loop.put_out}
    folders = frozenset({Path(__file__).resolve().parent, folder})
    return generated('exchange', text, names, folders).exchange.dispatcher


def _loop_of(form: CompiledForm) -> Any:
    return _compiled(form.name, form.advance, form.folder)


def compile_ahead(unit: Unit) -> None:
    """
    Compile a unit's loop and call it once, so that its first step takes no longer than others.

    The call makes no step. A unit without a compiled form has no loop.
    """
    form = form_of(unit)
    if form is not None:
        state = _state(0, 1, 1, 0, len(unit.inputs), form.outputs, 0)
        # it returns at once: step 0 is the last
        _loop_of(form)(state, form.memory(1e-3))


def _state(peers: int, longest: int, length: int, readings: int, inputs: int,
           outputs: FloatArray, stamps: int) -> Any:
    return loop.State(
        words=np.zeros(len(Word), np.int64), times=np.zeros(len(Time)),
        calls=np.zeros(len(Call), np.int64), peers=np.zeros((peers, len(Peer)), np.int64),
        order=np.arange(peers), frames=np.zeros((peers + 1, DEPTH, longest)),
        held=np.zeros((peers, DEPTH), np.int64), senders=np.zeros(peers),
        sources=np.zeros((inputs, 2), np.int64), numbers=np.zeros(longest),
        outgoing=np.zeros(length), clock=np.zeros(2, np.int64),
        incoming=np.zeros(loop.MESSAGE_WORDS, np.int64),
        readings=np.zeros((readings, len(Reading)), np.int64), scales=np.zeros(readings),
        value=np.zeros(1), stamp=np.zeros(1, np.int64), delays=empty_counts(),
        stamps=np.zeros(stamps), u=np.zeros((inputs, 2)), y=outputs)


class Exchange:
    """
    The compiled exchange of one member.

    steps : how many steps it has made
    running : whether the loop runs just now
    pauses : steps after which it returns whatever else is due, in order
    """

    def __init__(self, member: Member, form: CompiledForm, channel: FrameChannel,
                 stamps: int = 0) -> None:
        """
        Prepare the loop.

        member, form : whose steps are to be made, and the compiled form of its unit
        channel : what carries the frames; it must outlive every call of `run`
        stamps : how many steps to note the time of, in `stamps`
        """
        self._member = member
        self._form = form
        self._channel = channel
        self._loop = _loop_of(form)
        # the slowest first
        self._peers = member.inbox.stepping
        self.steps = 0
        self.running = False
        self.pauses: list[int] = []
        lengths = [member.layouts[peer].length for peer in self._peers]
        own = member.layout
        self._s = s = _state(len(self._peers), max([own.length, *lengths]),
                             own.length, len(channel.readings), len(member.sources),
                             form.outputs, stamps)._replace(
                                 incoming=channel.incoming)
        s.outgoing[SENDER] = member.sender
        rows = {peer: row for row, peer in enumerate((*self._peers, member.unit.name))}
        s.sources[:] = np.array([(rows[peer], column) for peer, column in member.sources],
                                np.int64).reshape(-1, 2)
        s.calls[:] = [channel.calls[name] for name in Call._fields]
        self._lengths = lengths
        # what the addresses in `peers` and in the outgoing message point to
        self._prefixes = [np.frombuffer(member.layouts[peer].prefix, np.uint8)
                          for peer in self._peers]
        self._out = np.frombuffer(bytearray(own.encode(0.0, 0, 0.0, 0.0, bytes(own.packed_size))),
                                  np.uint8)
        for row, (peer, prefix) in enumerate(zip(self._peers, self._prefixes)):
            s.peers[row] = (channel.subscriptions[peer], prefix.ctypes.data, prefix.size,
                            lengths[row])
        self._message = np.array(
            [self._out.ctypes.data, self._out.size, self._out.size, *channel.allocator], np.int64)
        self._prepare_readings()
        for name, value in {
                'publisher': channel.publisher, 'guard': channel.guard,
                'wait_set': channel.wait_set, 'incoming': channel.incoming.ctypes.data,
                'outgoing': self._message.ctypes.data, 'frame_in': s.numbers.ctypes.data,
                'frame_out': s.outgoing.ctypes.data,
                'frame_to': self._out.ctypes.data + len(own.prefix),
                'size_out': s.outgoing.nbytes, 'clock': s.clock.ctypes.data,
                'value': s.value.ctypes.data, 'stamp': s.stamp.ctypes.data,
                'brief_ns': int(1e9 * BRIEF_WAIT_S)}.items():
            s.words[getattr(Word, name)] = value

    def _prepare_readings(self) -> None:
        readings, prefix = self._channel.readings, CDR_LITTLE_ENDIAN
        size = len(prefix) + 8
        self._reading_bytes = np.zeros((len(readings), size), np.uint8)
        self._reading_bytes[:, :len(prefix)] = np.frombuffer(prefix, np.uint8)
        self._reading_messages = np.zeros((len(readings), loop.MESSAGE_WORDS), np.int64)
        for n, (row, scale, publisher) in enumerate(readings):
            start = self._reading_bytes[n].ctypes.data
            message = self._reading_messages[n]
            message[:] = start, size, size, *self._channel.allocator
            self._s.readings[n] = row, publisher, message.ctypes.data, start + len(prefix)
            self._s.scales[n] = scale

    @property
    def stamps(self) -> FloatArray:
        """Return when each of the first steps was made, on the clock of time.monotonic() [s]."""
        return self._s.stamps

    @property
    def step(self) -> int:
        """Return the step that the loop has come to, from any thread."""
        return int(self._s.words[Word.step]) if self.running else self._member.step

    @property
    def status(self) -> int:
        """Return what the C function returned that failed."""
        return int(self._s.words[Word.status])

    def ask(self) -> None:
        """Let the loop return soon, from any thread."""
        self._s.words[Word.asked] = 1

    def listen(self) -> None:
        """Forget the request; the caller then looks for what is due."""
        self._s.words[Word.asked] = 0

    def run(self, every: int = 0, pace: Pace | None = None, limit_s: float = LIMIT_S) -> int:
        """
        Make steps until something else is due; the member must be `steady`.

        every : publish readings after each step that this divides; 0 for none
        pace : when steps are due; it must have begun unless it is as fast as possible
        limit_s : return after this time [s]

        Returns why, one of the reasons of `compiled_loop`.
        """
        member, w = self._member, self._s.words
        self._load(every, pace, limit_s)
        self.running = True
        try:
            reason: int = self._loop(self._s, self._form.memory(member.step_s))
        finally:
            self.running = False
        self.steps += int(w[Word.step]) - member.step
        self._store(pace)
        if reason == loop.FOREIGN:
            self._receive_foreign()
        return reason

    def _load(self, every: int, pace: Pace | None, limit_s: float) -> None:
        member, s = self._member, self._s
        w, t, inbox = s.words, s.times, member.inbox
        w[Word.step] = member.step
        w[Word.every] = every
        w[Word.pause] = next((step for step in self.pauses if step > member.step), 0)
        w[Word.late] = 0
        w[Word.last_step] = member.farthest() if isinstance(member, Conductor) else NEVER
        t[Time.run] = member.run
        t[Time.step_s] = member.step_s
        t[Time.until] = time.monotonic() + limit_s
        t[Time.worst] = 0.0
        t[Time.factor] = 0.0
        if pace is not None:
            t[Time.factor] = pace.factor
            t[Time.start], t[Time.first_step] = pace.timetable
            t[Time.lead] = pace.lead_s
        for row, (peer, length) in enumerate(zip(self._peers, self._lengths)):
            s.senders[row] = inbox.senders.get(peer, np.nan)
            for slot, frame in enumerate(inbox.slots[peer]):
                s.held[row, slot] = frame is not None
                if frame is not None:
                    s.frames[row, slot, :length] = frame
        own = np.frombuffer(member.packed)
        s.frames[-1, member.step % DEPTH, len(HEADER):len(HEADER) + own.size] = own

    def _store(self, pace: Pace | None) -> None:
        member, s = self._member, self._s
        inbox, step = member.inbox, int(s.words[Word.step])
        if pace is not None:
            pace.add_late(int(s.words[Word.late]), float(s.times[Time.worst]))
            pace.delays.counts += s.delays
            s.delays[:] = 0
        for peer, held, frames, length in zip(
                self._peers, s.held.tolist(), s.frames, self._lengths):
            inbox.slots[peer][:] = [
                tuple(frames[slot, :length].tolist()) if held[slot] else None
                for slot in range(DEPTH)]
        if step != member.step:
            self._form.reached(step)
            member.follow(step, self._form.outputs)

    def _receive_foreign(self) -> None:
        peer = self._peers[self._s.words[Word.peer]]
        address, size = self._channel.incoming[:2].tolist()
        message = ctypes.string_at(address, size)
        frame = self._member.layouts[peer].decode(message)
        self._member.receive(peer, self._channel.read(message) if frame is None else frame)
        self._channel.trim()
