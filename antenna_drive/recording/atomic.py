# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""New files that appear whole or not at all, and never in the place of another."""

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
from typing import IO

from simgap.drafts import drafted
from simgap.logs.channel import RecordingError


def refuse_existing(path: Path) -> None:
    """Raise RecordingError if something is in the place of a new file or folder."""
    if path.exists() or path.is_symlink():
        raise RecordingError(f'{path}: exists already; remove it or choose another name')


def refuse_io(path: Path, error: OSError) -> RecordingError:
    """Return the one-line error of a file or folder that cannot be written."""
    return RecordingError(f'{path}: cannot be written, {error.strerror or error}')


def sync_folder(path: Path) -> None:
    """Make the disk hold the names of a folder and of the files in it; OSError if it cannot."""
    for folder in (path, path.absolute().parent):
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextmanager
def new_file(path: Path) -> Iterator[IO[bytes]]:
    """Give a stream that becomes a new file if all goes well; RecordingError if it cannot."""
    refuse_existing(path)
    try:
        with drafted(path, refuse_existing) as stream:
            yield stream
    except OSError as error:
        raise refuse_io(path, error) from error
