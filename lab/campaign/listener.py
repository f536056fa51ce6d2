# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Listen for a drive for some seconds, and say as JSON which nodes and how many frames were seen.

  python -m lab.campaign.listener SECONDS

Unlike our own programs it sets nothing: who is seen is for the environment to decide.
"""

import json
import sys
import time

from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep.frame import FrameLayout
from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.ros_link import FrameLink
import rclpy
from rclpy.node import Node


def main(arguments: list[str]) -> int:
    """Listen."""
    rclpy.init()
    node = Node('listener')
    link = FrameLink(node, {TEST_SIGNAL: FrameLayout(OUTPUTS[TEST_SIGNAL])})
    frames, nodes = 0, set()
    deadline = time.monotonic() + float(arguments[0])
    while time.monotonic() < deadline:
        link.wait([TEST_SIGNAL], 0.2)
        while link.take(TEST_SIGNAL) is not None:
            frames += 1
        nodes.update(node.get_node_names())
    print(json.dumps({'nodes': sorted(nodes), 'frames': frames}))
    leave(node)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
