# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a recording is whole, and of the drive that was started for it."""

from collections.abc import Mapping, Sequence
import json
from pathlib import Path
from typing import Any

from antenna_drive.emulator.units import build
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep.entry import SHEET
from antenna_drive.parameters import load
from antenna_drive.recording.bag_reader import message_counts
from antenna_drive.recording.sheet_signal import settings_of
from simgap.errors import one_line
from simgap.logs.channel import RecordingError


class IncompleteRecording(RecordingError):
    """A recording lacks what was to be recorded."""

    status = 1


def check_rows(path: Path, rows: int) -> None:
    """Raise IncompleteRecording unless a bag has so many samples of every signal."""
    for topic, count in message_counts(path).items():
        if count != rows:
            raise IncompleteRecording(f'{path}: holds {count} samples of {topic.lstrip("/")} and '
                                      f'not {rows}: the run was broken off or begun again')


def check_settings(path: Path, told: Mapping[str, Any],
                   parameters: Mapping[str, Mapping[str, Any]], config: Sequence[str]) -> None:
    """
    Make sure that each unit has said that it has the parameters which it was to have.

    path : the recording, for the error
    told : by unit, what it has said that is in force
    parameters, config : as `DriveProcesses` takes them

    Raises AnotherDrive: a unit has others.
    Raises IncompleteRecording: a unit has said nothing.
    """
    # the nodes' own parameters need ROS 2, and the room of recordings does not
    from antenna_drive.lockstep.namespaces import AnotherDrive
    from antenna_drive.lockstep.node_parameters import OWN_PARAMETERS
    drive = load(*config)
    for unit in UNITS:
        if unit not in told:
            raise IncompleteRecording(f'{path}: {unit} has not told its parameters; nobody knows '
                                      'which drive this is')
        given = {name: value for name, value in parameters.get(unit, {}).items()
                 if name not in OWN_PARAMETERS}
        if SHEET in given:
            given = {**settings_of(Path(given.pop(SHEET))), **given}
        wanted = {name: value for name, (_, value) in build(unit, drive, given).settings().items()}
        wanted = json.loads(json.dumps(wanted))  # as it travels
        for name in wanted.keys() | told[unit].keys():
            if wanted.get(name) != told[unit].get(name):
                raise AnotherDrive(
                    f'{path}: holds the run of another drive than was asked for: {name} of {unit} '
                    f'is {one_line(told[unit].get(name))} and not {one_line(wanted.get(name))}')
