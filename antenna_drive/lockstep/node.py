# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One node: a member of the lock-step on ROS 2, its parameters, topics and reports."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
import gc
import time

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep import compiled_loop, ros_parameters
from antenna_drive.lockstep.changes import CHANGES, write_record
from antenna_drive.lockstep.compiled_unit import form_of
from antenna_drive.lockstep.conductor import Conductor
from antenna_drive.lockstep.exchange import BRIEF_WAIT_S, compile_ahead, Exchange
from antenna_drive.lockstep.member import Member
from antenna_drive.lockstep.pace import LEAD_S, Pace
from antenna_drive.lockstep.partner import ANSWER, HOLD, ON_MISS, PartnerUnit
from antenna_drive.lockstep.partner_link import Answer, PartnerLink
from antenna_drive.lockstep.rcl_channel import RclChannel, Unusable
from antenna_drive.lockstep.readings import ChangeRecord, READING_OVERRIDES, READING_QOS, Readings
from antenna_drive.lockstep.realtime import lock_memory, schedule_first_in_first_out
from antenna_drive.lockstep.report import Report
from antenna_drive.lockstep.ros_link import FrameLink
from antenna_drive.lockstep.run_control import PAUSED, PLAYING, RunControl, RunState, STOPPED
from antenna_drive.lockstep.run_services import RunServices, StateReader
from antenna_drive.lockstep.serving import Serving
from numba.core.errors import NumbaError
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter
from simgap.errors import one_line, UserError
from simgap.inputs.schema import Entry, Value
from std_msgs.msg import Float64

# No wait is longer than this [s]: signals and reports are served in between.
_LONGEST_WAIT_S = 0.2
# How long a node that ends waits for others to receive its last frames [s].
_DELIVERY_S = 1.0

_AMPERES = 'armature.physical_amperes_per_article_ampere'

PUBLISH_RATE = Entry('Hz', 0.0, 1e4, 'readings per simulated second on each signal topic, 0: none',
                     live=True)
PACE = Entry('1', 0.0, 1e3, 'how many times faster than real time, 0: as fast as possible',
             live=True)
LEAD = Entry('s', 0.0, 1.0, 'how long before it is due a step may be made')
STEP = Entry('s', 1e-5, 0.1, 'macro-step')
EXCHANGE = Entry('', description='auto: the compiled exchange where it can be used; '
                 'python: the exchange in Python', choices=('auto', 'python'))
PRIORITY = Entry('1', 0, 99, 'real-time priority (SCHED_FIFO) of the lock-step, 0: none',
                 whole=True)
MEMORY = Entry('', description='locked: all memory of the node stays in RAM (mlockall)',
               choices=('pageable', 'locked'))
DURATION = Entry('s', 0.0, 1e9, 'simulated time after which the run ends, 0: never')
STEPS = Entry('1', 1, 1_000_000, 'how many macro-steps the service step makes', live=True,
              whole=True)

PARTNER_RATE = Entry('Hz', 1.0, 1e4,
                     'how often per simulated second the partner is told its inputs')
DEADLINE = Entry('s', 0.0, 1e3,
                 'how old the step may be that was answered last, in simulated time; 0: any age')
MISS = Entry('', description='what the outputs do while an answer is overdue', choices=ON_MISS)

# The test sheet that the service play plays.
SHEET = 'run.sheet'

# Returns the settings that play the test sheet in a file.
ReadSheet = Callable[[str], Mapping[str, Value]]

# The parameters of a node itself, beside the settings of its unit.
OWN_PARAMETERS = ('config', 'wiring', 'exchange', 'publish_rate', 'realtime.priority',
                  'realtime.memory', 'partner.rate', 'partner.deadline', 'partner.on_miss',
                  'run.step', 'run.pace', 'run.lead', 'run.duration', 'run.observers',
                  'run.steps', SHEET)


class DriveNode:
    """
    A unit as a ROS 2 node.

    The lock-step loop runs in the thread that calls `spin`; parameter services and whatever
    else the node offers run in a second thread, which sleeps unless it is asked.
    """

    def __init__(self, node: Node, unit: Unit, overrides: ros_parameters.Overrides,
                 config: Collection[str] = (), fed_by_topic: Collection[str] = (),
                 wiring: str = '', outputs: Mapping[str, Sequence[Signal]] = OUTPUTS,
                 read_sheet: ReadSheet | None = None) -> None:
        """
        Declare parameters and topics.

        Parameters
        ----------
        node
            a bare node of the unit's name
        unit
            the unit, with every override already in force
        overrides
            what the user gave at the start
        config
            the configuration files the unit was made from
        fed_by_topic
            live settings that follow a Float64 topic `<node>/<setting>` instead of
            being parameters
        wiring, outputs
            what the wiring of the drive is called, and the signals of each of its units
        read_sheet
            returns the settings of this unit that play the test sheet in a file; None if it
            plays none

        Raises
        ------
        ParameterError : an override is not allowed, or no parameter has that name
        UserError : real-time scheduling or locked memory was asked for, and is not to be had

        """
        self._node = node
        self._unit = unit
        self._outputs = outputs
        self.tuning = ros_parameters.Tuning(unit)
        self._stop = False
        birth = float(time.time_ns() // 1000)
        settings: dict[str, tuple[Entry, Value]] = {
            name: item for name, item in unit.settings().items()
            if name not in (*fed_by_topic, ANSWER)}
        rate_hz = overrides.number('publish_rate', PUBLISH_RATE, 100.0)
        exchange = overrides.get('exchange', EXCHANGE, 'auto')
        priority = overrides.get('realtime.priority', PRIORITY, 0)
        memory = overrides.get('realtime.memory', MEMORY, 'pageable')
        if isinstance(unit, PartnerUnit):
            overrides.get('partner.rate', PARTNER_RATE, 100.0)
            overrides.get('partner.deadline', DEADLINE, 0.0)
            overrides.get('partner.on_miss', MISS, HOLD)
            ros_parameters.declare_names(
                node, 'partner.reads', overrides.names('partner.reads', unit.inputs),
                'signals that the partner is told')
        self._pace: Pace | None = None
        self._control: RunControl | None = None
        self._services: RunServices | None = None
        self._read_sheet = read_sheet
        self._member = self._make_member(birth, overrides)
        own = overrides.own
        overrides.check_all_known([*settings, *own])
        ros_parameters.declare_names(node, 'config', [*config] or ['reference'],
                                     'configuration files or sets of config/, later over earlier')
        ros_parameters.declare_names(node, 'wiring', [wiring],
                                     "module:NAME of the wiring, '' for the drive's own")
        ros_parameters.declare(node, {**settings, **own})
        self._own_entries = {name: entry for name, (entry, _) in own.items()}
        self._link = FrameLink(node, self._member.layouts)
        self.tuning.wake = self._wake
        self._readings = Readings(node, unit.outputs, rate_hz, self._pace is not None,
                                  _number(settings.get(_AMPERES)))
        self._record = ChangeRecord(node)
        self._report = Report(node, self._member, self._pace, self._link.publishers)
        if self._control is not None:
            self._services = self._offer_services(self._control)
            self._report.told_state = self._state
        else:
            self._report.told_state = StateReader(node, self._member.conductor).latest
        for setting in fed_by_topic:
            self._follow(setting)
        ros_parameters.accept_changes(
            node, {name: entry for name, (entry, _) in {**settings, **own}.items()}, self._change)
        self._every = 0
        self._partner = (self._make_partner(unit, overrides) if isinstance(unit, PartnerUnit)
                         else None)
        self._quiet = False
        self._stands_still = False
        self._said_end = False
        self._told_state = ('', 0)
        self._channel: RclChannel | None = None
        self._exchange = self._make_exchange() if exchange == 'auto' else None
        if memory == 'locked':
            lock_memory()
        if priority:
            schedule_first_in_first_out(int(priority))  # type: ignore[arg-type]

    def _make_exchange(self) -> Exchange | None:
        """Make the compiled exchange, or say once why there is none."""
        form = form_of(self._unit)
        try:
            if form is None:
                raise Unusable('the unit is in plain Python')
            compile_ahead(self._unit)
            self._channel = RclChannel(self._node, self._link, self._readings)
            self._report.exchange = Exchange(self._member, form, self._channel, self._stamps())
        except (Unusable, NumbaError) as reason:
            self._node.get_logger().info(f'the exchange runs in Python: {one_line(reason)}')
        return self._report.exchange

    def _stamps(self) -> int:
        """Return of how many steps the compiled exchange notes the time; for a benchmark."""
        return 0

    def _make_member(self, birth: float, overrides: ros_parameters.Overrides) -> Member:
        if self._unit.name != TEST_SIGNAL:
            return Member(self._unit, birth, self._outputs)
        step_s = overrides.number('run.step', STEP, 1e-3)
        pace = overrides.number('run.pace', PACE, 1.0)
        lead_s = overrides.number('run.lead', LEAD, LEAD_S)
        duration = overrides.number('run.duration', DURATION, 0.0)
        observers = overrides.names('run.observers', ())
        overrides.get('run.steps', STEPS, 1)
        ros_parameters.declare_names(self._node, 'run.observers', observers,
                                     'names of recorders that every step waits for')
        sheet = ''.join(overrides.names(SHEET, ()))
        if self._read_sheet is not None:
            self._node.declare_parameter(SHEET, sheet, ParameterDescriptor(
                description='file with the test sheet that the service play plays'),
                ignore_override=True)
        self._pace = Pace(pace, lead_s)
        self._control = RunControl(ros_parameters.PATIENCE_S)
        return Conductor(self._unit, birth, step_s, round(duration / step_s) or None,
                         self._outputs, observers)

    def _offer_services(self, control: RunControl) -> RunServices:
        return RunServices(
            self._node, control, self._wake, self._state,
            lambda: int(self._node.get_parameter('run.steps').value or 1), self._restart_clock,
            None if self._read_sheet is None else self._play)

    def _state(self) -> RunState:
        """Return what the conductor says of its run, from any thread."""
        member = self._member
        assert isinstance(member, Conductor) and self._control is not None
        step = self._reached()
        state = PAUSED if self._control.holds(step) else PLAYING
        if member.run == 0.0 or member.ended or member.fault:
            state = STOPPED
        return RunState(state, int(member.run), step)

    def _restart_clock(self) -> None:
        """Let the next step be due now, and the others after it, at the pace as it is."""
        assert self._pace is not None
        self._pace.change(self._pace.factor, time.monotonic(), self._reached())

    def _play(self) -> str:
        """Put the waveform of the test sheet in force; return why that is refused, or ''."""
        assert self._read_sheet is not None
        path = str(self._node.get_parameter(SHEET).value or '')
        if not path:
            return f'{SHEET}: not given, set it to the file of a test sheet'
        try:
            settings = self._read_sheet(path)
        except UserError as error:
            return str(error)
        result = self._node.set_parameters_atomically([
            Parameter(name, value=list(value) if isinstance(value, tuple) else value)
            for name, value in settings.items()])
        return '' if result.successful else result.reason

    def _make_partner(self, unit: PartnerUnit, overrides: ros_parameters.Overrides) -> PartnerLink:
        settings = overrides.own
        self._report.partner = PartnerLink(
            self._node, self._member, unit, _as_float(settings['partner.rate'][1]),
            _as_float(settings['partner.deadline'][1]), str(settings['partner.on_miss'][1]),
            self._reached, lambda answer: self.tuning.request({ANSWER: answer}, wait=False),
            self._force)
        return self._report.partner

    def _force(self, answer: Answer) -> None:
        """Put an answer of nobody in force, as a change."""
        self._unit.tune({ANSWER: answer})
        self._note_changes({ANSWER: answer})

    def _reached(self) -> int:
        """Return the step that the node is at, to any thread."""
        exchange = self._exchange
        return self._member.step if exchange is None else exchange.step

    def _follow(self, setting: str) -> None:
        def follow(message: Float64) -> None:
            if self.tuning.request({setting: message.data}, wait=False):
                self._report.refused_values += 1

        self._node.create_subscription(
            Float64, f'{self._node.get_name()}/{setting}', follow, READING_QOS,
            qos_overriding_options=READING_OVERRIDES)

    def _change(self, changes: dict[str, Value]) -> str:
        # in the thread of the parameter services
        own = {name: value for name, value in changes.items() if name in self._own_entries}
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
        try:
            # What is there now stays: the collector need not look through all of it again.
            gc.freeze()
            self._hello()
            while not self._stop:
                if self._exchange is not None and self._exchanged(self._exchange):
                    continue
                outputs = self._go_on()
                if outputs is not None:
                    self._publish(outputs)
                if self._quiet or not self._gather():
                    self._wait_for_anything()
        finally:
            self._report.ended()
            serving.close()
            self._exchange = None
            self._link.await_delivery(_DELIVERY_S)
            if self._channel is not None:
                self._channel.close()

    def _exchanged(self, exchange: Exchange) -> bool:
        """
        Let the compiled exchange make the steps that it can make.

        Returns
        -------
        False if something is due that only Python does

        """
        member, pace = self._member, self._pace
        exchange.listen()
        if (self._stop or self._quiet or not member.steady() or self._held()
                or pace is not None and pace.factor > 0.0 and not pace.begun):
            return False
        if self.tuning.pending:
            self._apply_changes()
        before = member.step
        exchange.pauses = sorted(self._pauses())
        reason = exchange.run(self._every, pace)
        if member.step != before:
            self._made(exchange, before)
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
        if self._control is not None:
            yield self._control.halt

    def _held(self) -> bool:
        """Return whether an operator holds the drive at its step, or wants a new run."""
        control, member = self._control, self._member
        if control is None:
            return False
        if control.reset_wanted:
            assert isinstance(member, Conductor)
            member.begin_again()
        if not control.holds(member.step):
            return False
        if member.run and control.stands(member.step):
            self._tell_state()
        return True

    def _tell_state(self, only_news: bool = False) -> None:
        """Say what the run does now, to people and to the other nodes."""
        if self._services is None:
            return
        state = self._state()
        if not only_news or (state.state, state.run) != self._told_state:
            self._told_state = (state.state, state.run)
            self._services.publish()
            self._report.hurry()

    def _made(self, exchange: Exchange, before: int) -> None:
        """Do what is due after the steps that the compiled exchange has made since `before`."""
        self._stepped()

    def _give_up(self, exchange: Exchange, reason: int) -> None:
        self._exchange = self._report.exchange = None
        self._node.get_logger().warning(
            f'the exchange goes on in Python: {compiled_loop.REASONS[reason]}, '
            f'status {exchange.status}')
        if reason == compiled_loop.PUBLISH_FAILED and not self._member.fault:
            self._link.publish(self._member.message())

    def _hello(self) -> None:
        self._link.publish(self._member.layout.hello(self._member.birth))

    def _go_on(self) -> FloatArray | None:
        if self.tuning.pending:
            self._apply_changes()
        member = self._member
        if self._pace is None:
            return member.go_on(self._stands_still)
        assert isinstance(member, Conductor) and self._control is not None
        held = self._held()
        if self._quiet:
            outputs = member.new_run(time.time_ns() / 1e3, self._stands_still)
            if outputs is not None:
                self._pace.begin()
                self._control.begun()
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
        member = self._member
        self._record.add(member.run, member.step, changes)
        self._report.last_change = write_record(member.run, member.step, CHANGES, changes)

    def _publish(self, outputs: FloatArray) -> None:
        if self._member.step == 0:
            # Before the frame: it takes tens of milliseconds, and nobody waits for a step yet.
            self._begun()
        self._link.publish(self._member.message())
        self._publish_readings(outputs)
        self._stepped()

    def _publish_readings(self, outputs: FloatArray) -> None:
        member = self._member
        if self._every and member.step % self._every == 0:
            self._readings.publish(member.step, member.step_s, outputs)

    def _stepped(self) -> None:
        self._quiet = self._stands_still = False
        if self._partner is not None:
            self._partner.stepped()
        self._report.stepped()
        self._tell_state(only_news=True)
        self._report.publish_if_due(time.monotonic())

    def _begun(self) -> None:
        member = self._member
        self._said_end = False
        self._every = self._readings.every(member.step_s)
        if self._partner is not None:
            self._partner.begin()
        self._record.begin(member.run, {
            name: value for name, (_, value) in self._unit.settings().items()})
        self._node.get_logger().info(
            f'run {member.run:.0f} begins, macro-step {member.step_s:g} s')

    def _gather(self) -> bool:
        """
        Take a frame of each peer that the next step waits for.

        Returns
        -------
        False if a wait for something else is called for: one of them takes its time, or the
        next step waits for nobody but the clock

        """
        member = self._member
        link = self._link
        missing = member.missing()
        # One peer at a time: a wait costs something for each that it looks at, and to be woken
        # by each in turn costs most.
        for peer in missing:
            frame = link.take(peer)
            if frame is None:
                link.wait_for(peer, BRIEF_WAIT_S)
                frame = link.take(peer)
                if frame is None:
                    return False
                if peer is not missing[0]:
                    # While the slowest is waited for, the frames of the others come.
                    member.inbox.put_first(peer)
            member.receive(peer, frame)
        return bool(missing) or self._pace is None

    def _wait_for_anything(self) -> None:
        member = self._member
        missing = member.missing()
        now = time.monotonic()
        timeout = _LONGEST_WAIT_S
        if self._pace is not None and member.run and not missing:
            if not self._held():
                timeout = min(timeout, self._pace.remaining(member.step + 1, member.step_s, now))
        else:
            self._report.waiting(now)
        if isinstance(member, Conductor) and member.ended and not self._said_end:
            self._said_end = True
            self._report.ended()
            self._hello()
        self._tell_state(only_news=True)
        ready = self._link.wait(member.wanted(), timeout)
        for peer in ready:
            self._take_some(peer)
        self._quiet = not ready
        now = time.monotonic()
        self._stands_still = self._report.stands_still(now)
        self._report.publish_if_due(now)

    def _take_some(self, peer: str) -> None:
        """
        Take all frames of an observer; those of a peer that steps up to the first not refused.

        For as long as frames come, the conductor begins no new run. One a turn would be too few:
        whoever speaks in a peer's name may send more than that, and an observer may have reported
        each of hundreds of steps.
        """
        member = self._member
        while (frame := self._link.take(peer)) is not None:
            refused = member.inbox.refused.total()
            member.receive(peer, frame)
            if peer in member.inbox.stepping and member.inbox.refused.total() == refused:
                break


def _as_float(value: Value) -> float:
    assert isinstance(value, (int, float))
    return value


def _number(setting: tuple[Entry, Value] | None) -> float | None:
    return None if setting is None else _as_float(setting[1])
