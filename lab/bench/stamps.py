# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Times of a node's steps and its processor time, kept in memory until the end of the run."""

from __future__ import annotations

import math
import os
from pathlib import Path
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# Warm-up steps before the measurement: caches fill and Python specialises its bytecode.
WARM_STEPS = 300


class Stamps:
    """The times of one process' steps, on the clock that all processes share."""

    def __init__(self, path: str | os.PathLike[str], last: int) -> None:
        """Prepare to write to `path` after step `last`."""
        self._path = Path(path)
        self._last = last
        self._times = np.zeros(last + 1, np.int64)
        self._cpu_s = math.nan  # until the warm-up is noted
        self.due_s = math.nan  # when step 0 was due, set by a process that paces the run

    def note(self, step: int) -> None:
        """
        Record that `step` is complete and about to be published.

        Recorded before it is published, it is never later than a peer's step that depends on it.
        """
        if step > self._last:
            return
        self._times[step] = time.monotonic_ns()
        self._note_time_used(step)

    def note_all(self, times: NDArray[np.float64], first: int, last: int) -> None:
        """Record the times [s] that a compiled loop has noted of steps `first` to `last`."""
        last = min(last, self._last)
        self._times[first:last + 1] = 1e9 * times[first:last + 1]
        self._note_time_used(last)

    def _note_time_used(self, step: int) -> None:
        if step == WARM_STEPS:
            self._cpu_s = time.process_time()
        elif step == self._last:
            self._write(time.process_time() - self._cpu_s)

    def _write(self, cpu_s: float) -> None:
        draft = self._path.with_suffix('.part')
        with draft.open('wb') as stream:
            np.savez(stream, times=self._times, cpu_s=cpu_s, due_s=self.due_s)
        draft.replace(self._path)


class Stamped(NamedTuple):
    """The records of one process."""

    times: NDArray[np.float64]  # of each step, shape (last + 1,) [s]
    cpu_s: float                # processor time from the end of the warm-up to the last step
    due_s: float                # when step 0 was due, NaN if this process did not pace the run


def read(path: Path) -> Stamped:
    """Return the records that `Stamps` has written."""
    with np.load(path) as found:
        return Stamped(found['times'] * 1e-9, float(found['cpu_s']), float(found['due_s']))
