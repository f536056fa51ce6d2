# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""An observer that lacks a frame of a node that is gone still finds the next run."""

from __future__ import annotations

from collections.abc import Iterator
import time

from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
import pytest

pytest.importorskip('rclpy', reason='there is no ROS 2 here')

from antenna_drive.lockstep.frame import FrameLayout  # noqa: E402, I100
from antenna_drive.lockstep.leaving import leave  # noqa: E402
from antenna_drive.lockstep.observer import Observer  # noqa: E402
from antenna_drive.lockstep.ros_link import FRAME_QOS  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.node import Node  # noqa: E402
from std_msgs.msg import Float64MultiArray  # noqa: E402

PATIENCE_S = 30.0
STEPS = 50


class Speaker:
    """Publishes frames in the name of every unit of a drive."""

    def __init__(self) -> None:
        context = Context()
        context.init(args=[])
        self._node = Node('speaker', context=context)
        self._publishers = {unit: self._node.create_publisher(
            Float64MultiArray, f'{unit}/frame', FRAME_QOS) for unit in OUTPUTS}
        self.run = float(time.time_ns() // 1000) + 1e6  # younger than the observer

    def say(self, unit: str, run: float, steps: range) -> None:
        layout = FrameLayout(OUTPUTS[unit])
        for step in steps:
            self._publishers[unit].publish(
                layout.encode(run, step, 1e-3, 7.0, bytes(layout.packed_size)))

    def close(self) -> None:
        leave(self._node)


@pytest.fixture
def speaker(node_domain: int) -> Iterator[Speaker]:
    """Return somebody who speaks for all units."""
    speaker = Speaker()
    yield speaker
    speaker.close()


def test_the_next_run_is_found_behind_the_frames_of_the_last(speaker: Speaker) -> None:
    first, second = speaker.run, speaker.run + 1e6
    for unit in OUTPUTS:
        if unit != 'plant':  # it was killed before its frames were delivered here
            speaker.say(unit, first, range(STEPS))
    for unit in OUTPUTS:
        speaker.say(unit, second, range(1 if unit == TEST_SIGNAL else 2))
    seen: list[int] = []
    runs: list[int] = []
    with Observer('watcher', lambda step, at, samples: seen.append(step),
                  on_begin=lambda run, step_s: runs.append(run)) as observer:
        deadline = time.monotonic() + PATIENCE_S
        observer.spin(lambda: bool(seen) or time.monotonic() > deadline)
    assert runs == [second], 'of the first not every unit has sent a step'
    assert seen == [0]


def test_frames_that_come_late_lose_no_step(speaker: Speaker) -> None:
    for unit in OUTPUTS:
        if unit != 'plant':
            speaker.say(unit, speaker.run, range(STEPS))
    seen: list[int] = []
    with Observer('watcher', lambda step, at, samples: seen.append(step)) as observer:
        began = time.monotonic()
        observer.spin(lambda: time.monotonic() > began + 1.0)  # it stands still and looks ahead
        assert not seen
        speaker.say('plant', speaker.run, range(STEPS))
        observer.spin(lambda: len(seen) == STEPS or time.monotonic() > began + PATIENCE_S)
    assert seen == list(range(STEPS))


def test_an_invented_run_behind_them_is_not_followed(speaker: Speaker) -> None:
    for unit in OUTPUTS:
        if unit != 'plant':
            speaker.say(unit, speaker.run, range(STEPS))
    speaker.say(TEST_SIGNAL, speaker.run + 5e6, range(1))
    for unit in OUTPUTS:
        if unit != 'plant':
            speaker.say(unit, speaker.run, range(STEPS, STEPS + 1))
    seen: list[int] = []
    began = time.monotonic()
    with Observer('watcher', lambda step, at, samples: seen.append(step)) as observer:
        observer.spin(lambda: time.monotonic() > began + 1.0)
        speaker.say('plant', speaker.run, range(STEPS + 1))
        observer.spin(lambda: len(seen) > STEPS or time.monotonic() > began + PATIENCE_S)
    assert seen == list(range(STEPS + 1))
