# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The recording of a run in one process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, TYPE_CHECKING

from antenna_drive.recording.plain import freeze
from antenna_drive.recording.recording import Change, Recording
from antenna_drive.recording.sheet import TestSheet

if TYPE_CHECKING:  # the compiled physics is not needed to read a recording
    from antenna_drive.emulator.run import Run
    from antenna_drive.parameters.sets import Drive


def configuration_of(drive: Drive) -> Mapping[str, Any]:
    """Return the parameters of a drive as plain data, to be kept with a recording."""
    configuration: Mapping[str, Any] = freeze(asdict(drive))
    return configuration


def from_run(run: Run, drive: Drive | None = None, sheet: TestSheet | None = None,
             **notes: Any) -> Recording:
    """
    Return the values of every signal of a run; derivatives are left out.

    Parameters
    ----------
    run : what the emulator gave
    drive : the parameters it ran with, to be kept as the configuration
    sheet, notes : see Recording

    Raises
    ------
    RecordingError : a value is not finite; the message names the signal and the time

    """
    return Recording.from_arrays(
        run.time, {name: run[name] for name in run.names},
        configuration={} if drive is None else configuration_of(drive),
        changes=tuple(Change(step, unit, values) for step in sorted(run.changes)
                      for unit, values in run.changes[step].items()),
        sheet=sheet or TestSheet(), notes=notes)
