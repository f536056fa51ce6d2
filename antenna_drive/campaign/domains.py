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
        """
        Claim a free domain.

        Raises
        ------
        RuntimeError : all of them are taken

        """
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
