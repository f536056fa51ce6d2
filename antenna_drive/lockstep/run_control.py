# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The state of a run as an operator controls it: playing, paused, stopped. Nothing here needs ROS.

The states and what `pause`, `step` and `reset` mean are those of simulation_interfaces
(SimulationState, StepSimulation, ResetSimulation); docs/lockstep.md says where they differ.
"""

from collections.abc import Callable
import json
from threading import Condition
from typing import NamedTuple

from antenna_drive.lockstep.changes import is_count

STOPPED, PLAYING, PAUSED = 'stopped', 'playing', 'paused'
STATES = (STOPPED, PLAYING, PAUSED)

# Longer texts are no state.
_LONGEST_TEXT = 200


class RunState(NamedTuple):
    """What a conductor says of its run."""

    state: str  # one of STATES
    # the run, 0 if there is none yet, and its last step that was made
    run: int
    step: int

    def text(self) -> str:
        """Return the JSON that `read_state` reads."""
        return json.dumps(self._asdict())

    def __str__(self) -> str:
        """Say the state in words."""
        return f'{self.state} at step {self.step} of run {self.run}' if self.run else self.state


def read_state(text: str) -> RunState | None:
    """Return the state that a text holds, None if it holds none: anybody can publish anything."""
    if len(text) > _LONGEST_TEXT:
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict) or found.keys() != set(RunState._fields):
        return None
    state = RunState(**found)
    return state if (state.state in STATES and is_count(state.run)
                     and is_count(state.step)) else None


class RunControl:
    """
    Requests to a run, from the threads that ask to the lock-step thread.

    The lock-step thread asks `holds` before each step and tells what has come of it with
    `stands`, `begun` and `ended`. The methods that ask return why the request is refused, or ''
    when it is in force.

    paused : whether the drive is paused or on its way there
    reset_wanted : whether a new run was asked for
    """

    def __init__(self, patience_s: float, wake: Callable[[], None]) -> None:
        """Let requests wait for so long [s] for the lock-step thread, which `wake` lets look."""
        self._patience_s, self._wake = patience_s, wake
        self._changed = Condition()
        self.paused = False
        self._until = 0
        self._standing: int | None = None
        self._begun = 0
        self.reset_wanted = False

    @property
    def halt(self) -> int:
        """Return the step after which a stepping drive is paused again, 0 for none."""
        return self._until if self.paused else 0

    def holds(self, step: int) -> bool:
        """Return whether no step is to be made after `step`."""
        return self.paused and step >= self._until

    def stands(self, step: int) -> bool:
        """Note that the drive stands still at `step`; return whether that is news."""
        if self._standing == step:
            return False
        with self._changed:
            if not self.holds(step):  # asked to go on just now
                return False
            self._standing = step
            self._changed.notify_all()
        return True

    def begun(self) -> None:
        """Note that a run has begun: a paused drive stands still at its step 0."""
        with self._changed:
            self.reset_wanted = False
            self._until = 0
            self._standing = None
            self._begun += 1
            self._changed.notify_all()

    def pause(self) -> str:
        """Make no more steps; return when the drive stands still."""
        with self._changed:
            if not self.paused:
                self.paused = True
                self._standing = None
            self._until = 0
            return self._wait(lambda: self._standing is not None, 'come to its next step')

    def resume(self) -> str:
        """Go on with the run."""
        with self._changed:
            if not self.paused:
                return 'the drive is not paused'
            self.paused = False
            self._standing = None
            self._wake()
        return ''

    def step(self, count: int, patience_s: float) -> str:
        """
        Make so many steps of a paused run; return when they are made.

        It returns after `patience_s` [s] at the latest, and the steps go on to be made.
        """
        with self._changed:
            if not self.paused or self._standing is None:
                return 'steps can be made in a paused run only: call pause first'
            self._until = self._standing + count
            self._standing = None
            self._wake()
            self._changed.wait_for(lambda: self._standing is not None, patience_s)
        return ''

    def reset(self) -> str:
        """Begin a new run; return when it has begun. A paused drive stays paused."""
        with self._changed:
            before = self._begun
            self.reset_wanted = True
            return self._wait(lambda: self._begun > before, 'heard from all its nodes')

    def _wait(self, done: Callable[[], bool], what: str) -> str:
        self._wake()
        if self._changed.wait_for(done, self._patience_s):
            return ''
        return f'the drive has not {what} for {self._patience_s:g} s; it will when it can'
