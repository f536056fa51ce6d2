# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Speak in the name of a drive's nodes.

  python -m lab.campaign.impostor garbage SEED COUNT [--ros-args ...]
  python -m lab.campaign.impostor echo [--ros-args ...]

garbage publishes COUNT frames at 1 kHz: invented ones, and ones that are right but for one field.
echo is a second publisher on every topic of the drive: it repeats each frame once, and publishes
on all other topics. A frame of the right run and step cannot be told from a genuine one, so no
garbage is of a step that somebody may still wait for.
"""

from collections.abc import Callable
import random
import signal
import struct
import sys
import time
from typing import Any

from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL, UNITS
from antenna_drive.lockstep.frame import FrameLayout, SENDER
from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.readings import CHANGES_QOS
from antenna_drive.lockstep.ros_link import FRAME_QOS, FrameLink
from antenna_drive.programs import end_with_starter
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64, Float64MultiArray, String

PERIOD_S = 1e-3
# No member is further from the conductor's step than this.
APART = 2000
CHANGES = ['{"run": null}', '{"run": 5, "step": 0, "changes": {"a": 1}}', '[' * 10_000, '\x00', '']


class Garbage:
    """Makes garbage of the run in progress."""

    def __init__(self, rng: random.Random) -> None:
        """Draw from a generator of random numbers."""
        self._rng = rng
        self._layouts = {unit: FrameLayout(signals) for unit, signals in OUTPUTS.items()}
        self.run, self.step = 0.0, 0
        self.senders = dict.fromkeys(UNITS, 1.0)
        self._sender = 1.0
        self._kinds: list[Callable[[FrameLayout], bytes]] = [
            self._bytes, self._numbers, self._other_run, self._past, self._ahead, self._broken,
            self._not_finite, self._other_length, self._hello, self._announcement]

    def one(self) -> tuple[str, bytes]:
        """Return a unit in whose name to speak, and a message."""
        unit = self._rng.choice(UNITS)
        self._sender = self.senders[unit]
        return unit, self._rng.choice(self._kinds)(self._layouts[unit])

    def _frame(self, layout: FrameLayout, run: float, step: float, values: Any = None) -> bytes:
        if values is None:
            values = [self._rng.gauss(0.0, 1.0) for _ in range(2 * len(layout.signals))]
        return layout.prefix + struct.pack(f'<{4 + len(values)}d', run, step, 1e-3,
                                           self._sender, *values)

    def _bytes(self, layout: FrameLayout) -> bytes:
        # the four bytes of the encapsulation are rcl's own: without them it logs each message
        return b'\x00\x01\x00\x00' + self._rng.randbytes(self._rng.randrange(400))

    def _numbers(self, layout: FrameLayout) -> bytes:
        return layout.prefix + self._rng.randbytes(8 * layout.length)

    def _other_run(self, layout: FrameLayout) -> bytes:
        return self._frame(layout, self.run + self._rng.choice([-1, 1, 1e6, -1e6]), self.step)

    def _past(self, layout: FrameLayout) -> bytes:
        return self._frame(layout, self.run, max(0, self.step - APART - self._rng.randrange(APART))
                           if self.step > APART else -1.0)

    def _ahead(self, layout: FrameLayout) -> bytes:
        return self._frame(layout, self.run, self.step + 10 * APART + self._rng.randrange(10**9))

    def _broken(self, layout: FrameLayout) -> bytes:
        part = self._rng.choice([0.5, 1e-6])
        return self._rng.choice([self._frame(layout, self.run + 0.5, self.step),
                                 self._frame(layout, self.run, self.step + part),
                                 self._frame(layout, self.run, -self.step - 1.0)])

    def _not_finite(self, layout: FrameLayout) -> bytes:
        values = [0.1] * (2 * len(layout.signals))
        values[self._rng.randrange(len(values))] = self._rng.choice(
            [float('nan'), float('inf'), float('-inf')])
        return self._frame(layout, self.run, self.step + self._rng.randrange(4), values)

    def _other_length(self, layout: FrameLayout) -> bytes:
        size = 2 * len(layout.signals) + self._rng.choice([-2, -1, 1, 2, 1000])
        message = Float64MultiArray(data=[self.run, float(self.step), 1e-3, self._sender,
                                          *[0.1] * max(0, size)])
        from rclpy.serialization import serialize_message
        return bytes(serialize_message(message))

    def _hello(self, layout: FrameLayout) -> bytes:
        return self._frame(layout, 0.0, self._rng.choice([0.0, 1.0, 1e15, 2.0**51, 2.0**60]))

    def _announcement(self, layout: FrameLayout) -> bytes:
        return self._frame(layout, self.run + self._rng.choice([1.0, 7.0, 2.0**40]), 0.0)


def garbage(node: Node, seed: int, count: int) -> None:
    """Publish `count` messages at 1 kHz, or as fast as it can."""
    rng = random.Random(seed)
    made = Garbage(rng)
    link = FrameLink(node, {unit: FrameLayout(signals) for unit, signals in OUTPUTS.items()})
    publishers = {unit: node.create_publisher(Float64MultiArray, f'{unit}/frame', FRAME_QOS)
                  for unit in UNITS}
    changes = {unit: node.create_publisher(String, f'{unit}/changes', CHANGES_QOS)
               for unit in UNITS}
    command = node.create_publisher(Float64, 'test_signal/external', 10)
    while not all(item.get_subscription_count() >= 2 for item in publishers.values()):
        time.sleep(0.05)
    while not made.run:
        _follow(link, made)
        time.sleep(0.05)
    print('started', flush=True)
    began = time.monotonic()
    for number in range(count):
        if number % 10 == 0:
            _follow(link, made)
            time.sleep(max(0.0, began + number * PERIOD_S - time.monotonic()))
        unit, message = made.one()
        publishers[unit].publish(message)
        if number % 50 == 0:
            changes[unit].publish(String(data=rng.choice(CHANGES)))
            command.publish(Float64(data=float('nan')))
    print(f'done {time.monotonic() - began:.3f}', flush=True)


def _follow(link: FrameLink, made: Garbage) -> None:
    for unit in UNITS[1:]:
        while (frame := link.take(unit)) is not None:
            if len(frame) > SENDER and made.senders[unit] == 1.0:  # a genuine one comes first
                made.senders[unit] = frame[SENDER]
    while (frame := link.take(TEST_SIGNAL)) is not None:
        # our own messages come back too: only a run that goes on is followed
        if len(frame) > 2 and frame[1] in (made.step + 1.0, made.step + 2.0) and (
                frame[0] == made.run) or not made.run and len(frame) > 2 and frame[0] > 1e12:
            made.run, made.step = frame[0], int(frame[1])
            made.senders[TEST_SIGNAL] = frame[SENDER]


def echo(node: Node) -> None:
    """Repeat every frame once, and publish on every other topic, until SIGTERM."""
    layouts = {unit: FrameLayout(signals) for unit, signals in OUTPUTS.items()}
    link = FrameLink(node, layouts)
    publishers = {unit: node.create_publisher(Float64MultiArray, f'{unit}/frame', FRAME_QOS)
                  for unit in UNITS}
    others = [node.create_publisher(Float64, f'{unit}/{signal.name}', 10)
              for unit, signals in OUTPUTS.items() for signal in signals]
    changes = [node.create_publisher(String, f'{unit}/changes', CHANGES_QOS) for unit in UNITS]
    sent: dict[str, tuple[float, float]] = {}
    said = False
    while True:
        for unit in link.wait(UNITS, 0.1):
            while (frame := link.take(unit)) is not None:
                if len(frame) == layouts[unit].length and frame[:2] > sent.get(unit, (0.0, 0.0)):
                    sent[unit] = (frame[0], frame[1])
                    publishers[unit].publish(layouts[unit].prefix + struct.pack(
                        f'<{len(frame)}d', *frame))
        for item in others:
            item.publish(Float64(data=1e300))
        for item in changes:
            item.publish(String(data='{"run": "second"}'))
        if sent and not said:
            said = True
            print('started', flush=True)


def main(arguments: list[str]) -> int:
    """Speak until done, or until SIGTERM."""
    end_with_starter()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(0))
    cut = arguments.index('--ros-args')
    rclpy.init(args=['impostor', *arguments[cut:]])
    node = Node('impostor')
    try:
        if arguments[0] == 'echo':
            echo(node)
        else:
            garbage(node, int(arguments[1]), int(arguments[2]))
    finally:
        leave(node)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
