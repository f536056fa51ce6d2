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
"""When a node made which step, and what processor time it took: kept in memory till the end."""

from __future__ import annotations

import math
import os
from pathlib import Path
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# Steps of a run before the measurement begins: caches fill, Python specialises its bytecode.
WARM_STEPS = 300


class Stamps:
    """
    The times at which one process made its steps, on the clock that all processes share.

    Attributes
    ----------
    due_s : when step 0 was due, set by a process that paces the run [s]

    """

    def __init__(self, path: str | os.PathLike[str], last: int) -> None:
        """Prepare to write to `path` once step `last` has been made."""
        self._path = Path(path)
        self._last = last
        self._times = np.zeros(last + 1, np.int64)
        self._cpu_s = 0.0
        self.due_s = math.nan

    def note(self, step: int) -> None:
        """
        Note that `step` is made and about to be published.

        Before it is published: then no peer can have made of it what is noted as earlier.
        """
        if step > self._last:
            return
        self._times[step] = time.monotonic_ns()
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
    """
    What one process noted.

    Attributes
    ----------
    times : when each step was made, shape (last + 1,) [s]
    cpu_s : processor time of the process from the end of the warm steps to the last [s]
    due_s : when step 0 was due, NaN if this process did not pace the run [s]

    """

    times: NDArray[np.float64]
    cpu_s: float
    due_s: float


def read(path: Path) -> Stamped:
    """Return what `Stamps` has written."""
    with np.load(path) as found:
        return Stamped(found['times'] * 1e-9, float(found['cpu_s']), float(found['due_s']))
