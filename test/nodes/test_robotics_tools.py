# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What robotics tools see of a running drive: joints."""

from __future__ import annotations

from collections.abc import Iterator
import os
import signal
import subprocess
import sys
from typing import Any

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to look at')
pytest.importorskip('tornado', reason='tornado is not installed: no page with a drive')

from antenna_drive.lockstep.readings import steps_between  # noqa: E402, I100
from antenna_drive.nodes.joint_states_node import axis_state, motor_states  # noqa: E402
from drive_watch import Watch  # noqa: E402
from live_command import LiveCommand  # noqa: E402
from rclpy.serialization import serialize_message  # noqa: E402
from rosbags.typesys import get_typestore, Stores  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from simgap.command.programs import BAD_INPUT  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402

PATIENCE_S = 120.0
READINGS = ('plant/encoder', 'plant/axis_rate', 'motor_1/tach_rate', 'motor_2/tach_rate',
            'motor_1/gear_torque', 'motor_2/gear_torque')


def test_joints_are_as_another_reader_of_ros_messages_reads_them() -> None:
    time_s, values = 2_000_500 * 1e-3, {
        'plant/axis_rate': 0.2, 'plant/encoder': 0.3,
        'motor_1/gear_torque': 1.2, 'motor_1/tach_rate': 1.4,
        'motor_2/gear_torque': 2.2, 'motor_2/tach_rate': 2.4}
    read: Any = get_typestore(Stores.ROS2_KILTED)
    axis, motors = (read.deserialize_cdr(serialize_message(state), 'sensor_msgs/msg/JointState')
                    for state in (axis_state(time_s, values, 'axis', 100.0),
                                  motor_states(time_s, values, ['a', 'b'])))
    for state in (axis, motors):
        assert (state.header.stamp.sec, state.header.stamp.nanosec) == (2000, 500_000_000)
    assert (axis.name, axis.position.tolist(), axis.velocity.tolist()) == (['axis'], [0.3], [0.2])
    assert axis.effort.tolist() == pytest.approx([340.0])
    assert (motors.name, motors.position.tolist()) == (['a', 'b'], [])
    assert (motors.velocity.tolist(), motors.effort.tolist()) == ([1.4, 2.4], [1.2, 2.2])
    untold = axis_state(time_s, values, 'axis', None)
    assert list(untold.effort) == [], 'the plant has not told its ratio'


@pytest.mark.parametrize(('step_s', 'rate_hz', 'every'), [
    (1e-3, 50.0, 20), (1e-3, 1e4, 1), (2e-3, 300.0, 2), (0.05, 0.5, 40)])
def test_the_nearest_rate_that_the_steps_allow_is_taken(
        step_s: float, rate_hz: float, every: int) -> None:
    assert steps_between(rate_hz, step_s) == every


@pytest.mark.parametrize(('argument', 'said'), [
    ('joints:=[axis, axis, motor]', '3 different names'), ('publish_rate:=0.0', 'publish_rate'),
    ('joint:=[a]', 'did you mean joints?')])
def test_a_wrong_parameter_is_refused_in_one_line(argument: str, said: str) -> None:
    done = subprocess.run([sys.executable, '-m', 'antenna_drive.nodes.joint_states', '--ros-args',
                           '-p', argument], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == BAD_INPUT
    assert said in done.stderr and done.stderr.count('\n') == 1


@pytest.fixture(scope='module')
def live(module_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCommand]:
    """Return a page with a drive of its own."""
    with LiveCommand(tmp_path_factory.mktemp('live'), module_domain) as live:
        yield live
        assert live.end() == 0
        assert 'Traceback' not in live.said


@pytest.fixture(scope='module')
def watch(live: LiveCommand, module_domain: int) -> Iterator[Watch]:
    """Return a node beside the drive."""
    with Watch(domain_id=module_domain) as watch:
        yield watch


@pytest.mark.slow
def test_joints_are_the_readings_of_the_same_time(live: LiveCommand, watch: Watch,
                                                  module_domain: int) -> None:
    states: dict[str, list[Any]] = {'joint_states': [], 'motor_states': []}
    last: dict[str, Any] = {}
    for topic, kept in states.items():
        watch.node.create_subscription(JointState, topic, kept.append, 1000)
    watch.node.create_subscription(Clock, 'clock', lambda message: last.update(
        clock=message.clock), 100)
    for name in READINGS:
        watch.node.create_subscription(Float64, name, lambda message, name=name: last.update(
            {name: message.data}), 100)
    node = subprocess.Popen(
        [sys.executable, '-m', 'antenna_drive.nodes.joint_states', '--ros-args',
         '-p', 'publish_rate:=100.0', '-p', 'joints:=[elevation, m1, m2]'],
        env={**os.environ, 'ROS_DOMAIN_ID': str(module_domain)})
    axis, motors = states.values()

    def moves() -> bool:
        return len({state.position[0] for state in axis[-100:]}) > 50

    try:
        # a drive that has just begun is at rest, and on a busy machine that may last
        watch.until(lambda: len(axis) > 100 and len(last) == 7 and moves(), 'joints that move')
        paused = watch.call('test_signal/pause')
        assert paused.success
        # The other nodes may be a step ahead of the clock. Readings are those of every tenth step.
        if '9 of run' in paused.message:
            assert watch.call('test_signal/step').success
        (ratio,) = watch.get('plant', 'gear_ratio')

        def same() -> bool:
            encoder, rate, tach_1, tach_2, torque_1, torque_2 = (last[name] for name in READINGS)
            return all(state[-1].header.stamp == last['clock'] for state in (axis, motors)) and (
                list(axis[-1].position), list(axis[-1].velocity), list(axis[-1].effort),
                list(motors[-1].position), list(motors[-1].velocity), list(motors[-1].effort),
            ) == ([encoder], [rate], [ratio * (torque_1 + torque_2)],
                  [], [tach_1, tach_2], [torque_1, torque_2])

        watch.until(same, 'equal values while the drive is paused')
        assert (list(axis[-1].name), list(motors[-1].name)) == (['elevation'], ['m1', 'm2'])
        assert moves()
        stamps = [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in axis]
        # what the drive remembers of an earlier run may come first
        began = next((n for n in range(1, len(stamps)) if stamps[n] < stamps[n - 1]), 0)
        for run in (stamps[:began], stamps[began:]):
            assert run == sorted({*run})
        assert all(stamp % 10_000_000 == 0 for stamp in stamps), 'every tenth step'
        assert watch.call('test_signal/resume').success
        node.send_signal(signal.SIGINT)
        assert node.wait(PATIENCE_S) == 0
    finally:
        node.kill()
        node.wait()
