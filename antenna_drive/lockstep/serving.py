# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The callbacks of a node, served in a thread of their own."""

from threading import Thread

from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor
from rclpy.node import Node

_PATIENCE_S = 0.5


class Serving:
    """
    Serves a node's subscriptions, services and timers until it is closed.

    Whatever arrives may be wrong: a callback that fails is logged, and the next one is served.
    """

    def __init__(self, node: Node) -> None:
        self._log = node.get_logger()
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        self._thread = Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            try:
                self._executor.spin()
                return
            except (ExternalShutdownException, ShutdownException):
                return
            except Exception as error:  # noqa: B902 (whatever a message makes a library raise)
                self._log.error(f'a message could not be served, {type(error).__name__}: {error}')

    def close(self) -> None:
        """Serve no more."""
        self._executor.shutdown(timeout_sec=_PATIENCE_S)
        self._thread.join(_PATIENCE_S)
