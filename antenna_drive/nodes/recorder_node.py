# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder on ROS 2: frames and changes in, bags out."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from functools import partial
import math
from pathlib import Path
import signal
import time
from types import FrameType
from typing import Any

from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.lockstep.changes import read_record
from antenna_drive.lockstep.entry import ros_node
from antenna_drive.lockstep.following import Follower, Step
from antenna_drive.lockstep.frame import FrameLayout, new_sender, two_of_one_name
from antenna_drive.lockstep.readings import CHANGES_QOS
from antenna_drive.lockstep.ros_link import FrameLink
from antenna_drive.lockstep.serving import Serving
from antenna_drive.lockstep.starting import Absence
from antenna_drive.recording.bag_writer import SPLIT_S
from antenna_drive.recording.recorder import RunRecorder
from antenna_drive.recording.sheet import load_sheet
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from simgap.errors import UserError
from simgap.logs.channel import RecordingError
from std_msgs.msg import String

NAME = 'recorder'
OK, FAILED = 0, 1
# No wait is longer than this [s]; then what was written is made safe.
_LONGEST_WAIT_S = 0.25
# How long a new run may take to send its configuration before a warning [s].
_PATIENCE_S = 5.0


def run(arguments: Sequence[str]) -> int:
    """
    Record until SIGINT or SIGTERM; the arguments are without the program's name.

    Returns 0 if everything was recorded, 1 if a bag could not be written, steps were lost, or two
    nodes of one name took part.

    Raises UserError: wrong arguments, an existing target, a wrong test sheet.
    """
    with ros_node(NAME, arguments, 'out:=my_run', undeclared=False) as node:
        return _RecorderNode(node).spin()


def _text(node: Node, name: str, default: str) -> str:
    """Return a parameter that is a text."""
    given = node.declare_parameter(name, default, ParameterDescriptor(dynamic_typing=True)).value
    if not isinstance(given, str):
        raise UserError(f'{name}: {given!r} given, allowed is a text')
    return given


def _seconds(node: Node, name: str, default: float, description: str) -> float | None:
    """Return a parameter that is a time [s]; None for 0."""
    given: Any = node.declare_parameter(name, default, ParameterDescriptor(
        description=f'{description} [s]', dynamic_typing=True)).value
    if isinstance(given, bool) or not isinstance(given, (int, float)) or not given >= 0.0:
        raise UserError(f'{name}: {given!r} given, allowed is a time in seconds, 0 or more')
    return float(given) or None


class _RecorderNode:
    """Follows the drive's frames and hands its steps to a RunRecorder."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._log = node.get_logger()
        default = f'recording_{datetime.now():%Y-%m-%d_%H-%M-%S}'
        out, sheet = _text(node, 'out', default), _text(node, 'sheet', '')
        sync_s = _seconds(node, 'sync', 0.0, 'after how long the disk is made to hold what was '
                          'written, 0: at the end of each storage file')
        split_s = _seconds(node, 'split', SPLIT_S, 'after how long the next storage file begins, '
                           '0: never')
        self._recorder = RunRecorder(
            out, {f'{unit}/{s.name}': s.unit for unit, own in OUTPUTS.items() for s in own},
            load_sheet(Path(sheet)) if sheet else None, sync_s=sync_s,
            split_s=split_s or math.inf, recorded_by=NAME)
        layouts = {unit: FrameLayout(signals) for unit, signals in OUTPUTS.items()}
        self._follower = Follower({u: layout.length for u, layout in layouts.items()}, TEST_SIGNAL)
        self._own, self._sender = FrameLayout(()), new_sender()
        self._link = FrameLink(node, layouts)
        self._run = 0
        self._failed = False  # in this run
        self._ever_failed = False
        self._stop = False
        self._told_lost = 0
        self._told_refused = 0
        self._told_doubled: set[str] = set()
        self._ask_by = float('inf')
        for unit in OUTPUTS:
            node.create_subscription(String, f'{unit}/changes', partial(self._listen, unit),
                                     CHANGES_QOS)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._end)

    def _listen(self, unit: str, message: String) -> None:
        self._recorder.told(unit, read_record(message.data))

    def _end(self, number: int, frame: FrameType | None) -> None:
        self._stop = True

    def spin(self) -> int:
        """Record until told to stop; return the exit code."""
        serving = Serving(self._node)
        self._link.publish(self._own.hello(float(time.time_ns() // 1000), self._sender))
        absence = Absence(self._node, self._link.publishers)
        try:
            while not self._stop:
                came = self._link.wait(tuple(OUTPUTS), _LONGEST_WAIT_S)
                self._gather(came)
                if not came:
                    self._guarded(self._recorder.idle)
                    absence.look(time.monotonic())
                self._look()
            self._follower.finish()
            self._gather(OUTPUTS)
            self._guarded(self._recorder.close)
            self._look()
        finally:
            serving.close()
        if self._recorder.steps and not self._failed:
            self._log.info(f'{self._recorder.steps} steps recorded to {self._recorder.path}')
        return (FAILED if self._ever_failed or self._follower.lost or self._follower.doubled
                else OK)

    def _gather(self, peers: Iterable[str]) -> None:
        for peer in peers:
            while (frame := self._link.take(peer)) is not None:
                self._follower.receive(peer, frame)
        for step in self._follower.steps():
            self._take(step)

    def _take(self, step: Step) -> None:
        if step.run != self._run:
            self._run = step.run
            self._guarded(self._recorder.close)
            self._failed = False
            self._ask_by = time.monotonic() + _PATIENCE_S
            if self._guarded(self._recorder.begin, step.run, step.step_s):
                self._log.info(f'run {step.run}: recording from step {step.number} on to '
                               f'{self._recorder.path}')
            self._publish(step, step.number)
        if not self._failed:
            self._guarded(self._recorder.step, step.number, step.values)
        # a drive that waits for us goes on even if the disk is full
        self._publish(step, step.number + 1)

    def _publish(self, step: Step, number: int) -> None:
        self._link.publish(self._own.encode(step.run, number, step.step_s, self._sender))

    def _guarded(self, write: Any, *arguments: Any) -> bool:
        if self._failed:
            return False
        try:
            write(*arguments)
        except RecordingError as error:
            self._failed = self._ever_failed = True
            self._log.error(f'{error}; the drive goes on without being recorded')
            return False
        return True

    def _look(self) -> None:
        lost = self._follower.lost
        if lost > self._told_lost:
            self._log.error(f'{lost} steps lost: the recorder or the machine is too slow, or a '
                            'node was killed before it had sent them; '
                            '-p run.observers:=[recorder] on test_signal makes the drive wait')
        self._told_lost = lost
        for unit in self._follower.doubled.keys() - self._told_doubled:
            self._log.error(f'{two_of_one_name(unit, self._follower.doubled[unit])}: nobody knows '
                            'whose values the others used')
            self._told_doubled.add(unit)
        refused = self._recorder.refused + self._follower.refused
        if refused > self._told_refused:
            self._log.warning(f'{refused} messages refused: they are no frame or no change of '
                              'this drive')
        self._told_refused = refused
        if time.monotonic() > self._ask_by:
            self._ask_by = float('inf')
            if not self._recorder.knows_configuration:
                self._log.warning('not every node tells its parameters: the bag lacks them')
