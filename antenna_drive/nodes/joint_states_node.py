# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The joints on ROS 2: frames of plant and motors in, sensor_msgs/JointState out."""

from collections.abc import Sequence
from threading import Event
import time
from typing import Any

from antenna_drive.emulator.wiring import MOTORS, OUTPUTS, PLANT
from antenna_drive.lockstep.changes import read_record, SETTINGS
from antenna_drive.lockstep.entry import ros_node, stopped_by_signals
from antenna_drive.lockstep.following import Thinned, Thinning
from antenna_drive.lockstep.frame import FrameLayout
from antenna_drive.lockstep.readings import CHANGES_QOS, READING_OVERRIDES, READING_QOS
from antenna_drive.lockstep.ros_link import FrameLink
from antenna_drive.lockstep.ros_parameters import Overrides
from antenna_drive.lockstep.serving import Serving
from antenna_drive.lockstep.starting import Absence
from builtin_interfaces.msg import Time
from rclpy.node import Node
from sensor_msgs.msg import JointState
from simgap.errors import UserError
from simgap.inputs.schema import Entry
from std_msgs.msg import String

NAME = 'joint_states'
OK = 0
JOINTS = ('axis', *MOTORS)
_RATE = Entry('Hz', 0.01, 1e4, 'messages for each simulated second and topic')
# Frames are taken in bulk this often [s]: to be woken for each would cost more.
_PERIOD_S = 0.01
_PLACES = {unit: {item.name: place for place, item in enumerate(signals)}
           for unit, signals in OUTPUTS.items()}


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
    units = (PLANT, *MOTORS)
    link = FrameLink(node, {unit: FrameLayout(OUTPUTS[unit]) for unit in units})
    thinning = Thinning(units, rate_hz)
    axis_publisher, motors_publisher = (
        node.create_publisher(JointState, topic, READING_QOS,
                              qos_overriding_options=READING_OVERRIDES)
        for topic in ('joint_states', 'motor_states'))
    known: dict[str, float] = {}

    def listen(message: String) -> None:
        record = read_record(message.data)
        ratio: Any = (record or {}).get(SETTINGS, {}).get('gear_ratio')
        if isinstance(ratio, float):
            known['gear_ratio'] = ratio

    node.create_subscription(String, f'{PLANT}/changes', listen, CHANGES_QOS)
    serving = Serving(node)
    absence = Absence(node, link.publishers)
    try:
        while not stop.wait(_PERIOD_S):
            absence.look(time.monotonic())
            for unit in units:
                frames = link.take_all(unit)
                if frames is not None:
                    thinning.take(unit, frames)
            for step in thinning.complete():
                axis_publisher.publish(axis_state(step, joints[0], known.get('gear_ratio')))
                motors_publisher.publish(motor_states(step, joints[1:]))
    finally:
        serving.close()


def axis_state(step: Thinned, name: str, gear_ratio: float | None) -> JointState:
    """
    Return the axis as a joint.

    step : with the frames of plant and motors
    name : of the joint
    gear_ratio : motor turns for each turn of the axis; the effort is left out if it is None,
        because the plant has not told it yet
    """
    torque = sum(_value(step, motor, 'gear_torque') for motor in MOTORS)
    return _state(step, [name], position=[_value(step, PLANT, 'encoder')],
                  velocity=[_value(step, PLANT, 'axis_rate')],
                  effort=[] if gear_ratio is None else [gear_ratio * torque])


def motor_states(step: Thinned, names: Sequence[str]) -> JointState:
    """Return the motors as joints of these names; there is no signal for their position."""
    return _state(step, list(names),
                  velocity=[_value(step, motor, 'tach_rate') for motor in MOTORS],
                  effort=[_value(step, motor, 'gear_torque') for motor in MOTORS])


def _value(step: Thinned, unit: str, name: str) -> float:
    return float(step.values[unit][_PLACES[unit][name]])


def _state(step: Thinned, names: list[str], **fields: list[float]) -> JointState:
    state = JointState(name=names, **fields)
    seconds, nanoseconds = divmod(step.time_ns, 1_000_000_000)
    state.header.stamp = Time(sec=seconds, nanosec=nanoseconds)
    return state
