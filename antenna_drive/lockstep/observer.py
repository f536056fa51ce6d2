# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Somebody who reads every signal of a running drive at every step, and loses none.

An observer that test_signal was told of (run.observers) is a member of the lock-step: the drive
never gets further ahead of it than the nodes remember, however fast it runs. Any other is a
guest: it joins a run where it is, at the earliest step that the nodes remember, and follows as
long as it keeps within what they remember, the last thousand steps.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
import time
from typing import Any

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep.changes import read_record
from antenna_drive.lockstep.entry import own_node
from antenna_drive.lockstep.frame import NO_RUN, two_of_one_name
from antenna_drive.lockstep.inbox import Frame
from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.member import Guest, Member
from antenna_drive.lockstep.readings import CHANGES_QOS
from antenna_drive.lockstep.ros_link import FRAME_QOS, FrameLink
from antenna_drive.lockstep.run_control import PAUSED
from antenna_drive.lockstep.run_services import StateReader
from antenna_drive.lockstep.serving import Serving
import numpy as np
from std_msgs.msg import String

OnBegin = Callable[[int, float], None]
OnStep = Callable[[int, float, FloatArray], None]
OnChange = Callable[[str, Mapping[str, Any]], None]

_LONGEST_WAIT_S = 0.1

# To be woken for each frame would cost the drive more than to be read in bulk [s].
_NAP_S = 0.01


class _Reader(Unit):
    """The unit behind an observer: it reads everything and puts out nothing."""

    def __init__(self, name: str, inputs: tuple[str, ...], on_step: OnStep) -> None:
        super().__init__(name)
        self.inputs = inputs  # type: ignore[misc]
        self._on_step = on_step
        self._step_s = 0.0

    def start(self, step_s: float) -> FloatArray:
        self._step_s = step_s
        return np.zeros((0, 2))

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        self._on_step(k, k * self._step_s, inputs)
        return np.zeros((0, 2))


class Observer:
    """
    Calls back for every complete step of a drive.

    Use it as a context manager; `spin` does the work, in the thread that calls it.

    node : of the observer
    names : the signals, 'unit/signal', in the order of the rows given to `on_step`
    """

    def __init__(self, name: str, on_step: OnStep, *, on_begin: OnBegin | None = None,
                 on_change: OnChange | None = None, namespace: str = '',
                 guest: bool = False,
                 outputs: Mapping[str, Sequence[Signal]] = OUTPUTS) -> None:
        """
        Join a drive.

        name : name of the observer's node; a member is one that run.observers names
        on_step : called as on_step(step, time [s], samples) with an array of shape (len(names),
            2), value and derivative, valid during the call only
        on_begin : called as on_begin(run, macro-step [s]) when a run begins, also in the middle of
            another: what came before belongs to a run that is over; a guest's first step need not
            be step 0, and it may join the same run twice: what came before is void
        on_change : called as on_change(unit, record) with what a node says on `<unit>/changes`,
            see `changes`; from another thread
        namespace : where the drive is
        guest : True for an observer that nobody waits for
        outputs : the signals of each unit
        """
        self.names = tuple(
            f'{unit}/{signal.name}' for unit, signals in outputs.items() for signal in signals)
        self._on_begin = on_begin
        self.node = own_node(name, namespace)
        birth = float(time.time_ns() // 1000)
        reader = _Reader(name, self.names, on_step)
        self._member = Guest(reader, outputs) if guest else Member(reader, birth, outputs)
        self._begun = (0.0, 0)
        self._told = -1
        self._link = FrameLink(self.node, self._member.layouts)
        self._state = StateReader(self.node, self._member.conductor)
        # frames of the conductor that were taken before there was room for them
        self._ahead: deque[Frame] = deque()
        self._serving: Serving | None = None
        if on_change is not None:
            self._listen(outputs, on_change)
        if not guest:
            self._link.publish(self._member.hello())

    def _listen(self, outputs: Mapping[str, Sequence[Signal]], on_change: OnChange) -> None:
        for unit in outputs:
            def pass_on(message: String, unit: str = unit) -> None:
                record = read_record(message.data)
                if record is not None:
                    on_change(unit, record)

            self.node.create_subscription(String, f'{unit}/changes', pass_on, CHANGES_QOS)
        self._serving = Serving(self.node)

    @property
    def lost(self) -> str:
        """Say which frame was lost, '' if none: a guest that was too slow cannot go on."""
        for peer in self._member.peers:
            count = self._member.lost(peer)
            if count:
                return f'{count} frames of {peer} after step {self._member.step}'
        return ''

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the units that are waited for."""
        return self._member.missing()

    @property
    def senders(self) -> dict[str, float]:
        """Return whose frames of this run are read, by unit."""
        return dict(self._member.inbox.senders)

    @property
    def doubled(self) -> str:
        """Say which name two nodes have that took part in this run or can do so, '' for none."""
        for unit, senders in self._member.inbox.doubled.items():
            return two_of_one_name(unit, senders)
        for unit, count in self._link.publishers().items():
            if count > 1:
                return (f'{count} nodes are called {unit}; end all but one, or give each drive a '
                        'namespace of its own')
        return ''

    @property
    def resting(self) -> bool:
        """Return whether the drive has said that its run is over."""
        return self._member.resting

    @property
    def paused(self) -> bool:
        """Return whether an operator holds the drive; for the thread that spins."""
        state = self._state.latest()
        return state is not None and state.state == PAUSED and state.run == self._member.run

    def spin(self, until: Callable[[], bool]) -> None:
        """Follow the drive until `until()` is true; it is asked every 0.1 s and at each step."""
        member = self._member
        waiting_since: float | None = None
        stands_still = False
        while not until():
            if member.go_on(stands_still) is None:
                now = time.monotonic()
                waiting_since = now if waiting_since is None else waiting_since
                stands_still = now - waiting_since >= member.patience_s
                if not self._take():
                    if stands_still:
                        self._look_ahead()
                    self._tell()
                    self._link.wait(member.wanted(), _LONGEST_WAIT_S)
                    time.sleep(_NAP_S)
                continue
            waiting_since, stands_still = None, False
            begun = (member.run, member.joined if isinstance(member, Guest) else 0)
            if begun != self._begun:
                self._begun = begun
                self._told = -1
                if self._on_begin is not None:
                    self._on_begin(int(member.run), member.step_s)

    def _take(self) -> bool:
        """Take what has come; return whether anything has."""
        taken = False
        for peer in self._member.wanted():
            frame = self._next(peer)
            if frame is not None:
                self._member.receive(peer, frame)
                taken = True
        return taken

    def _next(self, peer: str) -> Frame | None:
        if self._ahead and peer == self._member.conductor:
            return self._ahead.popleft()
        return self._link.take(peer)

    def _look_ahead(self) -> None:
        """
        Look for the announcement of another run behind the frames that there is no room for.

        The drive may be hundreds of steps ahead of an observer. A node that is killed may not have
        sent the observer a frame that the others have. That frame never comes, and the next
        run is announced behind all the conductor's frames of this one.
        """
        member, ahead = self._member, self._ahead
        while len(ahead) < FRAME_QOS.depth:
            frame = self._link.take(member.conductor)
            if frame is None:
                break
            ahead.append(frame)
        begins = None
        for place, frame in enumerate(ahead):
            if frame[:1] == (member.run,):
                begins = None  # this run goes on: what was announced before was an invention
            elif frame[1:2] == (0.0,) and frame[0] != NO_RUN:
                begins = place
        if begins is not None:
            for _ in range(begins + 1):
                member.receive(member.conductor, ahead.popleft())

    def _tell(self) -> None:
        """Say how far we are, if that is news and somebody waits for it."""
        member = self._member
        if member.run and member.step != self._told and not isinstance(member, Guest):
            self._told = member.step
            self._link.publish(member.message())

    def close(self) -> None:
        """Leave the drive."""
        if self._serving is not None:
            self._serving.close()
        leave(self.node)

    def __enter__(self) -> 'Observer':
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
