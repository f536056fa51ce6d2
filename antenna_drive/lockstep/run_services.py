# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Run control on ROS 2: services of the conductor, and the state that every node hears.

std_srvs/Trigger fits all of them but a number of steps, which is the parameter run.steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from antenna_drive.lockstep.ros_link import NotForExecutors
from antenna_drive.lockstep.run_control import read_state, RunControl, RunState
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import Trigger

TOPIC = 'run_state'
# Whoever comes late hears the state that is in force.
STATE_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                       durability=DurabilityPolicy.TRANSIENT_LOCAL)

# `step` answers after this at the latest [s]: parameters are served by the same thread.
STEP_PATIENCE_S = 1.0


class RunServices:
    """The services `<node>/pause`, `resume`, `step`, `reset`, `play`, `state`, and the state."""

    def __init__(self, node: Node, control: RunControl, wake: Callable[[], None],
                 state: Callable[[], RunState], steps: Callable[[], int],
                 restart_clock: Callable[[], None], play: Callable[[], str] | None) -> None:
        """
        Offer the services.

        Parameters
        ----------
        node, control
            the node that offers them, and what they ask
        wake
            makes the lock-step thread look
        state
            returns the state of the run
        steps
            returns how many steps `step` makes
        restart_clock
            lets a paced drive go on from where it stands, without catching up
        play
            puts the test sheet that the parameters name in force and says what it is; None for
            a conductor that plays none

        """
        self._state = state
        self._topic = node.create_publisher(String, f'{node.get_name()}/{TOPIC}', STATE_QOS)

        def offer(name: str, act: Callable[[], str]) -> None:
            def serve(request: Any, response: Any) -> Any:
                reason = act()
                response.success = not reason
                response.message = reason or str(state())
                return response

            node.create_service(Trigger, f'{node.get_name()}/{name}', serve)

        def resume() -> str:
            if control.paused:
                restart_clock()
            reason = control.resume()
            wake()
            return reason

        def step() -> str:
            if control.paused:
                restart_clock()
            return control.step(steps(), wake, STEP_PATIENCE_S)

        def begin_sheet() -> str:
            assert play is not None
            reason = play() or control.reset(wake)
            if not reason and control.paused:
                reason = resume()
            return reason

        offer('pause', lambda: control.pause(wake))
        offer('resume', resume)
        offer('step', step)
        offer('reset', lambda: control.reset(wake))
        offer('state', lambda: '')
        if play is not None:
            offer('play', begin_sheet)

    def publish(self) -> None:
        """Tell the state of the run to whoever listens."""
        self._topic.publish(String(data=self._state().text()))


class StateReader:
    """What a conductor has said last of its run, read by the thread that asks."""

    def __init__(self, node: Node, conductor: str) -> None:
        """Listen to `<conductor>/run_state`."""
        self._subscription = node.create_subscription(
            String, f'{conductor}/{TOPIC}', _never_called, STATE_QOS,
            callback_group=NotForExecutors())
        self._last: RunState | None = None

    def latest(self) -> RunState | None:
        """Return the state that was told last, None if none was."""
        while (taken := self._subscription.handle.take_message(String, False)) is not None:
            self._last = read_state(taken[0].data) or self._last
        return self._last


def _never_called(message: Any) -> None:
    raise AssertionError('states are read when they are asked for')
