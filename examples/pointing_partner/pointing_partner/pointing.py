# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A pointing loop with a clock of its own: it holds the antenna at an angle, in plain rclpy.

It knows nothing of the lock-step. It keeps the newest message of the drive, and answers it at its
own rate with a rate command. A slow or missing answer is the drive's concern: see the parameters
partner.deadline and partner.on_miss of the node in whose place this program works.
"""

from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray


class Pointing(Node):  # type: ignore[misc]
    """Answers the encoder's angle [rad] with [rate command [rad/s], external torque [N m]]."""

    def __init__(self) -> None:
        """Follow the stand-in whose name is the parameter `drive`."""
        super().__init__('pointing')
        self._angle: Any = self.declare_parameter('angle', 2e-4)  # to be held [rad]
        self._gain: Any = self.declare_parameter('gain', 2.0)  # rate for each rad of error [1/s]
        self._limit: Any = self.declare_parameter('limit', 1e-3)  # of the rate [rad/s]
        drive: Any = self.declare_parameter('drive', 'test_signal').value
        rate_hz: Any = self.declare_parameter('rate', 100.0).value
        self._newest: Float64MultiArray | None = None
        self._answer = self.create_publisher(Float64MultiArray, f'{drive}/answer', 10)
        self.create_subscription(
            Float64MultiArray, f'{drive}/partner_inputs', self._keep, 10)
        self.create_timer(1.0 / rate_hz, self._act)

    def _keep(self, message: Float64MultiArray) -> None:
        self._newest = message

    def _act(self) -> None:
        if self._newest is None:
            return
        run, step, _, angle = self._newest.data
        limit = self._limit.value
        rate = self._gain.value * (self._angle.value - angle)
        rate = max(-limit, min(limit, rate))
        self._answer.publish(Float64MultiArray(data=[run, step, rate, 0.0]))


def main() -> None:
    """Run the node until it is told to end."""
    rclpy.init()
    try:
        rclpy.spin(Pointing())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == '__main__':
    main()
