# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says of itself: in /diagnostics once a second, in its log when it has to wait."""

from collections.abc import Callable

from antenna_drive.lockstep.conductor import Conductor
from antenna_drive.lockstep.exchange import Exchange
from antenna_drive.lockstep.frame import two_of_one_name
from antenna_drive.lockstep.member import Member
from antenna_drive.lockstep.pace import Pace
from antenna_drive.lockstep.partner_link import PartnerLink
from antenna_drive.lockstep.readings import Commanded
from antenna_drive.lockstep.run_control import PAUSED, RunState
from antenna_drive.lockstep.shared_memory import is_cut_off
from antenna_drive.lockstep.starting import diagnostics, LEASE_S, namesake, PATIENCE_S
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

PERIOD_S = 1.0
CUT_OFF = ('; it cannot hear them: it did not run for a second or more, and Fast DDS gave its '
           'shared memory away. Start this node again')
# A wait that begins so soon after a sleep may be its consequence.
SOON_S = 5.0


class Report:
    """The state of one node, for people."""

    def __init__(self, node: Node, member: Member, pace: Pace | None,
                 publishers: Callable[[], dict[str, int]]) -> None:
        """
        Report on `member`.

        node : the node that publishes and logs
        member, pace : what to report on; pace only for the conductor
        publishers : returns how many publishers each peer's frame topic has
        """
        self._node = node
        self._member = member
        self._pace = pace
        self._publishers = publishers
        self._topic = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._refused_before = 0
        self._late_before = 0
        self._waiting_since: float | None = None
        self._told: str | None = None  # whom it waits for, as the log has it; None: no word
        self._fault_told = ''
        self._doubled_told: set[tuple[float, str]] = set()  # by run and peer
        self._next_s = 0.0
        self._awake_s: float | None = None
        self._slept_s = 0.0
        self._woke_s = 0.0
        self._ended_run = 0.0
        self.last_change = ''
        self.commands: list[Commanded] = []
        self.exchange: Exchange | None = None
        self.partner: PartnerLink | None = None
        # what the conductor says of its run; in the conductor itself, what it is
        self.told_state: Callable[[], RunState | None] = lambda: None
        self._excused_s = 0.0

    def stepped(self) -> None:
        """Note that the node has gone on."""
        if self._waiting_since is not None:
            if self._told is not None:
                self._node.get_logger().info(
                    f'going on at step {self._member.step} of run {self._member.run:.0f}')
                self._told = None
            self._waiting_since = None

    def waiting(self, now: float) -> None:
        """Note at `now` [s] that the node cannot go on; say so in the log if it lasts."""
        self._awake(now)
        if self._waiting_since is None:
            self._waiting_since = now
        if self._paused_at() is not None:
            self._excused_s = now
        fault = self._member.fault
        if fault and fault != self._fault_told:
            self._node.get_logger().error(f'{fault}; stopped until a new run begins')
        self._fault_told = fault
        if self._told is None and not fault and self._waits_long(now):
            self._warn()
            self._next_s = now  # people who watch /diagnostics hear of it at once too

    def _warn(self) -> None:
        self._told = self._waits_for()
        self._node.get_logger().warning(self._told)

    def ended(self) -> None:
        """Say once for each run how its steps and its partner's answers came."""
        member = self._member
        if member.run in (0.0, self._ended_run):
            return
        self._ended_run = member.run
        told = [source.summary() for source in (self._pace, self.partner) if source is not None]
        if told:
            self._node.get_logger().info('; '.join(filter(None, (
                f'run {member.run:.0f} ends at step {member.step}', *told))))

    def stands_still(self, now: float) -> bool:
        """Tell at `now` [s] whether the node has made no step for so long that it may leave."""
        return (self._waiting_since is not None
                and now - self._waiting_since >= self._member.patience_s)

    def hurry(self) -> None:
        """Let people who watch /diagnostics hear of it at once."""
        self._next_s = 0.0

    def _paused_at(self) -> int | None:
        """Return the step at which an operator holds the drive, None if nobody does."""
        told, member = self.told_state(), self._member
        if told is None or told.state != PAUSED or told.run != member.run:
            return None
        missing = member.missing()
        if missing not in ((), (member.conductor,)):
            return None  # it would wait without a pause too
        if missing and not self._publishers().get(member.conductor):
            return None  # whoever said so has gone
        return told.step

    def _waits_long(self, now: float) -> bool:
        return (self._waiting_since is not None and not self._at_rest()
                and now - max(self._waiting_since, self._excused_s) >= PATIENCE_S)

    def _at_rest(self) -> bool:
        member = self._member
        return member.ended if isinstance(member, Conductor) else member.resting

    def _waits_for(self) -> str:
        member = self._member
        names = ', '.join(member.missing()) or 'nobody'
        where = (f'at step {member.step} of run {member.run:.0f}' if member.run else
                 'to begin a run')
        return f'waiting for {names} {where}{self._why()}'

    def _why(self) -> str:
        """Say why the node may wait in vain, if there is a reason to think so."""
        if is_cut_off():
            return CUT_OFF
        if self._has_just_slept():
            return forgotten(self._slept_s)
        twice = namesake(self._node)
        return f'; {twice}' if twice else ''

    def _awake(self, now: float) -> None:
        """Note that the node runs at `now` [s], and whether it did not for long."""
        if self._awake_s is not None and now - self._awake_s > LEASE_S:
            self._slept_s, self._woke_s = now - self._awake_s, now
        self._awake_s = now

    def _has_just_slept(self) -> bool:
        """Tell whether the node waits since it slept, or since soon after."""
        return (self._slept_s > 0.0 and self._waiting_since is not None
                and self._waiting_since < self._woke_s + SOON_S)

    def publish_if_due(self, now: float) -> None:
        """Publish the state at `now` [s] if the last report is one period old."""
        self._awake(now)
        if now < self._next_s:
            return
        self._next_s = now + PERIOD_S
        if self._waiting_since is not None:
            self.waiting(now)  # the log never says less than the report
            if self._told is not None and self._waits_for() != self._told:
                self._warn()
        self._warn_of_doubles()
        level, message = self._judge(now)
        self._topic.publish(diagnostics(self._node, level, message, self._values(now)))

    def _warn_of_doubles(self) -> None:
        for peer, senders in self._member.inbox.doubled.items():
            if (self._member.run, peer) not in self._doubled_told:
                self._doubled_told.add((self._member.run, peer))
                self._node.get_logger().warning(
                    f'{two_of_one_name(peer, senders)}; frames of the second are refused')

    def _judge(self, now: float) -> tuple[bytes, str]:
        member = self._member
        refused = sum(member.inbox.refused.values())
        late = self._pace.late_steps if self._pace else 0
        doubled = [peer for peer, count in self._publishers().items() if count > 1]
        try:
            if member.fault:
                return DiagnosticStatus.ERROR, member.fault
            if refused > self._refused_before:
                doubled_in_run = [two_of_one_name(peer, senders)
                                  for peer, senders in member.inbox.doubled.items()]
                return DiagnosticStatus.WARN, '; '.join([
                    f'{refused - self._refused_before} frames refused', *doubled_in_run])
            if self._waits_long(now):
                return DiagnosticStatus.WARN, self._waits_for()
            if self.partner is not None and self.partner.trouble():
                return DiagnosticStatus.WARN, self.partner.trouble()
            if doubled:
                return (DiagnosticStatus.WARN,
                        f'more than one publisher of {", ".join(doubled)} frames')
            if late > self._late_before:
                return DiagnosticStatus.WARN, f'{late - self._late_before} steps late'
            if self._at_rest():
                return DiagnosticStatus.OK, 'no run in progress'
            paused_at = self._paused_at()
            if paused_at is not None:
                return DiagnosticStatus.OK, f'paused at step {paused_at}'
            return DiagnosticStatus.OK, 'stepping' if member.run else 'waiting for a run to begin'
        finally:
            self._refused_before = refused
            self._late_before = late

    def _values(self, now: float) -> list[tuple[str, str]]:
        member = self._member
        values = [('run', f'{member.run:.0f}'), ('step', str(member.step)),
                  ('macro-step [s]', repr(member.step_s))]
        if self._waits_long(now) and self._waiting_since is not None:
            values.append(('waiting for', ', '.join(member.missing())))
            values.append(('waiting since [s]', f'{now - self._waiting_since:.1f}'))
        refused = member.inbox.refused
        values.append(('refused frames', str(sum(refused.values()))))
        values += [(f'refused: {peer}, {reason.value}', str(count))
                   for (peer, reason), count in sorted(refused.items())]
        values.append(('refused values', str(sum(item.refused for item in self.commands))))
        if self._pace is not None:
            values.append(('pace', repr(self._pace.factor)))
            values.append(('late steps', str(self._pace.late_steps)))
            values.append(('latest step [ms]', f'{1e3 * self._pace.worst_s:.3g}'))
            values += self._pace.delays.values('delay')
        values.append(('exchange', 'compiled' if self.exchange else 'Python'))
        if self.exchange:
            values.append(('compiled steps', str(self.exchange.steps)))
        if self.partner is not None:
            values += self.partner.values()
        values.append(('last change', self.last_change))
        return values


def forgotten(slept_s: float) -> str:
    """Say what to do if a node waits on after it did not run for `slept_s` [s]."""
    return (f'; this node did not run for {slept_s:.0f} s, and others forget a process after '
            f'{LEASE_S:.0f} s. If this lasts, start it again')
