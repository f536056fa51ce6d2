# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A file is written as a draft beside its place, and put there whole."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import tempfile
from typing import IO


@contextmanager
def drafted(path: Path, check: Callable[[Path], object] | None = None) -> Iterator[IO[bytes]]:
    """
    Yield a stream whose content replaces `path` at the end if all went well.

    A reader of `path` sees the old content or all of the new, never a part of it. `check` is
    called with `path` just before the replacement; if it raises, nothing changes. Raises OSError
    if the file cannot be written there.
    """
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=f'.{path.name}.')
    try:
        with open(handle, 'wb') as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            # a draft is readable by its owner only, a result by others too
            os.fchmod(stream.fileno(), 0o666 & ~umask())
        if check is not None:
            check(path)
        os.replace(draft, path)
    finally:
        Path(draft).unlink(missing_ok=True)


def umask() -> int:
    """Return the permissions that new files and folders lack."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
