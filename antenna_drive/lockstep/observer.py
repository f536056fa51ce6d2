# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Somebody who reads every signal of a running drive at every step.

An observer that test_signal was told of (run.observers) loses none: the drive never gets further
ahead of it than the nodes remember, however fast it runs. Any other is a guest: it joins a run
where it is, and loses none as long as it keeps within what the nodes remember, the last thousand
steps.
"""

from collections.abc import Callable, Mapping, Sequence
import time
from typing import Any

from antenna_drive.emulator.unit import FloatArray, Signal
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep.changes import read_record
from antenna_drive.lockstep.entry import own_node
from antenna_drive.lockstep.following import Follower, Step
from antenna_drive.lockstep.frame import FrameLayout, new_sender
from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.readings import CHANGES_QOS
from antenna_drive.lockstep.ros_link import FrameLink, unserved
from antenna_drive.lockstep.run_control import PAUSED, RunState
from antenna_drive.lockstep.run_services import StateReader
from antenna_drive.lockstep.serving import Serving
import numpy as np
from rclpy.node import Node
from std_msgs.msg import String

OnBegin = Callable[[int, float], None]
OnStep = Callable[[int, float, FloatArray], None]
OnChange = Callable[[str, Mapping[str, Any]], None]

_LONGEST_WAIT_S = 0.1

# To be woken for each frame would cost the drive more than to be read in bulk [s].
NAP_S = 0.01


class Observer(Follower):
    """
    Calls back for every complete step of a drive.

    Use it as a context manager; `spin` does the work, in the thread that calls it.

    node : of the observer
    names : the signals, 'unit/signal', in the order of the rows given to `on_step`
    idle : whether nothing came in the last wait for frames
    """

    def __init__(self, node: str | Node, on_step: OnStep, *, on_begin: OnBegin | None = None,
                 on_change: OnChange | None = None, namespace: str = '', nap_s: float = NAP_S,
                 outputs: Mapping[str, Sequence[Signal]] = OUTPUTS) -> None:
        """
        Join a drive.

        node : of the observer, or the name of one of its own; the drive waits for those whose name
            is in run.observers
        on_step : called as on_step(step, time [s], samples) with an array of shape (len(names),
            2), value and derivative
        on_begin : called as on_begin(run, macro-step [s]) before the first step of a run, which
            need not be step 0 where the observer comes late; what came before belongs to a run
            that is over
        on_change : called as on_change(unit, record) with what a node says on `<unit>/changes`,
            see `changes`
        namespace : where the drive is, for a node of the observer's own
        nap_s : how long to let frames come before they are read [s]
        outputs : the signals of each unit
        """
        layouts = {unit: FrameLayout(signals) for unit, signals in outputs.items()}
        super().__init__({unit: layout.length for unit, layout in layouts.items()}, TEST_SIGNAL)
        self.names = tuple(
            f'{unit}/{signal.name}' for unit, signals in outputs.items() for signal in signals)
        self._on_step, self._on_begin, self._nap_s = on_step, on_begin, nap_s
        self._owns_node = isinstance(node, str)
        self.node = own_node(node, namespace) if isinstance(node, str) else node
        self._link = FrameLink(self.node, layouts)
        self.publishers = self._link.publishers
        self._state = StateReader(self.node, TEST_SIGNAL)
        self._own, self._sender = FrameLayout(()), new_sender()
        # run, number and length of the step that is wanted next, and the one that was told
        self._wanted = self._told = (0, 0, 0.0)
        self.idle = False
        self._on_change = on_change
        self._changes = {} if on_change is None else {
            unit: unserved(self.node, String, f'{unit}/changes', CHANGES_QOS) for unit in outputs}
        self._serving = None if on_change is None else Serving(self.node)
        self._link.publish(self._own.hello(float(time.time_ns() // 1000), self._sender))

    @property
    def state(self) -> RunState | None:
        """Return what the drive said last of its run; for the thread that spins."""
        return self._state.latest()

    @property
    def paused(self) -> bool:
        """Return whether an operator holds the drive; for the thread that spins."""
        state = self.state
        return state is not None and state.state == PAUSED and state.run == self.run

    def spin(self, until: Callable[[], bool]) -> None:
        """Follow the drive until `until()` is true; it is asked every 0.1 s and at each step."""
        while not until():
            came = self._take()
            self.idle = self.idle and not came
            for step in self.steps():
                self._hand_on(step)
                if until():
                    return
            self._tell()
            if not came:
                self.idle = not self._link.wait(tuple(self.lengths), _LONGEST_WAIT_S)
            time.sleep(self._nap_s)

    def finish(self) -> None:
        """Hand on all that has come; nothing more is waited for."""
        super().finish()
        self._take()
        for step in self.steps():
            self._hand_on(step)

    def _take(self) -> bool:
        """Take what has come; return whether anything has."""
        taken = False
        for unit in self.lengths:
            while (frame := self._link.take(unit)) is not None:
                self.receive(unit, frame)
                taken = True
        # what is in force comes before the steps, and not by an executor
        for unit, subscription in self._changes.items():
            while (message := subscription.handle.take_message(String, False)) is not None:
                if (record := read_record(message[0].data)) is None:
                    self.refused += 1
                elif self._on_change is not None:
                    self._on_change(unit, record)
        return taken

    def _hand_on(self, step: Step) -> None:
        if step.run != self._wanted[0] and self._on_begin is not None:
            self._on_begin(step.run, step.step_s)
        self._wanted = step.run, step.number + 1, step.step_s
        self._on_step(step.number, step.number * step.step_s,
                      np.array(step.numbers).reshape(-1, 2))

    def _tell(self) -> None:
        """Say how far we are, if that is news: a drive may wait for it."""
        if self._wanted != self._told:
            self._told = self._wanted
            self._link.publish(self._own.encode(*self._wanted, self._sender))

    def close(self) -> None:
        """Leave the drive."""
        if self._serving is not None:
            self._serving.close()
        if self._owns_node:
            leave(self.node)

    def __enter__(self) -> 'Observer':
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
