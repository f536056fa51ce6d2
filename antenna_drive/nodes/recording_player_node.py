# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The player of recordings on ROS 2: signals and rows out, at a pace."""

from collections.abc import Sequence
from threading import Event
import time

from antenna_drive.lockstep.entry import ros_node, stopped_by_signals
from antenna_drive.lockstep.ros_parameters import Overrides
from antenna_drive.lockstep.starting import say_ready
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.files import read_recording
from antenna_drive.recording.recording import Recording
from antenna_drive.twin.intake import known
import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from simgap.inputs.schema import Entry
from simgap.logs.channel import NANOSECONDS
from std_msgs.msg import Float64, Float64MultiArray

NAME = 'recording_player'
_QOS = QoSProfile(depth=1000)
_LOOK_S = 0.05
# Publisher and subscription find each other one after the other. A publisher that has found its
# reader waits for so long, or the reader may miss the first rows, in which the drive stands still.
_MATCHED_S = 1.0
_PACE = Entry('1', 1e-3, 1e3, 'pace as a multiple of real time')


def run(path: str, arguments: Sequence[str]) -> int:
    """
    Play a recording once, or until SIGINT or SIGTERM.

    path : of the recording
    arguments : those of ROS 2

    Returns 0. Raises UserError: the recording cannot be read, or an argument is wrong.
    """
    recording = read_recording(path)
    stop = stopped_by_signals()
    with ros_node(NAME, arguments, 'pace:=1.0') as node:
        overrides = Overrides(node)
        pace = overrides.number('pace', _PACE, 1.0)
        real = overrides.text('real', 'real')
        overrides.check_all_known(('pace', 'real'))
        _play(node, recording, real, pace, stop)
    return 0


def _play(node: Node, recording: Recording, real: str, pace: float, stop: Event) -> None:
    names = [name for name in recording.channels if known(name)]
    names.sort(key=lambda name: name != RATE_COMMAND)
    single = [node.create_publisher(Float64, f'{real}/{name}', _QOS) for name in names]
    rows = node.create_publisher(Float64MultiArray, f'{real}/row', _QOS)
    say_ready(node, f'a reader of {real}/row: time, {", ".join(names)}')
    while not any(item.get_subscription_count() for item in (rows, *single)):
        if stop.wait(_LOOK_S):
            return
    if stop.wait(_MATCHED_S):
        return
    stamps = recording[names[0]].time_ns
    spans = [recording[name].time_ns for name in names]
    stamps = stamps[(stamps >= max(span[0] for span in spans))
                    & (stamps <= min(span[-1] for span in spans))]
    table = np.column_stack([recording[name].at(stamps) for name in names])
    began = time.monotonic()
    for stamp, row in zip(((stamps - stamps[0]) / NANOSECONDS).tolist(), table.tolist(),
                          strict=True):
        ahead = began + stamp / pace - time.monotonic()
        if stop.wait(max(ahead, 0.0)) if ahead > 1e-3 else stop.is_set():
            return
        rows.publish(Float64MultiArray(data=[stamp, *row]))
        for publisher, value in zip(single, row, strict=True):
            publisher.publish(Float64(data=value))
    rows.wait_for_all_acked(Duration(seconds=2.0))
