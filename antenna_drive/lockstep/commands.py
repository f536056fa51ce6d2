# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A setting that follows a topic, within limits."""

from collections.abc import Callable

from antenna_drive.lockstep.readings import READING_OVERRIDES, READING_QOS
from rclpy.node import Node
from simgap.inputs.schema import Value
from std_msgs.msg import Float64


class Commanded:
    """
    Lets a live setting of a unit follow the Float64 topic `<node>/<setting>`.

    A value that is refused leaves the one of before in force. The first of several is said in the
    log.

    refused : how many values have been refused
    """

    def __init__(self, node: Node, setting: str, limit: float,
                 change: Callable[[dict[str, Value]], str]) -> None:
        """
        Follow the topic.

        node, setting : the node of the unit, and the name of the setting
        limit : the greatest magnitude that is taken
        change : asks for changes; returns why they are refused, or ''
        """
        self.refused = 0
        self._setting, self._limit = setting, limit
        self._change = change
        self._log = node.get_logger()
        self._told = False
        node.create_subscription(Float64, f'{node.get_name()}/{setting}', self._follow,
                                 READING_QOS, qos_overriding_options=READING_OVERRIDES)

    def _follow(self, message: Float64) -> None:
        value = message.data
        if abs(value) > self._limit:
            reason = (f'{self._setting}: {value:g} given, allowed is {-self._limit:.4g} to '
                      f'{self._limit:.4g}, or more with -p run.{self._setting}_limit:=...')
        else:
            reason = self._change({self._setting: value})
        if reason:
            self.refused += 1
            if not self._told:
                self._log.warning(f'{reason}. The value of before stays in force')
        self._told = bool(reason)
