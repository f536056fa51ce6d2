# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of steps of runs, which are kept while runs differ in their numbers alone."""

from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

from antenna_drive.diagnosis.disturbances import DriveDisturbance
from antenna_drive.diagnosis.excitation import Bias, Longest, schedule, with_bias
from antenna_drive.diagnosis.field_test import FieldTest
from antenna_drive.diagnosis.modifiers import RunSetup
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import place_of
import numpy as np
from simgap.machine.contract import Course

# Tables that are kept: a test has one for each bias voltage and each wave.
_KEPT_PLANS = 24
# By number: late jumps of the command [s], or other means in its holes [rad/s].
_Numbered: TypeAlias = tuple[tuple[int, float], ...]


class Plans:
    """The tables of steps of the last runs of some tests."""

    def __init__(self, tests: Sequence[FieldTest]) -> None:
        self._tests = tests
        self._kept = lru_cache(_KEPT_PLANS)(self._made)

    def steps(self, k: int, run: RunSetup, longest: Longest) -> batch.Schedule:
        """Return the steps of a run of test k, none of which is longer than allowed."""
        return self._kept(k, longest, run.delay, tuple(run.late_jumps.items()),
                          tuple(run.hole_means.items()), run.bias)

    def _made(self, k: int, longest: Longest, delay: float, late_jumps: _Numbered,
              hole_means: _Numbered, bias: Bias) -> batch.Schedule:
        test = self._tests[k]
        if bias != test.bias:
            return with_bias(
                self._kept(k, longest, delay, late_jumps, hole_means, test.bias), bias)
        command = test.command
        if isinstance(command, RecordedCommand):
            for number, later in late_jumps:
                command = command.with_jump(number, later)
            for number, more in hole_means:
                command = command.with_mean(number, more)
        return schedule(command, bias, test.output_times, longest, delay)


def disturbed(plan: batch.Schedule, run: RunSetup, place: DriveDisturbance,
              course: Course) -> batch.Schedule:
    """Return a plan that lets an input into the drive, and set the drive's record up for it."""
    for path, how, value in place.settings:
        run.change(path, how, value)
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    steps[:, batch.CHANGE] = place.size * course(np.cumsum(length) - 0.5 * length)
    return batch.Schedule(steps, plan.keep, place_of(run.kind, place.path))
