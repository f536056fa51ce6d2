# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says of a wait, at moments that the test gives."""

from __future__ import annotations

from typing import Any
from unittest.mock import create_autospec

from antenna_drive.emulator.units import build
from antenna_drive.parameters import load
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: there is nothing to report to')

from antenna_drive.lockstep import report  # noqa: E402, I100
from antenna_drive.lockstep.member import Member  # noqa: E402
from builtin_interfaces.msg import Time  # noqa: E402
from rclpy.node import Node  # noqa: E402

WAITS = 'waiting for test_signal to begin a run'


class Told:
    """A report on a member that waits, and what it has said."""

    def __init__(self) -> None:
        node: Any = create_autospec(Node, instance=True)
        node.get_fully_qualified_name.return_value = '/motor_1'
        node.get_clock.return_value.now.return_value.to_msg.return_value = Time()
        member = Member(build('motor_1', load()), 0.0)
        self.report = report.Report(node, member, None, dict)
        self._warning = node.get_logger.return_value.warning
        self._publish = node.create_publisher.return_value.publish

    def log(self) -> list[str]:
        return [call.args[0] for call in self._warning.call_args_list]

    def published(self) -> str:
        message: str = self._publish.call_args.args[0].status[0].message
        return message

    def wait(self, begin_s: float, end_s: float) -> None:
        """Wait from one moment [s] to another, and look around as often as a node does."""
        for tick in range(round(5 * begin_s), round(5 * end_s) + 1):
            self.report.waiting(tick / 5)
            self.report.publish_if_due(tick / 5)


def test_a_wait_is_told_once() -> None:
    told = Told()
    told.wait(0.0, 0.6)
    assert told.log() == []
    told.wait(0.8, 30.0)
    assert told.log() == [WAITS]
    assert told.published() == WAITS


@pytest.mark.parametrize('first', ['waiting', 'publish_if_due'])
def test_a_node_that_others_may_have_forgotten_says_so(first: str) -> None:
    told = Told()
    told.wait(0.0, 5.0)
    told.report.stepped()
    getattr(told.report, first)(30.5)
    told.wait(30.6, 33.0)
    assert told.log() == [WAITS, WAITS + report.forgotten(25.5)]
    assert told.published() == WAITS + report.forgotten(25.5)
    told.report.stepped()
    told.wait(51.0, 53.0)
    assert told.log()[2:] == [WAITS], 'this wait has another reason'


def test_a_node_that_slept_for_less_is_remembered() -> None:
    told = Told()
    told.wait(0.0, 5.0)
    told.wait(24.0, 30.0)
    assert told.log() == [WAITS]


def test_what_is_found_out_later_is_logged_too(monkeypatch: pytest.MonkeyPatch) -> None:
    told = Told()
    told.wait(0.0, 5.0)
    monkeypatch.setattr(report, 'is_cut_off', lambda: True)
    told.wait(5.2, 8.0)
    assert told.log() == [WAITS, WAITS + report.CUT_OFF]
