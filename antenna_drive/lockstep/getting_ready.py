# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says of itself before it takes part: that its physics is being compiled."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread
import time
from typing import Any

from antenna_drive.lockstep.diagnostics import diagnostics
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from numba.core import event
from rclpy.node import Node

PERIOD_S = 1.0
# How often the log says how far it is, in periods.
_LOG_EVERY = 10


@contextmanager
def told_while_compiling(node: Node) -> Iterator[None]:
    """
    Say what takes so long, should anything be compiled in the meantime.

    In the log at once and every ten seconds, in /diagnostics every second.
    """
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
