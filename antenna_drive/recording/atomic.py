# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""New files and folders that appear whole or not at all, and never in the place of another."""

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import shutil
import tempfile
from typing import IO

from simgap.drafts import drafted, umask
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


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Give a folder that becomes `path` if all goes well; RecordingError if it cannot."""
    refuse_existing(path)
    try:
        draft = Path(tempfile.mkdtemp(dir=path.parent, prefix=f'.{path.name}.'))
    except OSError as error:
        raise refuse_io(path, error) from error
    try:
        yield draft
        draft.chmod(0o777 & ~umask())
        refuse_existing(path)
        os.rename(draft, path)
    except OSError as error:
        raise refuse_io(path, error) from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)
