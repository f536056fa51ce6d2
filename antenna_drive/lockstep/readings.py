# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What people and plotters read: one topic per signal at a decimated rate, clock, changes."""

from collections.abc import Mapping
import struct
from typing import Any

from antenna_drive.emulator.unit import FloatArray, Signal
from antenna_drive.lockstep.changes import CHANGES, SETTINGS, write_record
from antenna_drive.lockstep.compiled_loop import TIME
from antenna_drive.lockstep.frame import READING_PREFIX
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rosgraph_msgs.msg import Clock
from simgap.inputs.schema import Value
from std_msgs.msg import Float64, String

READING_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
# Whoever reads may need another reliability or depth, over a radio link for example.
READING_OVERRIDES = QoSOverridingOptions.with_default_policies()

# A late subscriber still gets the changes of the run in progress.
CHANGES_QOS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE,
                         durability=DurabilityPolicy.TRANSIENT_LOCAL)

_FLOAT64 = struct.Struct('<4sd')
_CLOCK = struct.Struct('<4siI')


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
        name = node.get_name()
        self.rate_hz = rate_hz
        self._rows = [(row, 1.0, node.create_publisher(
            Float64, f'{name}/{signal.name}', READING_QOS,
            qos_overriding_options=READING_OVERRIDES)) for row, signal in enumerate(signals)]
        names = [signal.name for signal in signals]
        if amperes is not None and 'current' in names:
            self._rows.append((names.index('current'), amperes, node.create_publisher(
                Float64, f'{name}/armature_current', READING_QOS,
                qos_overriding_options=READING_OVERRIDES)))
        self._clock = node.create_publisher(
            Clock, 'clock', READING_QOS,
            qos_overriding_options=READING_OVERRIDES) if with_clock else None

    def routes(self) -> list[tuple[int, float, Any]]:
        """Return row, scale and publisher handle of each reading; TIME is the clock's row."""
        routes = [(row, scale, publisher.handle) for row, scale, publisher in self._rows]
        if self._clock is not None:
            routes.append((TIME, 1.0, self._clock.handle))
        return routes

    def every(self, step_s: float) -> int:
        """Return after how many steps of `step_s` [s] the next readings are published."""
        return max(1, round(1.0 / (self.rate_hz * step_s))) if self.rate_hz > 0.0 else 0

    def publish(self, step: int, step_s: float, outputs: FloatArray) -> None:
        """Publish the readings of a step."""
        values = outputs[:, 0].tolist()
        for row, scale, publisher in self._rows:
            publisher.publish(_FLOAT64.pack(READING_PREFIX, scale * values[row]))
        if self._clock is not None:
            seconds, nanoseconds = divmod(round(step * step_s * 1e9), 1_000_000_000)
            self._clock.publish(_CLOCK.pack(READING_PREFIX, seconds, nanoseconds))


class ChangeRecord:
    """
    Publish `<node>/changes`: what took effect at which step of which run.

    A change is in force from the step that it names to the next; `changes` has the format.
    """

    def __init__(self, node: Node) -> None:
        """Advertise the topic."""
        self._publisher = node.create_publisher(
            String, f'{node.get_name()}/changes', CHANGES_QOS)

    def begin(self, run: float, settings: Mapping[str, Value]) -> None:
        """Record what is in force as a run begins."""
        self._publish(run, 0, SETTINGS, settings)

    def add(self, run: float, step: int, changes: Mapping[str, Value]) -> None:
        """Record changes that take effect at `step`."""
        self._publish(run, step, CHANGES, changes)

    def _publish(self, run: float, step: int, key: str, values: Mapping[str, Value]) -> None:
        self._publisher.publish(String(data=write_record(run, step, key, values)))
