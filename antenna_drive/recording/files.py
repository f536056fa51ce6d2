# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Read a recording, whatever format it is in."""

from pathlib import Path

from antenna_drive.recording.csv_format import read_csv
from antenna_drive.recording.recording import Recording
from simgap.logs.channel import RecordingError


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
        raise RecordingError(f'{path}: no recording; allowed are a bag (a folder, .mcap or '
                             '.mcap.zstd) and .csv')
    return read_csv(path)
