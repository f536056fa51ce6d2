# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Read a recording, whatever format it is in: one of ours, or what a map describes."""

from functools import partial
from pathlib import Path

from antenna_drive.emulator import wiring
from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.csv_format import read_csv
from antenna_drive.recording.recording import Recording, unit_of
from antenna_drive.recording.sheet import load_sheet, TestSheet
from simgap.logs import column_map
from simgap.logs.bags import REMEDY
from simgap.logs.channel import RecordingError
from simgap.logs.column_map import ImportMap, KnownSignals
from simgap.logs.mapped import read_file

# What a column's unit has to be convertible to: a map's scale makes article amperes of real ones.
DRIVE = KnownSignals('the drive', {name: unit_of(name).removeprefix('article ')
                                   for name in wiring.DRIVE.signals}, FIELD_COLUMNS)


def read_recording(path: str | Path, *, partial: bool = False) -> Recording:
    """
    Read a rosbag2 folder, or a file .mcap, .mcap.zstd or .csv.

    path : the folder or file
    partial : read what can be read of a bag that was cut off or damaged

    Raises RecordingError: there is nothing at `path`, or it is no recording that can be read.
    Raises ParameterError: the test sheet beside a CSV is none.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f'{path}: no such file or folder')
    if path.is_dir() or path.name.endswith(('.mcap', '.mcap.zstd')):
        # CSV needs no library: the one for MCAP is asked for only where it is used
        from antenna_drive.recording.bag_reader import read_bag
        return read_bag(path, partial=partial)
    if path.suffix != '.csv':
        raise RecordingError(f'{path}: no recording that is read without a map; allowed are a bag '
                             f'(a folder, .mcap or .mcap.zstd) and .csv. {REMEDY}')
    return read_csv(path)


# Of a file, or of plain data, a map whose signals may be the drive's own.
load_map = partial(column_map.load_map, known=DRIVE)
parse_map = partial(column_map.parse_map, known=DRIVE)


def import_file(path: str | Path, import_map: ImportMap) -> Recording:
    """
    Read a file of any kind that `tables` knows, and the test sheet NAME.yaml beside it.

    Raises RecordingError: the file cannot be read as the map says, see `read_file`.
    Raises ParameterError: NAME.yaml is no test sheet.
    """
    path = Path(path)
    channels = dict(read_file(path, import_map).channels)
    beside = path.with_suffix('.yaml')
    return Recording(channels, sheet=load_sheet(beside) if beside.is_file() else TestSheet(),
                     notes={'source': path.name, 'import_map': import_map.source})
