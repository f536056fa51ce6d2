# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks for workers of other processes, which import them from here."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import resource
from typing import Any

from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.recording import Recording


def square(number: int) -> int:
    return number * number


def fail(number: int) -> int:
    raise ValueError(f'task {number}')


def end_worker(number: int) -> int:
    os._exit(1)


def told(folder: str, number: int, victims: int) -> int:
    """
    Note that a task has begun, and by whom; of some tasks, wait when begun for the first time.

    The wait ends only with the worker: nobody ever writes to the pipe.
    """
    notes = Path(folder, f'task-{number}')
    with notes.open('a') as stream:
        stream.write(f'{os.getpid()}\n')
    if number < victims and len(notes.read_text().splitlines()) == 1:
        Path(folder, f'waiting-{number}').write_text(str(os.getpid()))
        Path(folder, 'nothing').open().read()
    return square(number)


def large(megabytes: int) -> tuple[bytes, int, float]:
    """Return bytes, the process, and the most memory that it has had so far [MB]."""
    return (bytes(megabytes * 2**20), os.getpid(),
            resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


def lengths_found(recordings: Mapping[str, Recording], drive: Drive) -> dict[str, Any]:
    """Stand in for a diagnosis: what has arrived is in the names of the effects."""
    answers = [f'{name}, {len(found[RATE_COMMAND])} samples' for name, found in recordings.items()]
    return {'which': [{'effects': answers, 'probability': 1.0}], 'confusable': [],
            'planning': {'circuit': drive.torque_share.circuit.saturation_high}}
