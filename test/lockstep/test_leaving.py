# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes leave the graph when nobody comes or goes, and never hang when they leave together."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import multiprocessing
from multiprocessing.synchronize import Barrier
import random
import socket
import sys
import time

import pytest

pytest.importorskip('rclpy', reason='there is no ROS 2 here')

from antenna_drive.lockstep.leaving import leave  # noqa: E402, I100
from rclpy.context import Context  # noqa: E402
from rclpy.node import Node  # noqa: E402
from std_msgs.msg import Float64MultiArray  # noqa: E402

LEAVERS = 5
TURNS = 300
# Each of five that leave together takes 0.2 s; a hang has no end.
HANGS_S = 20.0


def node_of(name: str) -> Node:
    context = Context()
    context.init(args=[])
    return Node(name, context=context)


@pytest.fixture
def other(node_domain: int) -> Iterator[Node]:
    found = node_of('other')
    yield found
    leave(found)


def test_others_see_that_a_node_has_left(other: Node) -> None:
    node = node_of('leaver')
    node.create_publisher(Float64MultiArray, 'said', 1)
    end = time.monotonic() + 30.0
    while other.count_publishers('said') == 0:
        assert time.monotonic() < end
        time.sleep(0.01)
    leave(node)
    assert not node.context.ok()
    while 'leaver' in other.get_node_names() or other.count_publishers('said'):
        assert time.monotonic() < end
        time.sleep(0.01)


def noted(node: Node, done: list[str], sleep: Callable[[float], None],
          monkeypatch: pytest.MonkeyPatch) -> None:
    """Call `sleep` in place of waiting, and note when the node leaves."""
    destroy = node.destroy_node

    def destroyed() -> None:
        done.append('left')
        destroy()

    monkeypatch.setattr('antenna_drive.lockstep.leaving.time.sleep', sleep)
    monkeypatch.setattr(node, 'destroy_node', destroyed)


def test_a_node_waits_while_others_come_and_go(
        other: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    node = node_of('leaver')
    done: list[str] = []

    def sleep(seconds: float) -> None:
        """Let somebody come three times."""
        if len(done) < 3:
            name = f'topic_{len(done)}'
            other.create_publisher(Float64MultiArray, name, 1)
            while node.count_publishers(name) == 0:
                pass
            done.append('came')
        else:
            done.append('quiet')

    noted(node, done, sleep, monkeypatch)
    leave(node)
    assert done == ['came', 'came', 'came', 'quiet', 'left']


@pytest.mark.skipif(sys.platform != 'linux', reason='turns are names that Linux has')
def test_a_node_waits_for_its_turn(node_domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    node = node_of('leaver')
    done: list[str] = []
    taken = socket.socket(socket.AF_UNIX)
    taken.bind(f'\0antenna_drive/leaving/{node_domain}')

    def sleep(seconds: float) -> None:
        """Let the other have left at the third look."""
        done.append('quiet' if taken.fileno() < 0 else 'not my turn')
        if len(done) == 3:
            taken.close()

    noted(node, done, sleep, monkeypatch)
    leave(node)
    assert done == ['not my turn', 'not my turn', 'not my turn', 'quiet', 'left']
    with socket.socket(socket.AF_UNIX) as following:
        following.bind(f'\0antenna_drive/leaving/{node_domain}')


def test_a_node_leaves_though_others_never_rest(
        node_domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    node = node_of('leaver')
    restless = iter(range(1_000_000))
    monkeypatch.setattr(node, 'count_publishers', lambda topic: next(restless))
    leave(node)
    assert not node.context.ok()


def test_a_node_leaves_a_context_that_was_shut_down(node_domain: int) -> None:
    node = node_of('leaver')
    node.context.shutdown()
    leave(node)
    assert not node.context.ok()


def come_and_leave(name: str, together: Barrier, turns: int) -> None:
    """Come and leave, again and again, with the others who have the same barrier."""
    for _ in range(turns):
        node = node_of(name)
        for k in range(12):
            node.create_publisher(Float64MultiArray, f'{name}/topic_{k}', 10)
        for k in range(LEAVERS):
            node.create_subscription(Float64MultiArray, f'leaver_{k}/topic_0', print, 10)
        together.wait(HANGS_S)
        time.sleep(0.3)  # until each knows the others
        together.wait(HANGS_S)
        time.sleep(random.uniform(0.0, 0.03))
        leave(node)
        together.wait(HANGS_S)


@pytest.mark.trial
def test_nodes_that_leave_together_do_not_hang(node_domain: int) -> None:
    # where nobody waited, one of the five hung in two of 300 turns
    spawning = multiprocessing.get_context('spawn')
    together = spawning.Barrier(LEAVERS)
    processes = [spawning.Process(target=come_and_leave, args=(f'leaver_{k}', together, TURNS))
                 for k in range(LEAVERS)]
    for process in processes:
        process.start()
    while all(process.exitcode is None for process in processes):
        time.sleep(0.5)
    for process in processes:
        process.join(HANGS_S)
        process.kill()
        process.join()
    assert [process.exitcode for process in processes] == [0] * LEAVERS
