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
"""One run of the drive in its five processes, every sample of it in an array."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import time

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.wiring import TEST_SIGNAL
from antenna_drive.errors import UserError
from antenna_drive.lockstep.observer import Observer
from antenna_drive.lockstep.processes import DriveProcesses, Parameter
import numpy as np

# How long the processes may take until they begin, and then from step to step [s].
BEGIN_PATIENCE_S = 120.0
STEP_PATIENCE_S = 30.0


@dataclass(frozen=True)
class Sampled:
    """
    What a run in five processes gave.

    Attributes
    ----------
    names : the signals, 'unit/signal'
    samples : shape (steps + 1, len(names), 2), value and time derivative
    processes : how many ran
    wall_s : from frame 0 to the last [s]
    first_step_s : from the start of the last process to frame 0 of all [s]

    """

    names: tuple[str, ...]
    samples: FloatArray
    processes: int
    wall_s: float
    first_step_s: float


def sample_processes(steps: int, step_s: float, *, name: str = 'observer',
                     parameters: Mapping[str, Mapping[str, Parameter]] | None = None,
                     config: Sequence[str] = (), pace: float = 0.0, namespace: str = '',
                     domain_id: int | None = None,
                     progress: Callable[[int], None] | None = None) -> Sampled:
    """
    Run the drive in five processes and keep every sample of every signal.

    Parameters
    ----------
    steps, step_s
        number and length [s] of the macro-steps
    name
        name of the observing node
    parameters, config, namespace, domain_id
        see DriveProcesses
    pace
        how many times faster than real time, 0 for as fast as possible
    progress
        called with the step about ten times a second

    Raises
    ------
    UserError : a process has ended by itself or the drive does not go on

    """
    given = {unit: dict(values) for unit, values in (parameters or {}).items()}
    given[TEST_SIGNAL] = {**given.get(TEST_SIGNAL, {}), 'run.step': float(step_s),
                          'run.pace': float(pace), 'run.duration': steps * step_s,
                          'run.observers': [name]}
    processes = DriveProcesses(given, config=config, namespace=namespace, domain_id=domain_id)
    collected = _Collected(steps, progress)
    with Observer(name, collected.step, on_begin=collected.begin, namespace=namespace,
                  domain_id=domain_id) as observer, processes:
        collected.made(observer.names)
        collected.watch(processes, observer)
        observer.spin(collected.complete)
        return Sampled(observer.names, collected.samples, len(processes.order),
                       collected.ended - collected.began, collected.began - collected.started)


class _Collected:
    """The samples so far, and the watch over those who make them."""

    def __init__(self, steps: int, progress: Callable[[int], None] | None) -> None:
        self._steps = steps
        self._progress = progress
        self._done = self._seen = -1
        self.samples = np.zeros((0, 0, 2))
        self.began = self.ended = self.started = 0.0

    def made(self, names: Sequence[str]) -> None:
        self.samples = np.zeros((self._steps + 1, len(names), 2))

    def watch(self, processes: DriveProcesses, observer: Observer) -> None:
        self._processes = processes
        self._observer = observer
        self.started = time.monotonic()
        self._next_look = self.started
        self._deadline = self.started + BEGIN_PATIENCE_S

    def begin(self, run: int, step_s: float) -> None:
        self._done = -1

    def step(self, k: int, time_s: float, samples: FloatArray) -> None:
        if k == 0:
            self.began = time.monotonic()
        if k <= self._steps:
            self.samples[k] = samples
            self._done = k
            if k == self._steps:
                self.ended = time.monotonic()

    def complete(self) -> bool:
        if self._done >= self._steps:
            return True
        now = time.monotonic()
        if now >= self._next_look:
            self._next_look = now + 0.1
            self._look(now)
        return False

    def _look(self, now: float) -> None:
        self._processes.check()
        if self._done != self._seen:
            self._seen = self._done
            self._deadline = now + STEP_PATIENCE_S
            if self._progress is not None:
                self._progress(self._done)
        if now > self._deadline:
            raise UserError(f'the drive does not go on at step {self._done + 1}: waiting for '
                            f'{", ".join(self._observer.missing)}')
