# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A message on /diagnostics."""

from collections.abc import Iterable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node


def diagnostics(node: Node, level: bytes, message: str,
                values: Iterable[tuple[str, str]]) -> DiagnosticArray:
    """Return what a node says of itself: how bad it is, in words, and in named values."""
    status = DiagnosticStatus(level=level, name=node.get_fully_qualified_name(), message=message,
                              hardware_id='antenna_drive')
    status.values = [KeyValue(key=key, value=value) for key, value in values]
    array = DiagnosticArray(status=[status])
    array.header.stamp = node.get_clock().now().to_msg()
    return array
