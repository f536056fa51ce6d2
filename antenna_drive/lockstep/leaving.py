# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How a process leaves the graph without hanging in the middleware.

Before Fast DDS 3.2 removes a participant, it waits until no callback of discovery runs, with no
limit: until the last moment that std::chrono can tell. Compiled against a C library older than
2.30, as the wheels on PyPI are, libstdc++ translates that moment into another clock, where it
overflows. The call to wait is refused then (a negative time), so the thread goes round and round.
It keeps the lock that the callback waits for, and Python's lock as well: the process hangs for
good. Callbacks run while somebody else comes or goes, so we leave when nobody does.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import errno
import socket
import sys
import time

from rclpy.node import Node

# The graph is quiet if it is the same after this time.
_QUIET_S = 0.05
_PATIENCE_S = 1.0
_LOOK_S = 0.01


def leave(node: Node) -> None:
    """
    Destroy the only node of a context, and the context, when nobody comes or goes.

    Processes of one machine take turns, because those that leave together would wait for quiet
    together, too. Waits for a second at most.
    """
    context = node.context
    if not context.ok():  # shut down by a signal, say: nothing can be asked of it any more
        node.destroy_node()
        return
    deadline = time.monotonic() + _PATIENCE_S
    with held(f'antenna_drive/leaving/{context.get_domain_id()}', deadline):
        before, now = None, _graph(node)
        while now != before and time.monotonic() < deadline:
            time.sleep(_QUIET_S)
            before, now = now, _graph(node)
        node.destroy_node()
        context.try_shutdown()


def _graph(node: Node) -> object:
    """Return what the node knows of the graph."""
    return (node.get_node_names_and_namespaces(),
            [(topic, node.count_publishers(topic), node.count_subscribers(topic))
             for topic, _ in node.get_topic_names_and_types()])


@contextmanager
def held(name: str, deadline: float = 0.0) -> Iterator[bool]:
    """Hold a name on this machine once it is free; yield False if it is not by the deadline."""
    if sys.platform != 'linux':
        yield True
        return
    # A name in the abstract namespace is no file and vanishes with its process.
    with socket.socket(socket.AF_UNIX) as place:
        while (taken := _is_taken(place, name)) and time.monotonic() < deadline:
            time.sleep(_LOOK_S)
        yield not taken


def _is_taken(place: socket.socket, name: str) -> bool:
    """Return whether another process has a name; if none has, the socket takes it."""
    try:
        place.bind(f'\0{name}')
    except OSError as error:
        return error.errno == errno.EADDRINUSE
    return False
