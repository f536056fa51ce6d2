# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says of itself as it starts: what it compiles, whom it waits for, its namesake."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
import os
from threading import Event, Thread
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from numba.core import event
from rclpy.node import Node

# A wait is told after this [s].
PATIENCE_S = 0.9
# Fast DDS takes a process for gone that it has not heard of for so long (the lease duration).
LEASE_S = 20.0
# While it compiles, a node says so in /diagnostics at this period, and in the log every tenth.
PERIOD_S = 1.0
_LOG_EVERY = 10


def say_ready(node: Node, waits_for: str) -> None:
    """Say once that the node can take part, whom it waits for, and whether its name is taken."""
    log = node.get_logger()
    log.info(f'ready; waits for {waits_for}')
    if said := namesake(node):
        log.warning(said)


class Absence:
    """Says in the log of a node that only reads whose frames it waits for, when that changes."""

    def __init__(self, node: Node, publishers: Callable[[], dict[str, int]]) -> None:
        """Say that the node is ready; `publishers` counts those of each unit's frames."""
        self._log = node.get_logger()
        self._publishers = publishers
        self._absent = self._told = self._missing()
        self._since_s = 0.0
        say_ready(node, f'the frames of {", ".join(self._absent) or "the drive"}')

    def _missing(self) -> Sequence[str]:
        return [unit for unit, count in self._publishers().items() if not count]

    def look(self, now: float) -> None:
        """Look at `now` [s] who is there."""
        absent = self._missing()
        if absent != self._absent:
            self._absent, self._since_s = absent, now
        if absent != self._told and now - self._since_s >= PATIENCE_S:
            self._told = absent
            self._log.info(f'waiting for the frames of {", ".join(absent)}' if absent
                           else 'the frames of every unit come')


def namesake(node: Node) -> str:
    """Say that another node has the node's name, and what to do; '' if none is known of."""
    own = node.get_name(), node.get_namespace()
    if sum(item == own for item in node.get_node_names_and_namespaces()) < 2:
        return ''
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return (f'another node is called {node.get_fully_qualified_name()} in ROS domain {domain}: '
            'end one of the two, or give each drive a namespace (-r __ns:=/east) or a domain '
            f'(ROS_DOMAIN_ID); a node that was killed is forgotten after {LEASE_S:.0f} s')


def diagnostics(node: Node, level: bytes, message: str,
                values: Iterable[tuple[str, str]]) -> DiagnosticArray:
    """Return what a node says of itself: how bad it is, in words, and in named values."""
    status = DiagnosticStatus(level=level, name=node.get_fully_qualified_name(), message=message,
                              hardware_id='antenna_drive')
    status.values = [KeyValue(key=key, value=value) for key, value in values]
    array = DiagnosticArray(status=[status])
    array.header.stamp = node.get_clock().now().to_msg()
    return array


@contextmanager
def told_while_compiling(node: Node) -> Iterator[None]:
    """Say if something is compiled: in the log every ten seconds, in /diagnostics every second."""
    compiling = _Compiling(node)
    try:
        with event.install_listener('numba:compile', compiling):
            yield
    finally:
        compiling.close()


class _Compiling(event.Listener):  # type: ignore[misc]
    """Hears of each function that numba begins and ends to compile."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._functions = 0
        self._began_s = 0.0
        self._over = Event()
        self._thread: Thread | None = None

    def on_start(self, event: Any) -> None:
        """Begin to tell, at the first function."""
        if self._thread is None:
            self._began_s = time.monotonic()
            self._node.get_logger().info(
                'compiling the physics for this machine, once; it can take some minutes')
            self._thread = Thread(target=self._tell, daemon=True)
            self._thread.start()

    def on_end(self, event: Any) -> None:
        """Count a function."""
        self._functions += 1

    def close(self) -> None:
        """Tell no more."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()
            self._node.get_logger().info(f'compiled {self._so_far()}')

    def _so_far(self) -> str:
        return f'{self._functions} functions in {time.monotonic() - self._began_s:.0f} s'

    def _tell(self) -> None:
        topic = self._node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        periods = 0
        while True:
            topic.publish(diagnostics(
                self._node, DiagnosticStatus.WARN,
                f'compiling the physics, {self._so_far()} so far',
                [('compiled functions', str(self._functions)),
                 ('compiling since [s]', f'{time.monotonic() - self._began_s:.1f}')]))
            if self._over.wait(PERIOD_S):
                break
            periods += 1
            if periods % _LOG_EVERY == 0:
                self._node.get_logger().info(f'still compiling, {self._so_far()} so far')
        self._node.destroy_publisher(topic)
