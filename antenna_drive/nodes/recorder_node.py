# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder on ROS 2: frames and changes in, bags out."""

from collections.abc import Sequence
from datetime import datetime
import math
from pathlib import Path
import time
from typing import Any

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep.entry import ros_node, stopped_by_signals
from antenna_drive.lockstep.frame import two_of_one_name
from antenna_drive.lockstep.observer import Observer
from antenna_drive.lockstep.ros_parameters import Overrides
from antenna_drive.lockstep.starting import Absence
from antenna_drive.recording.bag_writer import SPLIT_S
from antenna_drive.recording.recorder import RunRecorder
from antenna_drive.recording.sheet import load_sheet
from rclpy.node import Node
from simgap.inputs.schema import Entry
from simgap.logs.channel import RecordingError

NAME = 'recorder'
OK, FAILED = 0, 1
# How long a new run may take to send its configuration before a warning, and before a bag may end
# without it [s].
_PATIENCE_S = 5.0
_TIME = Entry('s', 0.0)


def run(arguments: Sequence[str]) -> int:
    """
    Record until SIGINT or SIGTERM; the arguments are without the program's name.

    Returns 0 if everything was recorded, 1 if a bag could not be written, steps were lost, or two
    nodes of one name took part.

    Raises UserError: wrong arguments, an existing target, a wrong test sheet.
    """
    with ros_node(NAME, arguments, 'out:=my_run') as node:
        return _RecorderNode(node).spin()


class _RecorderNode:
    """Hands the steps of a drive to a RunRecorder."""

    def __init__(self, node: Node) -> None:
        self._log = node.get_logger()
        overrides = Overrides(node)
        out = overrides.text('out') or f'recording_{datetime.now():%Y-%m-%d_%H-%M-%S}'
        sheet = overrides.text('sheet')
        sync_s = overrides.number('sync', _TIME, 0.0)  # 0: at the end of each storage file
        split_s = overrides.number('split', _TIME, SPLIT_S)  # 0: never
        overrides.check_all_known(('out', 'sheet', 'sync', 'split'))
        self._recorder = RunRecorder(
            out, {f'{unit}/{s.name}': s.unit for unit, own in OUTPUTS.items() for s in own},
            load_sheet(Path(sheet)) if sheet else None, sync_s=sync_s or None,
            split_s=split_s or math.inf, recorded_by=NAME)
        self._failed = False  # in this run
        self._ever_failed = False
        self._told_lost = 0
        self._told_refused = 0
        self._told_doubled: set[str] = set()
        self._ask_by = math.inf
        self._stop = stopped_by_signals()
        self._observer = Observer(node, self._step, on_begin=self._begin,
                                  on_change=self._recorder.told)
        self._absence = Absence(node, self._observer.publishers)

    def spin(self) -> int:
        """Record until told to stop; return the exit code."""
        with self._observer as observer:
            observer.spin(self._look)
            observer.finish()
            self._guarded(self._recorder.close)
            self._look()
        if self._recorder.steps and not self._failed:
            self._log.info(f'{self._recorder.steps} steps recorded to {self._recorder.path}')
        return FAILED if self._ever_failed or observer.lost or observer.doubled else OK

    def _begin(self, run: int, step_s: float) -> None:
        self._guarded(self._recorder.close)
        self._failed = False
        self._ask_by = time.monotonic() + _PATIENCE_S
        self._guarded(self._recorder.begin, run, step_s)

    def _step(self, number: int, time_s: float, samples: FloatArray) -> None:
        # a drive that waits for us goes on even if the disk is full
        self._guarded(self._recorder.step, number, samples[:, 0].tolist())
        if self._recorder.steps == 1 and not self._failed:
            self._log.info(f'run {self._observer.run}: recording from step {number} on to '
                           f'{self._recorder.path}')

    def _guarded(self, write: Any, *arguments: Any) -> None:
        if self._failed:
            return
        try:
            write(*arguments)
        except RecordingError as error:
            self._failed = self._ever_failed = True
            self._log.error(f'{error}; the drive goes on without being recorded')

    def _look(self) -> bool:
        """Say what is new of the recording, and return whether it is to end."""
        now, observer = time.monotonic(), self._observer
        if observer.idle:
            self._guarded(self._recorder.idle)
            self._absence.look(now)
        if observer.lost > self._told_lost:
            self._told_lost = observer.lost
            self._log.error(f'{observer.lost} steps lost: the recorder or the machine is too '
                            'slow, or a node was killed before it had sent them; '
                            '-p run.observers:=[recorder] on test_signal makes the drive wait')
        for unit in observer.doubled.keys() - self._told_doubled:
            self._told_doubled.add(unit)
            self._log.error(f'{two_of_one_name(unit, observer.doubled[unit])}: nobody knows whose '
                            'values the others used')
        refused = self._recorder.refused + observer.refused
        if refused > self._told_refused:
            self._told_refused = refused
            self._log.warning(f'{refused} messages refused: they are no frame or no change of '
                              'this drive')
        if now > self._ask_by:
            self._ask_by = math.inf
            if not self._recorder.knows_configuration:
                self._log.warning('not every node tells its parameters: the bag lacks them')
        return self._stop.is_set() and (
            self._failed or self._ask_by == math.inf or self._recorder.knows_configuration)
