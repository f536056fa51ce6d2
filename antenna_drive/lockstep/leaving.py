# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
How a process leaves the graph without hanging in the middleware.

Before Fast DDS 3.2 removes a participant, it waits until no callback of discovery runs, with no
limit: until the last moment that std::chrono can tell. Compiled against a C library older than
2.30, as the wheels on PyPI are, libstdc++ translates that moment into another clock, where it
overflows. The call to wait is refused then (a negative time), so the thread goes round and round.
It keeps the lock that the callback waits for, and Python's lock as well: the process hangs for
good. Callbacks run while somebody else comes or goes, so we leave when nobody does.
"""

from __future__ import annotations

import time

from rclpy.node import Node

# The graph is quiet if it is the same after this time; measured, see docs/decisions.md.
_QUIET_S = 0.05
_PATIENCE_S = 1.0


def leave(node: Node) -> None:
    """
    Destroy the only node of a context, and the context, when nobody comes or goes.

    The node's publishers, subscriptions, clients and services go first, at once: of those who
    leave together, each hears of the others' in the time in which none can hang. Then it waits
    for quiet, a second at most.
    """
    for publisher in list(node.publishers):
        node.destroy_publisher(publisher)
    for subscription in list(node.subscriptions):
        node.destroy_subscription(subscription)
    for client in list(node.clients):
        node.destroy_client(client)
    for service in list(node.services):
        node.destroy_service(service)
    end = time.monotonic() + _PATIENCE_S
    before, now = None, _graph(node)
    while now != before and time.monotonic() < end:
        time.sleep(_QUIET_S)
        before, now = now, _graph(node)
    context = node.context
    node.destroy_node()
    context.try_shutdown()


def _graph(node: Node) -> object:
    if not node.context.ok():
        return None
    return (node.get_node_names_and_namespaces(),
            [(topic, node.count_publishers(topic), node.count_subscribers(topic))
             for topic, _ in node.get_topic_names_and_types()])
