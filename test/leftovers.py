# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Processes that tests have left behind, wherever they are in the tree of processes."""

from __future__ import annotations

import os
import uuid

from lab.campaign import leftovers

# In the environment of every process that a session of pytest starts; also in that of a process
# whose parent has ended, which no list of children shows.
SESSION = 'ANTENNA_DRIVE_TEST_SESSION'
# pytest-xdist sets it for its workers.
WORKER = 'PYTEST_XDIST_WORKER'


def mark(worker: bool) -> None:
    """
    Mark what this process starts from now on.

    Parameters
    ----------
    worker
        True in a worker of pytest-xdist, which shares the mark of those that started it

    """
    if not worker:
        os.environ[SESSION] = uuid.uuid4().hex
        os.environ.pop(WORKER, None)


def started() -> set[int]:
    """Return the processes that this process has started, and theirs (on Linux)."""
    found = leftovers.alive({
        name: os.environ[name] for name in (SESSION, WORKER) if name in os.environ})
    # the helper of multiprocessing ends with the process that has it
    return {number for number, command in leftovers.commands(sorted(found)).items()
            if 'multiprocessing.resource_tracker' not in command}


def end(processes: set[int]) -> list[str]:
    """End processes at once; return their command lines."""
    commands = leftovers.commands(sorted(processes))
    leftovers.end(commands)
    return list(commands.values())
