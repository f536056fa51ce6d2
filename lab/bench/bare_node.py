# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The bare exchange: the drive's frames on the drive's graph, without any processing.

Each process takes one frame of each peer without reading it, and publishes a constant frame of its
own. There is no physics, run, step number, pace, check, parameter or report. The process uses the
same low level of rclpy as the lock-step, with one wait set for its lifetime.

python -m lab.bench.bare_node UNIT FILE LAST KIND --ros-args ...

KIND is `python` for a loop in Python, `compiled` for that of `bare_loop`.
"""

import signal
import sys
from typing import Any

from antenna_drive.emulator.wiring import DRIVE, OUTPUTS, TEST_SIGNAL, UNITS
from antenna_drive.lockstep.frame import FrameLayout
from lab.bench.stamps import Stamps

_NEVER_NS = -1


def peers_of(unit: str) -> list[str]:
    """Return the units that a unit waits for at every step, as in the lock-step."""
    if unit == TEST_SIGNAL:
        return [name for name in UNITS if name != unit]
    peers = dict.fromkeys(source.partition('/')[0] for source in DRIVE.units[unit].sources)
    return [name for name in {**peers, TEST_SIGNAL: None} if name != unit]


def main() -> int:
    """Exchange frames up to step LAST, then wait for the end."""
    from antenna_drive.lockstep.rcl_channel import RclChannel
    from antenna_drive.lockstep.readings import Readings
    from antenna_drive.lockstep.ros_link import FrameLink
    from lab.bench import bare_loop
    import rclpy
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    unit, path, last, kind, *arguments = sys.argv[1:]
    rclpy.init(args=[unit, *arguments], signal_handler_options=SignalHandlerOptions.NO)
    node = Node(unit, enable_rosout=False, start_parameter_services=False)
    link = FrameLink(node, {peer: FrameLayout(OUTPUTS[peer]) for peer in peers_of(unit)})
    stamps = Stamps(path, int(last))
    message = FrameLayout(OUTPUTS[unit]).encode(1.0, 1, 1e-3, 1.0, bytes(16 * len(OUTPUTS[unit])))
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if kind == 'compiled':
        bare_loop.compile_ahead()
        channel = RclChannel(node, link, Readings(node, (), 0.0, False))
    stamps.note(0)
    link.publish(message)
    if kind == 'compiled':
        bare_loop.exchange(int(last), message, channel, stamps)
    else:
        _exchange(int(last), message, node, link, stamps)
    signal.pause()
    return 0


def _exchange(last: int, message: bytes, node: Any, link: Any, stamps: Stamps) -> None:
    from rclpy.impl.implementation_singleton import rclpy_implementation as implementation
    from std_msgs.msg import Float64MultiArray

    publisher, _, subscriptions = link.handles()
    publish, takes = publisher.publish_raw, list(subscriptions.values())
    wait_set = implementation.WaitSet(1, 0, 0, 0, 0, 0, node.context.handle)
    for step in range(1, last + 1):
        for handle in takes:
            while handle.take_message(Float64MultiArray, True) is None:
                wait_set.clear_entities()
                wait_set.add_subscription(handle)
                wait_set.wait(_NEVER_NS)
        stamps.note(step)
        publish(message)


if __name__ == '__main__':
    sys.exit(main())
