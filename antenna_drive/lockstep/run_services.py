# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Run control on ROS 2: services of the conductor, and the state that every node hears.

std_srvs/Trigger fits all of them but a number of steps, which is the parameter run.steps.
"""

from collections.abc import Callable
import time
from typing import Any

from antenna_drive.lockstep.conductor import Conductor
from antenna_drive.lockstep.node_parameters import ReadSheet, SHEET
from antenna_drive.lockstep.pace import Pace
from antenna_drive.lockstep.ros_link import remembered, unserved
from antenna_drive.lockstep.ros_parameters import PATIENCE_S
from antenna_drive.lockstep.run_control import (
    PAUSED, PLAYING, read_state, RunControl, RunState, STOPPED,
)
from rclpy.node import Node
from rclpy.parameter import Parameter
from simgap.errors import UserError
from std_msgs.msg import String
from std_srvs.srv import Trigger

TOPIC = 'run_state'
# Whoever comes late hears the state that is in force.
STATE_QOS = remembered(1)

# `step` answers after this at the latest [s]: parameters are served by the same thread.
STEP_PATIENCE_S = 1.0


class RunServices:
    """
    A run as people control it, on the node of its conductor.

    The services are `<node>/pause`, `resume`, `step`, `reset`, `state`, and `play` where a test
    sheet can be played; the state is on `<node>/run_state`.
    """

    def __init__(self, node: Node, conductor: Conductor, pace: Pace, wake: Callable[[], None],
                 reached: Callable[[], int], hurry: Callable[[], None],
                 read_sheet: ReadSheet | None) -> None:
        """
        Offer the services.

        node, conductor, pace : the node that offers them, and the run that they control
        wake : makes the lock-step thread look
        reached : returns the step that the node is at, to any thread
        hurry : lets /diagnostics follow a change of the state at once
        read_sheet : returns the settings that play the test sheet in a file; None for a conductor
            that plays none
        """
        self.control = RunControl(PATIENCE_S, wake)
        self._node, self._conductor, self._pace = node, conductor, pace
        self._reached, self._hurry = reached, hurry
        self._told = ('', 0)
        self._topic = node.create_publisher(String, f'{node.get_name()}/{TOPIC}', STATE_QOS)
        self._offer('pause', self.control.pause)
        self._offer('resume', self._resume)
        self._offer('step', self._step)
        self._offer('reset', self.control.reset)
        self._offer('state', lambda: '')
        if read_sheet is not None:
            self._offer('play', lambda: self._play(read_sheet))

    def _offer(self, name: str, act: Callable[[], str]) -> None:
        def serve(request: Any, response: Any) -> Any:
            reason = act()
            response.success = not reason
            response.message = reason or str(self.state())
            return response

        self._node.create_service(Trigger, f'{self._node.get_name()}/{name}', serve)

    def _restart_clock(self) -> None:
        """Let the next step of a paused run be due now, and the others after it, at its pace."""
        if self.control.paused:
            self._pace.change(self._pace.factor, time.monotonic(), self._reached())

    def _resume(self) -> str:
        self._restart_clock()
        return self.control.resume()

    def _step(self) -> str:
        self._restart_clock()
        steps = int(self._node.get_parameter('run.steps').value or 1)
        return self.control.step(steps, STEP_PATIENCE_S)

    def _play(self, read_sheet: ReadSheet) -> str:
        """Begin a run with the waveform of the test sheet that the parameters name."""
        path = str(self._node.get_parameter(SHEET).value or '')
        if not path:
            return f'{SHEET}: not given, set it to the file of a test sheet'
        try:
            settings = read_sheet(path)
        except UserError as error:
            return str(error)
        result = self._node.set_parameters_atomically([
            Parameter(name, value=list(value) if isinstance(value, tuple) else value)
            for name, value in settings.items()])
        reason = ('' if result.successful else result.reason) or self.control.reset()
        return self._resume() if not reason and self.control.paused else reason

    def state(self) -> RunState:
        """Return what the conductor says of its run, from any thread."""
        conductor = self._conductor
        step = self._reached()
        state = PAUSED if self.control.holds(step) else PLAYING
        if conductor.run == 0.0 or conductor.ended or conductor.fault:
            state = STOPPED
        return RunState(state, int(conductor.run), step)

    def held(self) -> bool:
        """Return whether the drive is held at its step; begin the new run that was asked for."""
        control, conductor = self.control, self._conductor
        if control.reset_wanted:
            conductor.begin_again()
        if not control.holds(conductor.step):
            return False
        if conductor.run and control.stands(conductor.step):
            self._tell(self.state())
        return True

    def tell_news(self) -> None:
        """Say what the run does now, to people and to the other nodes, if that is news."""
        state = self.state()
        if (state.state, state.run) != self._told:
            self._tell(state)

    def _tell(self, state: RunState) -> None:
        self._told = (state.state, state.run)
        self._topic.publish(String(data=state.text()))
        self._hurry()


class StateReader:
    """What a conductor has said last of its run, read by the thread that asks."""

    def __init__(self, node: Node, conductor: str) -> None:
        """Listen to `<conductor>/run_state`."""
        self._subscription = unserved(node, String, f'{conductor}/{TOPIC}', STATE_QOS)
        self._last: RunState | None = None

    def latest(self) -> RunState | None:
        """Return the state that was told last, None if none was."""
        while (taken := self._subscription.handle.take_message(String, False)) is not None:
            self._last = read_state(taken[0].data) or self._last
        return self._last
