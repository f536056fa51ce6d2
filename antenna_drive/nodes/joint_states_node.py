# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The joints on ROS 2: frames of the drive in, sensor_msgs/JointState out."""

from collections.abc import Mapping, Sequence
from threading import Event
import time
from typing import Any

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.wiring import MOTORS, PLANT
from antenna_drive.lockstep.changes import SETTINGS
from antenna_drive.lockstep.entry import ros_node, stopped_by_signals
from antenna_drive.lockstep.observer import Observer
from antenna_drive.lockstep.readings import READING_OVERRIDES, READING_QOS, steps_between
from antenna_drive.lockstep.ros_parameters import Overrides
from antenna_drive.lockstep.starting import Absence
from builtin_interfaces.msg import Time
from rclpy.node import Node
from sensor_msgs.msg import JointState
from simgap.errors import UserError
from simgap.inputs.schema import Entry

NAME = 'joint_states'
OK = 0
JOINTS = ('axis', *MOTORS)
_RATE = Entry('Hz', 0.01, 1e4, 'messages for each simulated second and topic')


def run(arguments: Sequence[str]) -> int:
    """Publish until SIGINT or SIGTERM; return 0. Raises UserError: wrong arguments."""
    stop = stopped_by_signals()
    with ros_node(NAME, arguments, 'publish_rate:=50.0') as node:
        overrides = Overrides(node)
        rate_hz = overrides.number('publish_rate', _RATE, 50.0)
        joints = overrides.names('joints', JOINTS)
        overrides.check_all_known(('publish_rate', 'joints'))
        if len(set(joints)) != len(JOINTS):
            raise UserError(f'joints: {joints!r} given, allowed are {len(JOINTS)} different '
                            f'names, as {list(JOINTS)!r}')
        _publish(node, rate_hz, joints, stop)
    return OK


def _publish(node: Node, rate_hz: float, joints: Sequence[str], stop: Event) -> None:
    axis_publisher, motors_publisher = (
        node.create_publisher(JointState, topic, READING_QOS,
                              qos_overriding_options=READING_OVERRIDES)
        for topic in ('joint_states', 'motor_states'))
    known: dict[str, Any] = {'every': 1, 'gear_ratio': None}

    def begin(run: int, step_s: float) -> None:
        known['every'] = steps_between(rate_hz, step_s)

    def listen(unit: str, record: Mapping[str, Any]) -> None:
        ratio = record.get(SETTINGS, {}).get('gear_ratio')
        if unit == PLANT and isinstance(ratio, float):
            known['gear_ratio'] = ratio

    def publish(number: int, time_s: float, samples: FloatArray) -> None:
        if number % known['every'] == 0:
            values = dict(zip(observer.names, samples[:, 0].tolist(), strict=True))
            axis_publisher.publish(axis_state(time_s, values, joints[0], known['gear_ratio']))
            motors_publisher.publish(motor_states(time_s, values, joints[1:]))

    def ends() -> bool:
        if observer.idle:
            absence.look(time.monotonic())
        return stop.is_set()

    with Observer(node, publish, on_begin=begin, on_change=listen) as observer:
        absence = Absence(node, observer.publishers)
        observer.spin(ends)


def axis_state(time_s: float, values: Mapping[str, float], name: str,
               gear_ratio: float | None) -> JointState:
    """
    Return the axis as a joint.

    time_s : simulated time [s]
    values : of the signals of plant and motors, by 'unit/signal'
    name : of the joint
    gear_ratio : motor turns for each turn of the axis; the effort is left out if it is None,
        because the plant has not told it yet
    """
    torque = sum(values[f'{motor}/gear_torque'] for motor in MOTORS)
    return _state(time_s, [name], position=[values[f'{PLANT}/encoder']],
                  velocity=[values[f'{PLANT}/axis_rate']],
                  effort=[] if gear_ratio is None else [gear_ratio * torque])


def motor_states(time_s: float, values: Mapping[str, float], names: Sequence[str]) -> JointState:
    """Return the motors as joints of these names; there is no signal for their position."""
    return _state(time_s, list(names),
                  velocity=[values[f'{motor}/tach_rate'] for motor in MOTORS],
                  effort=[values[f'{motor}/gear_torque'] for motor in MOTORS])


def _state(time_s: float, names: list[str], **fields: list[float]) -> JointState:
    state = JointState(name=names, **fields)
    seconds, nanoseconds = divmod(round(1e9 * time_s), 1_000_000_000)
    state.header.stamp = Time(sec=seconds, nanosec=nanoseconds)
    return state
