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
The bare exchange: the drive's frames on the drive's graph, without any processing.

Each process takes one frame of each peer without reading it, and publishes a constant frame of its
own. There is no physics, run, step number, check, parameter or report. The process uses the same
low level of rclpy as the lock-step, with one wait set for its lifetime.

python -m antenna_drive.bench.bare_node UNIT FILE LAST STEP_S PACE --ros-args ...
"""

from __future__ import annotations

from collections.abc import Callable
import signal
import sys
import time
from typing import Any

from antenna_drive.bench.stamps import Stamps
from antenna_drive.emulator.wiring import INPUTS, OUTPUTS, TEST_SIGNAL, UNITS
from antenna_drive.lockstep.frame import FrameLayout

_NEVER_NS = -1


def peers_of(unit: str) -> list[str]:
    """Return the units that a unit waits for at every step, as in the lock-step."""
    if unit == TEST_SIGNAL:
        return [name for name in UNITS if name != unit]
    peers = dict.fromkeys(source.partition('/')[0] for source in INPUTS[unit])
    return [name for name in {**peers, TEST_SIGNAL: None} if name != unit]


def main() -> int:
    """Exchange frames up to step LAST, then wait for the end."""
    import rclpy
    from rclpy.impl.implementation_singleton import rclpy_implementation as implementation
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    unit, path, last, step_s, pace, *arguments = sys.argv[1:]
    rclpy.init(args=[unit, *arguments], signal_handler_options=SignalHandlerOptions.NO)
    node = Node(unit, enable_rosout=False, start_parameter_services=False)
    publish, takes = _topics(node, unit)
    context = node.context.handle
    assert context is not None
    wait_set = implementation.WaitSet(1, 0, 0, 0, 0, 0, context)
    stamps = Stamps(path, int(last))
    frame = FrameLayout(OUTPUTS[unit])
    message = frame.encode(1.0, 1, 1e-3, bytes(16 * len(OUTPUTS[unit])))
    period = float(step_s) / float(pace) if float(pace) > 0.0 and unit == TEST_SIGNAL else 0.0
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    stamps.note(0)
    publish(message)
    _exchange(int(last), message, publish, takes, wait_set, stamps, period)
    signal.pause()
    return 0


def _topics(node: Any, unit: str) -> tuple[Callable[[bytes], None], list[Any]]:
    from antenna_drive.lockstep.ros_link import FRAME_QOS
    from std_msgs.msg import Float64MultiArray

    publisher = node.create_publisher(Float64MultiArray, f'{unit}/frame', FRAME_QOS)
    subscriptions = [node.create_subscription(
        Float64MultiArray, f'{peer}/frame', lambda message: None, FRAME_QOS, raw=True)
        for peer in peers_of(unit)]
    return publisher.handle.publish_raw, [item.handle for item in subscriptions]


def _exchange(last: int, message: bytes, publish: Callable[[bytes], None], takes: list[Any],
              wait_set: Any, stamps: Stamps, period: float) -> None:
    from std_msgs.msg import Float64MultiArray

    for step in range(1, last + 1):
        for handle in takes:
            while handle.take_message(Float64MultiArray, True) is None:
                wait_set.clear_entities()
                wait_set.add_subscription(handle)
                wait_set.wait(_NEVER_NS)
        if period:
            if step == 1:
                stamps.due_s = time.monotonic()
            while (rest := stamps.due_s + step * period - time.monotonic()) > 0.0:
                time.sleep(rest)
        stamps.note(step)
        publish(message)


if __name__ == '__main__':
    sys.exit(main())
