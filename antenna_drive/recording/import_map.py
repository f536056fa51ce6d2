# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Somebody else's file as a recording of the drive, read as a map describes it."""

from pathlib import Path

from antenna_drive.emulator.wiring import signal_names
from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.recording import Recording, unit_of
from antenna_drive.recording.sheet import load_sheet, TestSheet
from simgap.logs import column_map
from simgap.logs.column_map import ImportMap, KnownSignals
from simgap.logs.mapped import read_mapped

# What a column's unit has to be convertible to: a map's scale makes article amperes of real ones.
DRIVE = KnownSignals('the drive', {name: unit_of(name).removeprefix('article ')
                                   for name in signal_names()}, FIELD_COLUMNS)


def load_map(path: str | Path) -> ImportMap:
    """
    Read a map whose signals may be the drive's own.

    Raises ParameterError: as in `column_map.load_map`.
    """
    return column_map.load_map(path, DRIVE)


def parse_map(tree: object) -> ImportMap:
    """Check the plain data of such a map; errors as in `load_map`."""
    return column_map.parse_map(tree, DRIVE)


def import_file(path: str | Path, import_map: ImportMap) -> Recording:
    """
    Read a file of any kind that `tables` knows, and the test sheet NAME.yaml beside it.

    Raises RecordingError: the file cannot be read as the map says, see `read_mapped`.
    Raises ParameterError: NAME.yaml is no test sheet.
    """
    path = Path(path)
    channels = read_mapped(path, import_map)
    beside = path.with_suffix('.yaml')
    return Recording(channels, sheet=load_sheet(beside) if beside.is_file() else TestSheet(),
                     notes={'source': path.name, 'import_map': import_map.source})
