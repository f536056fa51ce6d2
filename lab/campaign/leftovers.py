# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Processes that a trial has started and left behind."""

from collections.abc import Iterable, Mapping
import os
from pathlib import Path
import signal
import time

from antenna_drive.programs import runs

# Set by the campaign for a trial; whatever the trial starts inherits it.
TOKEN = 'ANTENNA_DRIVE_CAMPAIGN'


def alive(marks: Mapping[str, str]) -> list[int]:
    """Return the other processes with all these variables, zombies apart (on Linux)."""
    wanted = {f'{name}={value}'.encode() for name, value in marks.items()}
    found = []
    for folder in Path('/proc').iterdir():
        if folder.name.isdigit() and int(folder.name) != os.getpid():
            try:
                environment = set((folder / 'environ').read_bytes().split(b'\0'))
                if wanted <= environment and runs(int(folder.name)):
                    found.append(int(folder.name))
            except OSError:
                continue
    return found


def wait_for_none(token: str, patience_s: float) -> list[int]:
    """Return the processes with a token that are still there after a while."""
    deadline = time.monotonic() + patience_s
    while (found := alive({TOKEN: token})) and time.monotonic() < deadline:
        time.sleep(0.1)
    return found


def commands(pids: Iterable[int]) -> dict[int, str]:
    """Return the command line of each process that is still there."""
    found = {}
    for pid in pids:
        try:
            words = Path(f'/proc/{pid}/cmdline').read_bytes().split(b'\0')
        except OSError:
            continue
        found[pid] = b' '.join(words).decode(errors='replace').strip()[:300]
    return found


def end(pids: Iterable[int]) -> None:
    """End processes at once."""
    for pid in pids:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue
