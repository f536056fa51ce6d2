# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of steps of runs, which are kept while runs differ in their numbers alone."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock
from typing import TypeAlias

from antenna_drive.diagnosis import gust
from antenna_drive.diagnosis.disturbances import DriveDisturbance
from antenna_drive.diagnosis.excitation import Bias, Longest, schedule, with_bias, with_torque
from antenna_drive.diagnosis.field_test import FieldTest
from antenna_drive.diagnosis.modifiers import change, RunSetup
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import place_of
import numpy as np
from simgap.machine.contract import Course

# Tables that are kept: a test has one for each bias voltage and each wave.
_KEPT_PLANS = 24
# By number: late jumps of the command [s], or other means in its holes [rad/s].
_Numbered: TypeAlias = tuple[tuple[int, float], ...]
# Test, longest step, delay of the command [s], what it did unrecorded, source of the bias.
_PlanKey: TypeAlias = tuple[int, Longest, float, tuple[_Numbered, _Numbered], Bias]


class Plans:
    """The tables of steps of the last runs."""

    def __init__(self) -> None:
        self._plans: OrderedDict[_PlanKey, batch.Schedule] = OrderedDict()
        self._lock = Lock()

    def steps(self, k: int, test: FieldTest, run: RunSetup, longest: Longest) -> batch.Schedule:
        """Return the steps of a run of test k, none of which is longer than allowed."""
        unrecorded = (tuple(run.late_jumps.items()), tuple(run.hole_means.items()))

        def planned() -> batch.Schedule:
            command = test.command
            if isinstance(command, RecordedCommand):
                for number, later in run.late_jumps.items():
                    command = command.with_jump(number, later)
                for number, more in run.hole_means.items():
                    command = command.with_mean(number, more)
            return schedule(command, test.bias, test.output_times, longest, run.delay)

        key = (k, longest, run.delay, unrecorded)
        plan = self._kept((*key, run.bias), lambda: with_bias(
            self._kept((*key, test.bias), planned), run.bias))
        return plan if run.gust is None else with_torque(plan, *gust.course(run.gust))

    def _kept(self, key: _PlanKey, made: Callable[[], batch.Schedule]) -> batch.Schedule:
        """Return the table of steps of a test, made if it is not known."""
        plan = self._plans.get(key) or made()
        with self._lock:
            self._plans[key] = plan
            self._plans.move_to_end(key)
            while len(self._plans) > _KEPT_PLANS:
                self._plans.popitem(last=False)
        return plan


def disturbed(plan: batch.Schedule, run: RunSetup, place: DriveDisturbance,
              course: Course) -> batch.Schedule:
    """Return a plan that lets an input into the drive, and set the drive's record up for it."""
    for path, how, value in place.settings:
        change(run.numbers, place_of(run.kind, path), how, value)
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    steps[:, batch.CHANGE] = place.size * course(np.cumsum(length) - 0.5 * length)
    return batch.Schedule(steps, plan.keep, place_of(run.kind, place.path))
