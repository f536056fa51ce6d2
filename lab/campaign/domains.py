# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 domains that no other program of this package uses on this machine."""

from collections.abc import Iterator
from contextlib import contextmanager
import fcntl
import os
from pathlib import Path
import tempfile

# Domains 0 to 101 use ports that no operating system hands out; 0 is where people work.
DOMAINS = range(1, 102)


@contextmanager
def claimed_domain() -> Iterator[int]:
    """
    Give a domain that no other claim on this machine has meanwhile.

    Raise RuntimeError where all are taken.
    """
    # Each process starts at a different place. Programs that claim nothing also use domains,
    # and this makes it unlikely to meet one.
    start = os.getpid() % len(DOMAINS)
    for number in (*DOMAINS[start:], *DOMAINS[:start]):
        path = Path(tempfile.gettempdir(), f'antenna_drive-test-domain-{number}.lock')
        with path.open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield number
            return
    raise RuntimeError('every ROS 2 domain is taken by another process')
