# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 domains that no other program of this package uses on this machine."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
import tempfile
from types import TracebackType
from typing import IO

# Domains 0 to 101 use ports that no operating system hands out; 0 is where people work.
DOMAINS = range(1, 102)


class DomainClaim:
    """A ROS 2 domain that no other claim on this machine has while this one holds it."""

    def __init__(self) -> None:
        """Claim a free domain; raise RuntimeError where all are taken."""
        # Each process starts at a different place. Programs that claim nothing also use domains,
        # and this makes it unlikely to meet one.
        start = os.getpid() % len(DOMAINS)
        for number in (*DOMAINS[start:], *DOMAINS[:start]):
            path = Path(tempfile.gettempdir(), f'antenna_drive-test-domain-{number}.lock')
            lock = path.open('w')
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                lock.close()
                continue
            self.number = number
            self._lock: IO[str] = lock
            return
        raise RuntimeError('every ROS 2 domain is taken by another process')

    def release(self) -> None:
        """Give the domain back."""
        self._lock.close()

    def __enter__(self) -> DomainClaim:
        """Return the claim."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        """Give the domain back."""
        self.release()
