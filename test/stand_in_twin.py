# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A node that reports as a twin does, for tests of those who listen to one."""

from __future__ import annotations

import json
from typing import Any

from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.serving import Serving
from antenna_drive.lockstep.starting import diagnostics
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Empty, String
from std_srvs.srv import Trigger

VERDICT: dict[str, Any] = {
    'decided': False, 'say': 'go on, and make another test: motor_1.gap, 70 % after 45 s',
    'fault': '', 'looks': [
        {'seconds': 15.0, 'probabilities': {'none': 0.5, 'motor_1.gap': 0.3, 'unknown': 0.2}},
        {'seconds': 45.0, 'probabilities': {'motor_1.gap': 0.7, 'motor_2.gap': 0.25,
                                            'unknown': 0.05}}]}
NEXT_TEST: dict[str, Any] = {
    'under_way': False, 'after_s': 45.0, 'fault': '', 'say': ['next test: triangle'],
    'test': {'circuit': 'new', 'waveform': {
        'type': 'triangle', 'amplitude_deg_s': 0.04, 'period_s': 3.0}},
    'sheet': 'circuit: new'}


class StandInTwin:
    """Reports a gap when it is told to, and answers what a twin is asked."""

    def __init__(self, domain_id: int, name: str = 'watcher') -> None:
        context = Context()
        context.init(args=[], domain_id=domain_id)
        self.node = Node(name, namespace='/beside', context=context)
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._diagnostics = self.node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.verdict = self.node.create_publisher(String, f'{name}/verdict', kept)
        self.next_test = self.node.create_publisher(String, f'{name}/next_test', kept)
        self.begun = 0
        self.node.create_subscription(Empty, f'{name}/begin_test', self._begin, 1)
        self.node.create_service(Trigger, f'{name}/propose', self._propose)
        self.node.create_timer(0.2, self.report)
        self._serving = Serving(self.node)

    def report(self) -> None:
        """Say that there is a gap."""
        self._diagnostics.publish(diagnostics(
            self.node, DiagnosticStatus.ERROR, 'gap since 3 s: motor_2/ammeter', [
                ('state', 'gap'), ('tuning', 'tuned to the quiet record'),
                ('watched', 'motor_2/ammeter'), ('false alarms per day', '1'),
                ('blocks judged', '40'),
                ('gap motor_2/ammeter', 'motor_2/ammeter: 0.5 article A instead of '
                                        '0.01 article A, mean +9.0 sigma, since stamp '
                                        '12.000 s')]))

    def say(self, verdict: dict[str, Any]) -> None:
        """Tell a verdict."""
        self.verdict.publish(String(data=json.dumps(verdict)))

    def _begin(self, message: Empty) -> None:
        self.begun += 1

    def _propose(self, request: Any, response: Any) -> Any:
        self.next_test.publish(String(data=json.dumps(NEXT_TEST)))
        response.success, response.message = True, 'being designed'
        return response

    def close(self) -> None:
        """Leave."""
        self._serving.close()
        leave(self.node)
