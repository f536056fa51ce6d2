# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One node: a member of the lock-step on ROS 2, its parameters, topics and reports."""

from collections.abc import Collection, Iterator, Mapping, Sequence
import gc
import time
from types import MappingProxyType

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep import compiled_loop, node_parameters, ros_parameters
from antenna_drive.lockstep.changes import CHANGES, SETTINGS, write_record
from antenna_drive.lockstep.compiled_unit import form_of
from antenna_drive.lockstep.conductor import Conductor
from antenna_drive.lockstep.exchange import compile_ahead, Exchange
from antenna_drive.lockstep.member import Member
from antenna_drive.lockstep.node_parameters import ReadSheet
from antenna_drive.lockstep.pace import Pace
from antenna_drive.lockstep.partner import ANSWER, PartnerUnit
from antenna_drive.lockstep.partner_link import Answer, PartnerLink
from antenna_drive.lockstep.placement import lock_memory, schedule_first_in_first_out
from antenna_drive.lockstep.rcl_channel import RclChannel, Unusable
from antenna_drive.lockstep.readings import CHANGES_QOS, Commanded, Readings
from antenna_drive.lockstep.report import Report
from antenna_drive.lockstep.ros_link import FrameLink, Reception
from antenna_drive.lockstep.run_services import RunServices, StateReader
from antenna_drive.lockstep.serving import Serving
from antenna_drive.lockstep.sim_time import SimTime
from antenna_drive.lockstep.starting import say_ready
from numba.core.errors import NumbaError
from rclpy.node import Node
from simgap.errors import one_line
from simgap.inputs.schema import Value
from std_msgs.msg import String

# No wait is longer than this [s]: signals and reports are served in between.
_LONGEST_WAIT_S = 0.2
# How long a node that ends waits for others to receive its last frames [s]. A process that did not
# run has lost what its port of shared memory had no room for. It gets that again 256 frames at a
# time, half a second each by config/fastdds.xml and more on a busy machine. A launch grants 5 s.
_DELIVERY_S = 4.5

_AMPERES = 'armature.physical_amperes_per_article_ampere'


class DriveNode:
    """
    A unit as a ROS 2 node.

    The lock-step loop runs in the thread that calls `spin`; parameter services and whatever
    else the node offers run in a second thread, which sleeps unless it is asked.
    """

    # what only the conductor, the stand-in of a partner, or a compiled unit has
    _pace: Pace | None = None
    _services: RunServices | None = None
    _partner: PartnerLink | None = None
    _channel: RclChannel | None = None
    _exchange: Exchange | None = None

    def __init__(self, node: Node, unit: Unit, overrides: ros_parameters.Overrides,
                 config: Collection[str] = (),
                 fed_by_topic: Mapping[str, float] = MappingProxyType({}),
                 wiring: str = '', outputs: Mapping[str, Sequence[Signal]] = OUTPUTS,
                 read_sheet: ReadSheet | None = None) -> None:
        """
        Declare parameters and topics.

        node : a bare node of the unit's name
        unit : the unit, with every override already in force
        overrides : what the user gave at the start
        config : the configuration files the unit was made from
        fed_by_topic : live settings that follow a Float64 topic `<node>/<setting>` instead of
            being parameters, and the greatest magnitude of each
        wiring, outputs : what the wiring of the drive is called, and the signals of each of its
            units
        read_sheet : returns the settings of this unit that play the test sheet in a file; None if
            it plays none

        Raises ParameterError: an override is not allowed, or no parameter has that name.
        Raises UserError: real-time scheduling or locked memory was asked for, and is not to be
        had.
        """
        self._node = node
        self._unit = unit
        self.tuning = ros_parameters.Tuning(unit)
        self._stop = self._quiet = self._stands_still = self._said_end = False
        self._every = 0
        settings: ros_parameters.Settings = {
            name: item for name, item in unit.settings().items()
            if name not in (*fed_by_topic, ANSWER)}
        node_parameters.declare(node, unit, overrides, settings, config, wiring,
                                read_sheet is not None)
        self._own = overrides.own
        self._member = self._make_member(outputs, overrides.names('run.observers', ()))
        self._link = FrameLink(node, self._member.layouts)
        self._reception = Reception(self._link, self._member, self._pace is not None)
        self.tuning.wake = self._wake
        self._readings = Readings(
            node, unit.outputs, self._number('publish_rate'), self._pace is not None,
            _as_float(settings[_AMPERES][1]) if _AMPERES in settings else None)
        self._changes = node.create_publisher(String, f'{node.get_name()}/changes', CHANGES_QOS)
        self._report = Report(node, self._member, self._pace, self._link.publishers)
        self._offer(settings, fed_by_topic, read_sheet)
        if self._own['exchange'][1] == 'auto':
            self._exchange = self._make_exchange()
        if self._own['realtime.memory'][1] == 'locked':
            lock_memory()
        if priority := int(self._number('realtime.priority')):
            schedule_first_in_first_out(priority)

    def _number(self, name: str) -> float:
        """Return the value that one of the node's own parameters had at the start."""
        return _as_float(self._own[name][1])

    def _make_member(self, outputs: Mapping[str, Sequence[Signal]],
                     observers: Collection[str]) -> Member:
        birth = float(time.time_ns() // 1000)
        if self._unit.name != TEST_SIGNAL:
            return Member(self._unit, birth, outputs)
        self._pace = Pace(self._number('run.pace'), self._number('run.lead'))
        step_s = self._number('run.step')
        return Conductor(self._unit, birth, step_s,
                         round(self._number('run.duration') / step_s) or None, outputs, observers)

    def _offer(self, settings: ros_parameters.Settings, fed_by_topic: Mapping[str, float],
               read_sheet: ReadSheet | None) -> None:
        """Offer what the second thread serves: services, topics and changes of parameters."""
        node, member = self._node, self._member
        if isinstance(member, Conductor):
            assert self._pace is not None
            self._services = RunServices(node, member, self._pace, self._wake, self._reached,
                                         self._report.hurry, read_sheet)
            self._report.told_state = self._services.state
        else:
            self._report.told_state = StateReader(node, member.conductor).latest
        self._report.commands = [
            Commanded(node, setting, self._number(f'run.{setting}_limit') or limit,
                      lambda changes: self.tuning.request(changes, wait=False))
            for setting, limit in fed_by_topic.items()]
        ros_parameters.accept_changes(node, {
            name: entry for name, (entry, _) in {**settings, **self._own}.items()}, self._change)
        if isinstance(self._unit, PartnerUnit):
            self._partner = self._report.partner = PartnerLink(
                node, member, self._unit, self._number('partner.rate'),
                self._number('partner.deadline'), str(self._own['partner.on_miss'][1]),
                self._reached, lambda answer: self.tuning.request({ANSWER: answer}, wait=False),
                self._force)

    def _make_exchange(self) -> Exchange | None:
        """Make the compiled exchange, or say once why there is none."""
        form = form_of(self._unit)
        try:
            if form is None:
                raise Unusable('the unit is in plain Python')
            compile_ahead(self._unit)
            self._channel = RclChannel(self._node, self._link, self._readings)
            self._report.exchange = Exchange(self._member, form, self._channel)
        except (Unusable, NumbaError) as reason:
            self._node.get_logger().info(f'the exchange runs in Python: {one_line(reason)}')
        return self._report.exchange

    def _force(self, answer: Answer) -> None:
        """Put an answer of nobody in force, as a change."""
        self._unit.tune({ANSWER: answer})
        self._note_changes({ANSWER: answer})

    def _reached(self) -> int:
        """Return the step that the node is at, to any thread."""
        exchange = self._exchange
        return self._member.step if exchange is None else exchange.step

    def _change(self, changes: dict[str, Value]) -> str:
        # in the thread of the parameter services
        own = {name: value for name, value in changes.items() if name in self._own}
        for_unit = {name: value for name, value in changes.items() if name not in own}
        reason = self.tuning.request(for_unit) if for_unit else ''
        if reason:
            return reason
        if 'publish_rate' in own:
            self._readings.rate_hz = _as_float(own['publish_rate'])
            self._every = self._readings.every(self._member.step_s or 1e-3)
            self._wake()
        if 'run.pace' in own and self._pace is not None:
            self._pace.change(_as_float(own['run.pace']), time.monotonic(), self._reached())
            self._wake()
        return ''

    def _wake(self) -> None:
        """End a wait, or a turn of the compiled exchange, from any thread."""
        exchange = self._exchange
        if exchange is not None:
            exchange.ask()
        self._link.wake()

    def stop(self) -> None:
        """End `spin` soon; may be called from a signal handler."""
        self._stop = True
        exchange = self._exchange
        if exchange is not None:
            exchange.ask()

    def spin(self) -> None:
        """Take part in runs until `stop` is called."""
        serving = Serving(self._node)
        clock = self._pace and SimTime(
            self._node, lambda: self._reached() * self._member.step_s)
        try:
            # What is there now stays: the collector need not look through all of it again.
            gc.freeze()
            self._link.publish(self._member.hello())
            say_ready(self._node, f'{", ".join(self._member.missing())} to begin a run')
            while not self._stop:
                if self._exchange is not None and self._exchanged(self._exchange):
                    continue
                outputs = self._go_on()
                if outputs is not None:
                    self._publish(outputs)
                if self._quiet or not self._reception.gather():
                    self._wait_for_anything()
        finally:
            self._report.ended()
            serving.close()
            if clock:
                clock.close()
            self._exchange = None
            self._link.await_delivery(_DELIVERY_S)
            if self._channel is not None:
                self._channel.close()

    def _exchanged(self, exchange: Exchange) -> bool:
        """Let the compiled exchange make steps; return False if only Python can do what is due."""
        member, pace = self._member, self._pace
        exchange.listen()
        services = self._services
        if (self._stop or self._quiet or not member.steady()
                or services is not None and services.held()
                or pace is not None and pace.factor > 0.0 and not pace.begun):
            return False
        if self.tuning.pending:
            self._apply_changes()
        before = member.step
        exchange.pauses = sorted(self._pauses())
        reason = exchange.run(self._every, pace)
        if member.step != before:
            self._stepped()
        if reason in (compiled_loop.TAKE_FAILED, compiled_loop.PUBLISH_FAILED):
            self._give_up(exchange, reason)
        elif reason == compiled_loop.MISSING:
            self._wait_for_anything()
        return member.step != before and reason == compiled_loop.LIMIT or reason in (
            compiled_loop.STEPPED, compiled_loop.FOREIGN, compiled_loop.MISSING)

    def _pauses(self) -> Iterator[int]:
        """Yield the steps after which Python has something to do."""
        if self._partner is not None:
            yield self._partner.next_step()
        if self._services is not None:
            yield self._services.control.halt

    def _give_up(self, exchange: Exchange, reason: int) -> None:
        self._exchange = self._report.exchange = None
        self._node.get_logger().warning(
            f'the exchange goes on in Python: '
            f'{"take" if reason == compiled_loop.TAKE_FAILED else "publish"} failed, '
            f'status {exchange.status}')
        if reason == compiled_loop.PUBLISH_FAILED and not self._member.fault:
            self._link.publish(self._member.message())

    def _go_on(self) -> FloatArray | None:
        if self.tuning.pending:
            self._apply_changes()
        member = self._member
        if self._pace is None:
            return member.go_on(self._stands_still)
        assert isinstance(member, Conductor) and self._services is not None
        held = self._services.held()
        if self._quiet:
            outputs = member.new_run(time.time_ns() / 1e3, self._stands_still)
            if outputs is not None:
                self._pace.begin()
                self._services.control.begun()
                return outputs
        if held:
            return None
        if self._pace.factor > 0.0 and member.run:
            now = time.monotonic()
            if self._pace.remaining(member.step + 1, member.step_s, now) > 0.0:
                return None
            outputs = member.go_on()
            if outputs is not None:
                self._pace.note(member.step, member.step_s, now)
            return outputs
        return member.go_on()

    def _apply_changes(self) -> None:
        changes = self.tuning.apply()
        if changes and self._member.run:
            self._note_changes(changes)
            if self._partner is not None and ANSWER in changes:
                self._partner.took(changes[ANSWER])  # type: ignore[arg-type]

    def _note_changes(self, changes: Mapping[str, Value]) -> None:
        self._report.last_change = self._tell(self._member.step, CHANGES, changes)

    def _tell(self, step: int, key: str, values: Mapping[str, Value]) -> str:
        """Say on `<node>/changes` what is in force from `step` on; return the text."""
        text = write_record(self._member.run, step, key, values)
        self._changes.publish(String(data=text))
        return text

    def _publish(self, outputs: FloatArray) -> None:
        member = self._member
        if member.step == 0:
            # Before the frame: it takes tens of milliseconds, and nobody waits for a step yet.
            self._begun()
        self._link.publish(member.message())
        if self._every and member.step % self._every == 0:
            self._readings.publish(member.step, member.step_s, outputs)
        self._stepped()

    def _stepped(self) -> None:
        self._quiet = self._stands_still = False
        if self._partner is not None:
            self._partner.stepped()
        self._report.stepped()
        if self._services is not None:
            self._services.tell_news()
        self._report.publish_if_due(time.monotonic())

    def _begun(self) -> None:
        member = self._member
        self._said_end = False
        self._every = self._readings.every(member.step_s)
        if self._partner is not None:
            self._partner.begin()
        self._tell(0, SETTINGS, {
            name: value for name, (_, value) in self._unit.settings().items()})
        self._node.get_logger().info(
            f'run {member.run:.0f} begins, macro-step {member.step_s:g} s')

    def _wait_for_anything(self) -> None:
        member = self._member
        missing = member.missing()
        now = time.monotonic()
        timeout = _LONGEST_WAIT_S
        if self._pace is not None and member.run and not missing:
            if self._services is None or not self._services.held():
                timeout = min(timeout, self._pace.remaining(member.step + 1, member.step_s, now))
        else:
            self._report.waiting(now)
        if isinstance(member, Conductor) and member.ended and not self._said_end:
            self._said_end = True
            self._report.ended()
            self._link.publish(self._member.hello())
        if self._services is not None:
            self._services.tell_news()
        ready = self._link.wait(member.wanted(), timeout)
        for peer in ready:
            self._reception.take_some(peer)
        self._quiet = not ready
        now = time.monotonic()
        self._stands_still = self._report.stands_still(now)
        self._report.publish_if_due(now)


def _as_float(value: Value) -> float:
    assert isinstance(value, (int, float))
    return value
