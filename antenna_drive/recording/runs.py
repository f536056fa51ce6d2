# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The recording of a run in one process, and the configuration that is kept with it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TYPE_CHECKING

from antenna_drive.emulator.wiring import UNITS
from antenna_drive.recording.recording import Change, Recording
from antenna_drive.recording.sheet import TestSheet

if TYPE_CHECKING:  # the compiled physics is not needed to read a recording
    from antenna_drive.emulator.run import Emulator, Run
    from antenna_drive.emulator.unit import Unit
    from antenna_drive.parameters.sets import Drive

STEP = 'step_s'  # the note that tells the macro-step [s]


def configuration_of(units: Mapping[str, 'Unit']) -> dict[str, Any]:
    """Return every setting in force, unit by unit, as plain data to be kept with a recording."""
    return {name: {key: value for key, (_, value) in unit.settings().items()}
            for name, unit in units.items()}


def from_run(run: 'Run', drive: 'Drive | None' = None, sheet: TestSheet | None = None,
             **notes: Any) -> Recording:
    """
    Return the values of every signal of a run; derivatives are left out.

    run : what the emulator gave
    drive : the parameters that it began with, to be kept as the configuration
    sheet, notes : see Recording

    Raises RecordingError: a value is not finite; the message names the signal and the time.
    """
    configuration = {}
    if drive is not None:
        from antenna_drive.emulator.units import build
        configuration = configuration_of({name: build(name, drive) for name in UNITS})
    return Recording.from_arrays(
        run.time, {name: run[name] for name in run.names}, configuration=configuration,
        changes=tuple(Change(step, unit, values) for step in sorted(run.changes)
                      for unit, values in run.changes[step].items()),
        sheet=sheet or TestSheet(), notes={STEP: run.step_s, **notes})


def record(emulator: 'Emulator', duration: float, **known: Any) -> Recording:
    """
    Run an emulator, and record it with the settings that its own units have.

    emulator : the drive, some of its units perhaps replaced
    duration : [s]
    known : `changes` and `every` for the run; sheet and notes for the recording

    Raises RecordingError: a value is not finite.
    Raises ParameterError: a change is not allowed.
    """
    configuration = configuration_of(emulator.units)
    run = emulator.run(duration, known.pop('changes', None), known.pop('every', 1))
    return replace(from_run(run, **known), configuration=configuration)
