# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes with use_sim_time beside a drive in a namespace have the time of that drive."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from drive_watch import Watch  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402

# As fast as a machine that is busy can follow: the pace has no part in this.
PACE = {'test_signal': {'run.pace': 0.5}}


@contextmanager
def tool(watch: Watch, namespace: str, topic: str = '/clock') -> Iterator[Node]:
    """Run a node that uses simulated time, as any tool does."""
    node = Node('tool', namespace=namespace, context=watch.node.context,
                cli_args=['--ros-args', '-r', f'/clock:={topic}'],
                parameter_overrides=[Parameter('use_sim_time', value=True)])
    watch.executor.add_node(node)
    try:
        yield node
    finally:
        watch.executor.remove_node(node)
        node.destroy_node()


def time_ns(node: Node) -> int:
    now: int = node.get_clock().now().nanoseconds
    return now


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize('tools', ['/east', '/east/tools'])
@pytest.mark.slow
def test_a_tool_in_the_namespace_of_a_drive_has_its_time(tools: str) -> None:
    with Watch('/east') as watch, DriveProcesses(PACE, namespace='/east'):
        stamps: set[int] = set()
        watch.node.create_subscription(Clock, 'clock', lambda message: stamps.add(
            message.clock.sec * 10**9 + message.clock.nanosec), 100)
        watch.until(lambda: len(stamps) > 1, 'a drive')
        assert not watch.node.count_publishers('/clock'), 'nobody there asks for it'
        with tool(watch, tools) as node:
            watch.until(lambda: time_ns(node) > 0, 'the time')
            at = watch.call('test_signal/pause').message
            # the time of the step at which the drive stands, and so who comes now has it, too
            step_ns = int(at.split()[3]) * 1_000_000
            watch.until(lambda: time_ns(node) == step_ns, at)
            with tool(watch, tools) as late:
                watch.until(lambda: time_ns(late) == step_ns, at)
        watch.until(lambda: not watch.node.count_publishers('/clock'), 'the end of it')


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_the_time_of_somebody_else_is_told_apart() -> None:
    """Another simulator has /clock; the drive leaves it alone, and says what its tools need."""
    with Watch() as watch, DriveProcesses(PACE, namespace='/east') as processes:
        theirs = watch.node.create_publisher(Clock, '/clock', 1)
        watch.until(lambda: 'begins' in processes.log('test_signal'), 'a run')
        with tool(watch, '/east'):
            watch.until(lambda: 'start with -r /clock:=/east/clock' in processes.log(
                'test_signal'), 'a word')
            assert '/east/tool would take it' in processes.log('test_signal')
            assert watch.node.count_publishers('/clock') == 1
        with tool(watch, '/east', '/east/clock') as node:
            watch.until(lambda: time_ns(node) > 0, 'the time, as it was said')
        watch.node.destroy_publisher(theirs)


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_of_two_drives_the_first_one_has_it() -> None:
    """Only one publishes; the conductors alone are there, and their tools."""
    with Watch() as watch, DriveProcesses(order=['test_signal'], namespace='/east') as east, \
            DriveProcesses(order=['test_signal'], namespace='/west') as west, \
            tool(watch, '/west'):
        def publishers() -> list[str]:
            return [info.node_namespace for info in
                    watch.node.get_publishers_info_by_topic('/clock')]

        watch.until(lambda: publishers() == ['/west'], 'the only one that is asked')
        with tool(watch, '/east'):
            watch.until(lambda: publishers() == ['/east'], 'the first one')
            watch.until(lambda: '/clock:=/west/clock' in west.log('test_signal'), 'a word')
        watch.until(lambda: publishers() == ['/west'], 'the other one again')
        assert '/clock:=' not in east.log('test_signal')
