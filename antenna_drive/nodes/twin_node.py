# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The twin on ROS 2: the real drive's topics in; twin, residuals, verdict and diagnostics out."""

from collections.abc import Sequence
from concurrent.futures import BrokenExecutor
from contextlib import ExitStack
from functools import partial
import json
import os
from pathlib import Path
from queue import Empty as NothingThere, SimpleQueue
from threading import Event
import time
from typing import Any

from antenna_drive.lockstep.entry import ros_node, stopped_by_signals
from antenna_drive.lockstep.ros_parameters import Overrides
from antenna_drive.lockstep.run_services import STATE_QOS
from antenna_drive.lockstep.serving import Serving
from antenna_drive.lockstep.starting import diagnostics, say_ready, told_while_compiling
from antenna_drive.parameters.loading import load
from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.sheet import load_sheet, TestSheet
from antenna_drive.twin import watch
from antenna_drive.twin.baseline import Baseline
from antenna_drive.twin.growing import GrowingVerdict, NextTest
from antenna_drive.twin.regular_stamps import RegularSamples
from antenna_drive.twin.topics import load_topics, own_topics, Topic, TopicMap
from antenna_drive.twin.tuned import loaded, tuned
from antenna_drive.twin.watch import Twin, TwinSettings
from antenna_drive.workers import worker_processes
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from simgap.drafts import drafted
from simgap.errors import one_line, UserError
from simgap.inputs.schema import Entry
from simgap.logs.channel import NANOSECONDS
from std_msgs.msg import Empty, Float64, Float64MultiArray, String
from std_srvs.srv import Trigger

NAME = 'twin'
OK = 0
# Best effort matches every publisher. There is room for some seconds of messages.
_FROM_REAL = QoSProfile(depth=2000, reliability=ReliabilityPolicy.BEST_EFFORT)
_OUT = QoSProfile(depth=100)
# The diagnosis yields to the drive and the twin.
_NICE = 10
_PERIOD_S = 0.05
_REPORT_S = 1.0
# A gap is told after some seconds; being so late is worth a word.
_LATE_S = 2.0
_LEVELS = {watch.OK: DiagnosticStatus.OK, watch.WAITING: DiagnosticStatus.STALE,
           watch.STALE: DiagnosticStatus.STALE, watch.GAP: DiagnosticStatus.ERROR,
           watch.BAD_INPUT: DiagnosticStatus.WARN, watch.SETTLING: DiagnosticStatus.OK,
           watch.LEARNING: DiagnosticStatus.OK, watch.OUTSIDE: DiagnosticStatus.WARN}
_ENTRIES = {
    'alarms_per_day': Entry('1', 1e-6, 1e4, 'false alarms that are allowed a day'),
    'quiet': Entry('s', 20.0, 3600.0, 'length of the quiet record'),
}
_AS_LEARNED = 'the drive is as in its quiet record'
_TEXTS = ('real', 'map', 'sheet', 'quiet_file')
_SWITCHES = {'tune': True, 'verdict': False}


def run(arguments: Sequence[str]) -> int:
    """
    Watch until SIGINT or SIGTERM; return 0. The arguments are without the program's name.

    Raises UserError: wrong arguments, map, sheet, configuration or quiet record.
    """
    with ros_node(NAME, arguments, 'real:=/elevation') as node, ExitStack() as stack:
        return _TwinNode(node, stack).spin()


def _switch(given: dict[str, Any], name: str) -> bool:
    value = given.get(name, _SWITCHES[name])
    if not isinstance(value, bool):
        raise UserError(f'{name}: {value!r} given, allowed is true or false')
    return value


class _TwinNode:
    """Feeds a `Twin` with messages, and publishes what it says."""

    def __init__(self, node: Node, stack: ExitStack) -> None:
        self._node = node
        self._log = node.get_logger()
        overrides = Overrides(node)
        numbers = {name: overrides.number(name, entry, default) for (name, entry), default in zip(
            _ENTRIES.items(), (TwinSettings.alarms_per_day, TwinSettings.quiet_s), strict=True)}
        texts = {name: overrides.text(name) for name in _TEXTS}
        config = [name for name in overrides.names('config', ()) if name != 'reference']
        switches = {name: _switch(overrides.rest(), name) for name in _SWITCHES}
        overrides.check_all_known(('config', *_ENTRIES, *_TEXTS, *_SWITCHES))
        self._map = load_topics(texts['map']) if texts['map'] else own_topics(texts['real'])
        sheet = load_sheet(Path(texts['sheet'])) if texts['sheet'] else TestSheet()
        drive = load(*config)
        self._quiet_file = Path(texts['quiet_file']) if texts['quiet_file'] else None
        kept, configuration, outside = _read_quiet(self._quiet_file)
        with told_while_compiling(node):
            self._twin = Twin(
                loaded(configuration) if configuration else drive, sheet,
                TwinSettings(alarms_per_day=numbers['alarms_per_day'], quiet_s=numbers['quiet']),
                kept, tuned if switches['tune'] and kept is None else None, outside)
        self._written = kept is not None
        self._arrived: SimpleQueue[tuple[Topic, tuple[float, ...], int, int]] = SimpleQueue()
        self._tests: SimpleQueue[None] = SimpleQueue()
        self._state = '', ''
        self._growing: GrowingVerdict | None = None
        self._next: NextTest | None = None
        self._asked = Event()
        if switches['verdict']:
            executor = stack.enter_context(worker_processes(1, finish=False))
            executor.submit(os.nice, _NICE)
            self._growing, self._next = GrowingVerdict(executor, drive), NextTest(executor, drive)
        self._since: int | None = None
        self._stretch = 0
        self._even = RegularSamples() if self._map.has_stamps_of_messages else None
        self._connect(self._map)
        self._taken_at = time.monotonic()
        self._stop = stopped_by_signals()

    def _connect(self, topics: TopicMap) -> None:
        name = self._node.get_name()
        for topic in topics.topics:
            self._node.create_subscription(
                Float64MultiArray if topic.vector else Float64, topic.name,
                partial(self._listen, topic), _FROM_REAL)
        names = {signal for topic in topics.topics for signal in topic.signals} - {RATE_COMMAND}
        self._publishers = {
            signal: [self._node.create_publisher(Float64, f'{name}/{middle}{signal}', _OUT)
                     for middle in ('', 'residual/')]
            for signal in SIGNALS if signal in names}
        self._diagnostics = self._node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._verdict = self._node.create_publisher(String, f'{name}/verdict', STATE_QOS)
        self._next_test = self._node.create_publisher(String, f'{name}/next_test', STATE_QOS)
        self._node.create_service(Trigger, f'{name}/propose', self._propose)
        self._node.create_subscription(Empty, f'{name}/begin_test',
                                       lambda message: self._tests.put(None), 1)

    def _listen(self, topic: Topic, message: Any, info: Any) -> None:
        numbers = tuple(message.data) if topic.vector else (message.data,)
        self._arrived.put((topic, numbers, info['source_timestamp'], time.time_ns()))

    def _propose(self, request: Any, response: Any) -> Any:
        """Answer who asks for the next test."""
        growing, following = self._growing, self._next
        if growing is None or following is None:
            response.message = 'no verdict is asked for: start the twin with verdict:=true'
        elif not growing.looks:
            response.message = 'there is no verdict yet'
        elif following.under_way or self._asked.is_set():
            response.message = 'the next test is being designed already'
        else:
            self._asked.set()
            response.success = True
            response.message = ('the next test is being designed: some minutes, then it is on '
                                f'{self._next_test.topic_name}')
        return response

    def spin(self) -> int:
        """Watch until told to stop; return the exit code."""
        serving = Serving(self._node)
        report_at = 0.0
        say_ready(self._node, ', '.join(topic.name for topic in self._map.topics))
        try:
            while not self._stop.wait(_PERIOD_S):
                self._take()
                self._publish()
                self._keep_quiet_record()
                try:
                    self._look()
                except BrokenExecutor:
                    self._growing = self._next = None
                    self._log.error('the process of the diagnosis was ended; no more verdicts')
                now = time.monotonic()
                if self._twin.state != self._state[0] or now >= report_at:
                    report_at = now + _REPORT_S
                    self._report()
        finally:
            serving.close()
        return OK

    def _take(self) -> None:
        self._taken_at = time.monotonic()
        while True:
            try:
                topic, numbers, source, arrival = self._arrived.get_nowait()
            except NothingThere:
                return
            for sample in self._map.read(topic, numbers, source, arrival):
                for settled in self._even.put(*sample) if self._even else [sample]:
                    self._twin.put(*settled)

    def _publish(self) -> None:
        for item in self._twin.advance(time.monotonic()):
            twin, residual = self._publishers[item.name]
            for value, off in zip(item.twin.tolist(), item.residual.tolist(), strict=True):
                twin.publish(Float64(data=value))
                residual.publish(Float64(data=off))

    def _keep_quiet_record(self) -> None:
        if self._written or self._twin.judge.baseline is None or self._quiet_file is None:
            return
        self._written = True
        try:
            with drafted(self._quiet_file) as stream:
                stream.write(json.dumps({'baseline': self._twin.judge.baseline.plain(),
                                         'configuration': self._twin.configuration,
                                         'outside': self._twin.outside}).encode())
            self._log.info(f'the quiet record is kept in {self._quiet_file}')
        except OSError as error:
            self._log.error(f'{self._quiet_file}: {one_line(error)}')

    def _look(self) -> None:
        growing, following = self._growing, self._next
        if growing is None or following is None:
            return
        intake, sheet = self._twin.intake, self._twin.sheet
        if intake.stretch != self._stretch:
            # nothing older than a pause or a jump of the time is kept
            self._stretch, self._since = intake.stretch, None
        if not self._tests.empty():
            self._tests.get()
            growing.complete(intake.recording(sheet, self._since))
            self._since = intake.newest().get(RATE_COMMAND)
        if growing.take():
            said = growing.message()
            self._verdict.publish(String(data=json.dumps(said)))
            self._log.info(said['fault'] or said['say'])
        if growing.due(intake.span_s(self._since)):
            growing.begin(intake.recording(sheet, self._since))
        if self._asked.is_set():
            following.begin(growing.planning, growing.looks[-1].seconds)
            self._asked.clear()
            self._tell_next(following)
        if following.take():
            self._tell_next(following)
            self._log.info(following.fault or ' '.join(following.message()['say'][:1]))

    def _tell_next(self, following: NextTest) -> None:
        self._next_test.publish(String(data=json.dumps(following.message())))

    def _report(self) -> None:
        named = self._growing.named if self._growing is not None else ''
        level, message, values = told(self._twin, named)
        behind_s = time.monotonic() - self._taken_at
        values.append(('behind', f'{behind_s:.1f} s'))
        if behind_s > _LATE_S:
            message += f'; {behind_s:.0f} s behind, the computer is too slow'
        self._diagnostics.publish(diagnostics(self._node, level, message, values))
        if (self._twin.state, named) != self._state:
            # rclpy keeps one severity for each line of a program
            if level == DiagnosticStatus.OK:
                self._log.info(message)
            else:
                self._log.warning(message)
            self._state = self._twin.state, named


def _read_quiet(path: Path | None) -> tuple[Baseline | None, str, tuple[str, ...] | None]:
    """
    Return a quiet record that is kept, the configuration tuned to it, and what is outside.

    Raises UserError: the file cannot be read, or is none.
    """
    if path is None or not path.exists():
        return None, '', None
    try:
        data = json.loads(path.read_text(encoding='utf-8'))
        outside = data.get('outside')  # files of earlier releases do not know
        return (Baseline.of_plain(data['baseline']), str(data['configuration']),
                None if outside is None else tuple(map(str, outside)))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise UserError(f'{path}: no quiet record of a twin, {one_line(error)}; remove it, and '
                        'the twin learns another') from None


def told(twin: Twin, named: str = '') -> tuple[bytes, str, list[tuple[str, str]]]:
    """
    Return how bad the state of a twin is, in a line, and in named values.

    twin : that reports
    named : what a verdict on the same drive names, '' for nothing
    """
    state, settings, judge = twin.state, twin.settings, twin.judge
    values = [('state', state), ('tuning', twin.tuned or 'not yet'),
              ('tolerances', 'not compared' if twin.outside is None else
               '; '.join(twin.outside) or 'the quiet record lies within them'),
              ('watched', ', '.join(judge.baseline.signals) if judge.baseline else 'nothing yet'),
              ('false alarms per day', f'{settings.alarms_per_day:g}'),
              ('blocks judged', str(judge.blocks - judge.unjudged)),
              ('blocks not judged', f'{judge.unjudged} (motion beyond that of the quiet record)'),
              ('jumps of time', '; '.join(twin.intake.jumps[-3:]) or 'none')]
    values += [(f'rubbish {name}', f'{count} samples {what}')
               for (name, what), count in sorted(twin.intake.rubbish.items())]
    gaps = twin.gaps()
    values += [(f'gap {gap.name}', f'{gap}, since stamp {gap.since_ns / NANOSECONDS:.3f} s')
               for gap in gaps]
    if state == watch.GAP:
        newest = max(twin.intake.newest().values(), default=0)
        since = (newest - min(gap.since_ns for gap in gaps)) / NANOSECONDS if gaps else 0.0
        return _LEVELS[state], (f'gap since {since:.0f} s: ' + '; '.join(map(str, gaps))
                                if gaps else 'gap, closing'), values
    if state == watch.OK and named:
        return DiagnosticStatus.WARN, f'{_AS_LEARNED}, but the verdict is {named}', values
    return _LEVELS[state], {
        watch.OK: _agreement(twin),
        watch.OUTSIDE: (f'outside the tolerances: {"; ".join(twin.outside or ())}; {_AS_LEARNED}, '
                        'and that is not healthy: diagnose it'),
        watch.WAITING: f'waiting for {RATE_COMMAND}',
        watch.SETTLING: 'settling: an unknown start is being forgotten',
        watch.LEARNING: 'learning the quiet record: the drive has to be healthy',
        watch.STALE: 'stale input: the drive sends nothing; going on when it does',
        watch.BAD_INPUT: 'bad input: ' + '; '.join(
            f'{name}: {what}' for name, what in sorted(twin.bad_signals().items())),
    }[state], values


def _agreement(twin: Twin) -> str:
    if twin.outside is not None:
        return 'ok: the drive and its twin agree'
    why = twin.tuned.removeprefix('not tuned: ') or 'the twin was not tuned to it'
    return f'ok: {_AS_LEARNED}, which was not compared with the configuration: {why}'
