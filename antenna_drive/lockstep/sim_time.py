# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The time of a drive in a namespace, for nodes there that use simulated time.

A node with use_sim_time reads `/clock`, in whatever namespace it is, and a drive in `/east`
publishes `/east/clock`. As long as nodes of its namespace listen to `/clock` and nobody else
publishes it, the drive does. Where several drives would, the first namespace of the alphabet has
it, and the others say what to do.
"""

from collections.abc import Callable
from threading import Event, Thread
import time
from typing import Any

from antenna_drive.lockstep.readings import READING_QOS
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

TOPIC = '/clock'
# How often listeners are looked for, and how often they are told the time [s].
_LOOK_S = 0.5
_TELL_S = 0.01


class SimTime:
    """Publishes `/clock` while nodes of a drive's namespace need it, from a thread of its own."""

    def __init__(self, node: Node, simulated_s: Callable[[], float]) -> None:
        """
        Begin to look; in the root namespace `/clock` is the drive's own clock, and nothing is due.

        node : the conductor's
        simulated_s : returns the time of the drive [s], 0.0 if it has not begun; called by another
            thread
        """
        self._node = node
        self._space = node.get_namespace()
        self._simulated_s = simulated_s
        self._publisher: Any = None
        self._told: list[str] = []
        self._over = Event()
        self._thread = Thread(target=self._serve, daemon=True)
        if self._space != '/':
            self._thread.start()

    def close(self) -> None:
        """Look no more."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join()

    def _serve(self) -> None:
        look_at = 0.0
        while not self._over.wait(_TELL_S if self._publisher else _LOOK_S):
            now = time.monotonic()
            if now >= look_at:
                look_at = now + _LOOK_S
                self._look()
            seconds = self._simulated_s()
            if self._publisher is not None and seconds > 0.0:
                message = Clock()
                message.clock.sec, message.clock.nanosec = divmod(round(1e9 * seconds), 10**9)
                self._publisher.publish(message)

    def _look(self) -> None:
        """Begin to publish or cease, and say who goes without the time of this drive."""
        listeners = sorted(
            f'{info.node_namespace.rstrip("/")}/{info.node_name}'
            for info in self._node.get_subscriptions_info_by_topic(TOPIC)
            if f'{info.node_namespace}/'.startswith(f'{self._space}/'))
        ours = bool(listeners) and self._is_first()
        if ours and self._publisher is None:
            self._publisher = self._node.create_publisher(Clock, TOPIC, READING_QOS)
        elif not ours and self._publisher is not None:
            self._node.destroy_publisher(self._publisher)
            self._publisher = None
        without = [] if ours else listeners
        if without and without != self._told:
            self._node.get_logger().warning(
                f'{TOPIC} is published by somebody else, and {", ".join(without)} would take it '
                f'for the time of this drive; start with -r {TOPIC}:={self._space}/clock')
        self._told = without

    def _is_first(self) -> bool:
        """Tell whether nobody publishes the topic but drives that will leave it to this one."""
        name = self._node.get_name()
        return all(info.node_name == name and info.node_namespace >= self._space
                   for info in self._node.get_publishers_info_by_topic(TOPIC))
