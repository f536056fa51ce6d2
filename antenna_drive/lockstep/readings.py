# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What people and plotters read and command: a topic per signal, clock, settings."""

from collections.abc import Callable
import struct
from typing import Any

from antenna_drive.emulator.unit import FloatArray, Signal
from antenna_drive.lockstep.compiled_loop import TIME
from antenna_drive.lockstep.frame import CDR_LITTLE_ENDIAN
from antenna_drive.lockstep.ros_link import remembered
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rosgraph_msgs.msg import Clock
from simgap.inputs.schema import Value
from std_msgs.msg import Float64

READING_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
# Whoever reads may need another reliability or depth, over a radio link for example.
READING_OVERRIDES = QoSOverridingOptions.with_default_policies()

# A late subscriber still gets the changes of the run in progress.
CHANGES_QOS = remembered(1000)

_FLOAT64 = struct.Struct('<4sd')
_CLOCK = struct.Struct('<4siI')


def steps_between(rate_hz: float, step_s: float) -> int:
    """Return after how many steps of `step_s` [s] something is due at a rate, at least one."""
    return max(1, round(1.0 / (rate_hz * step_s)))


class Readings:
    """Publish `<node>/<signal>` every few steps, and `clock` if the node owns the time."""

    def __init__(self, node: Node, signals: tuple[Signal, ...], rate_hz: float,
                 with_clock: bool, amperes: float | None = None) -> None:
        """
        Advertise the topics.

        node, signals : the node and what its unit puts out
        rate_hz : messages per simulated second and topic; 0 for none
        with_clock : whether to publish `clock`
        amperes : real amperes per article ampere, to publish `<node>/armature_current` [real A]
            beside `<node>/current`; None for not
        """
        def advertise(kind: Any, topic: str) -> Any:
            return node.create_publisher(kind, topic, READING_QOS,
                                         qos_overriding_options=READING_OVERRIDES)

        self.rate_hz = rate_hz
        rows = [(row, 1.0, signal.name) for row, signal in enumerate(signals)]
        if amperes is not None:
            rows += [(row, amperes, 'armature_current') for row, _, name in rows
                     if name == 'current']
        self._rows = [(row, scale, advertise(Float64, f'{node.get_name()}/{name}'))
                      for row, scale, name in rows]
        self._clock = advertise(Clock, 'clock') if with_clock else None

    def routes(self) -> list[tuple[int, float, Any]]:
        """Return row, scale and publisher handle of each reading; TIME is the clock's row."""
        routes = [(row, scale, publisher.handle) for row, scale, publisher in self._rows]
        if self._clock is not None:
            routes.append((TIME, 1.0, self._clock.handle))
        return routes

    def every(self, step_s: float) -> int:
        """Return after how many steps of `step_s` [s] the next readings are published."""
        return steps_between(self.rate_hz, step_s) if self.rate_hz > 0.0 else 0

    def publish(self, step: int, step_s: float, outputs: FloatArray) -> None:
        """Publish the readings of a step."""
        values = outputs[:, 0].tolist()
        for row, scale, publisher in self._rows:
            publisher.publish(_FLOAT64.pack(CDR_LITTLE_ENDIAN, scale * values[row]))
        if self._clock is not None:
            seconds, nanoseconds = divmod(round(step * step_s * 1e9), 1_000_000_000)
            self._clock.publish(_CLOCK.pack(CDR_LITTLE_ENDIAN, seconds, nanoseconds))


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
