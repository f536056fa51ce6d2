# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""An investigation of the drive: how its tests are run, recorded and diagnosed."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from antenna_drive.diagnosis.allowed_tests import AntennaTests
from antenna_drive.diagnosis.diagnose import diagnose_recordings
from antenna_drive.diagnosis.drive_limits import DriveLimits
from antenna_drive.diagnosis.sensors import SensorModel
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.files import read_recording
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import dump_sheet, TestSheet
import numpy as np
from simgap.next_test.investigation import Bench, InvestigationPlan
from simgap.search.rival import Rival
from simgap.verdict.diagnosis import Progress
from simgap.verdict.record import Verdict

# Of a recording with added errors of sensors [Hz].
_RATE_HZ = 200.0
# Plays a test on the drive: from its number, the file of its sheet and its length [s] to a
# recording at a path.
RunTest = Callable[[int, Path, float, Path], None]


class DriveBench(Bench):
    """
    A drive on which test sheets are played.

    base : what is known of every test: circuit, bias pot, sensors
    sensors : whose errors are added to recordings; None for a drive that has sensors
    """

    played = 'test_{number}.yaml'

    def __init__(self, drive: Drive, limits: DriveLimits, base: TestSheet, play: RunTest,
                 plan: InvestigationPlan, sensors: SensorModel | None = None,
                 threads: int = 2) -> None:
        self.space = AntennaTests(base, drive, limits, plan.duration)
        self.limits = self.space.limits
        self._drive, self._base, self._play, self._seed = drive, base, play, plan.seed
        self._sensors, self._threads = sensors, threads

    def save(self, test: TestSheet, path: Path) -> None:
        """Write the sheet, with what is known of the sensors."""
        whole = replace(test, sensors=test.sensors or self._base.sensors)
        path.write_text(dump_sheet(whole), encoding='utf-8')

    def run(self, number: int, test: Path, duration: float, out: Path) -> None:
        self._play(number, test, duration, out)

    def diagnose(self, recordings: Mapping[str, Path], progress: Progress,
                 earlier: Sequence[Rival]) -> Verdict:
        found = {}
        for k, (name, path) in enumerate(recordings.items(), 1):
            found[name] = read_recording(path)
            if self._sensors is not None:
                found[name] = sensed(found[name], self._sensors, [self._seed, k])
        return diagnose_recordings(found, self._drive, progress, self._threads, earlier=earlier)


def sensed(recording: Recording, sensors: SensorModel, seed: Sequence[int]) -> Recording:
    """
    Return the recording of an emulated drive as sensors would have read it.

    The nodes give true values at every macro-step. A residual of theirs is smoother than any
    noise, and a verdict would take that for something unknown.
    """
    command = recording[RATE_COMMAND]
    every = slice(None, None, max(1, round(1.0 / _RATE_HZ / float(
        np.median(np.diff(command.time_s))))))
    clean = np.column_stack([recording[name].values for name in SIGNALS])[every]
    readings = sensors.read(clean, np.random.default_rng(seed))
    return Recording.from_arrays(
        command.time_s[every], {RATE_COMMAND: command.values[every], **dict(zip(
            SIGNALS, readings.T, strict=True))}, sheet=recording.sheet)
