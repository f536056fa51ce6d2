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
from antenna_drive.lockstep.frame import HEADER  # noqa: E402
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
        self.member = member = Member(build('motor_1', load()), 0.0)
        self.report = report.Report(node, member, None, dict)
        self._warning = node.get_logger.return_value.warning
        self._publish = node.create_publisher.return_value.publish

    def log(self) -> list[str]:
        return [call.args[0] for call in self._warning.call_args_list]

    def published(self) -> str:
        message: str = self._publish.call_args.args[0].status[0].message
        return message

    def hear(self, peer: str, run: float, step: float, sender: float,
             step_s: float = 1e-3) -> None:
        """Hear a frame, and do what it lets the member do."""
        length = self.member.layouts[peer].length
        frame = [run, step, step_s, sender][:len(HEADER)]
        self.member.receive(peer, (*frame, *[0.0] * (length - len(frame))))
        if self.member.go_on() is not None:
            self.report.stepped()

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


RUN = 9.0
SENDERS = {'test_signal': 5.0, 'torque_share': 6.0, 'plant': 7.0}
# births of nodes that say hello, and which run has ended
HELLOS = [(birth, ended) for birth in (1.0, 1e3, 2.0**51) for ended in (0.0, 8.0)]


def running(steps: int) -> Told:
    """Return a report on a member that has made some steps of a run."""
    told = Told()
    for k in range(steps):
        for peer in SENDERS:
            told.hear(peer, RUN, float(k), SENDERS[peer])
    assert (told.member.run, told.member.step) == (RUN, steps)
    return told


@pytest.mark.parametrize('times', [1, 3])
@pytest.mark.parametrize('peer', SENDERS)
@pytest.mark.parametrize('own', [False, True])
def test_no_hello_changes_what_a_running_member_reports(
        own: bool, peer: str, times: int) -> None:
    """Somebody has the name of a peer, or repeats what the peer has said before."""
    told = running(5)
    for birth, ended in times * HELLOS:
        told.hear(peer, 0.0, birth, SENDERS[peer] if own else 3.0, ended)
        if not own:
            told.hear(peer, 0.0, birth, 3.0, RUN)
    told.report.publish_if_due(0.0)
    assert told.published() == 'stepping'
    told.wait(0.2, 5.0)
    names = ', '.join(told.member.missing())
    assert told.log() == [f'waiting for {names} at step 5 of run 9']
    assert told.published() == told.log()[0]


def test_the_end_of_a_run_is_no_trouble_and_the_next_step_ends_it() -> None:
    told = running(5)
    told.hear('test_signal', 0.0, 1.0, SENDERS['test_signal'], RUN)
    told.wait(0.0, 5.0)
    assert told.log() == []
    assert told.published() == 'no run in progress'
    for peer, sender in SENDERS.items():
        told.hear(peer, RUN, 5.0, sender)
    told.report.publish_if_due(7.0)
    assert told.published() == 'stepping'


def test_two_nodes_of_one_name_are_told_with_their_processes() -> None:
    told = running(5)
    one, other = 4711.0, 2.0**40 + 4712.0
    told = Told()
    told.hear('test_signal', RUN, 0.0, one)
    for peer in ('plant', 'torque_share'):
        told.hear(peer, RUN, 0.0, 3.0)
    for k in range(1, 4):
        told.hear('test_signal', RUN, float(k), other)
        told.report.publish_if_due(2.0 * k)
    words = 'two nodes are called test_signal, processes 4711 and 4712'
    assert [words in line for line in told.log()] == [True]
    assert told.published().startswith('1 frames refused; ' + words)
