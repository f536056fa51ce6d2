# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the drive in its five processes, every sample of it in an array."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import time

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.units import home
from antenna_drive.emulator.wiring import TEST_SIGNAL
from antenna_drive.lockstep.frame import process_of, two_of_one_name
from antenna_drive.lockstep.namespaces import AnotherDrive, drive_namespace
from antenna_drive.lockstep.observer import Observer
from antenna_drive.lockstep.processes import DriveProcesses, Parameter
import numpy as np
from simgap.errors import UserError

# How long the processes may take until they begin, and then from step to step [s].
BEGIN_PATIENCE_S = 120.0
STEP_PATIENCE_S = 30.0


@dataclass(frozen=True)
class Sampled:
    """What a run in five processes gave."""

    names: tuple[str, ...]  # the signals, 'unit/signal'
    samples: FloatArray  # shape (steps + 1, len(names), 2), value and time derivative
    processes: int  # how many ran
    wall_s: float  # from frame 0 to the last [s]
    first_step_s: float  # from the start of the last process to frame 0 of all [s]


def sample_processes(steps: int, step_s: float, *, name: str = 'observer',
                     settings: Mapping[str, Parameter] | None = None,
                     config: Sequence[str] = (),
                     progress: Callable[[int], None] | None = None) -> Sampled:
    """
    Run the drive in five processes, as fast as possible, and keep every sample of every signal.

    steps, step_s : number and length [s] of the macro-steps
    name : name of the observing node, and of the namespace of the drive's own in which it runs
    settings : parameters of the drive by dotted name, such as 'torque_share.circuit.bias_pot'
    config : see DriveProcesses
    progress : called with the step about ten times a second

    Raises AnotherDrive: nodes of others have taken part.
    Raises UserError: a process has ended by itself or the drive does not go on.
    """
    given: dict[str, dict[str, Parameter]] = {
        TEST_SIGNAL: {'run.step': float(step_s), 'run.pace': 0.0,
                      'run.duration': steps * step_s, 'run.observers': [name]}}
    for parameter, value in (settings or {}).items():
        unit, key = home(parameter)
        given.setdefault(unit, {})[key] = value
    watch = RunWatch(steps, progress)
    moments: dict[str, float] = {}

    def begin(run: int, step_s: float) -> None:
        watch.done = -1

    def take(k: int, time_s: float, values: FloatArray) -> None:
        if k != watch.done + 1:
            raise UserError(f'steps {watch.done + 1} to {k - 1} were lost: a node has ended '
                            'before it had sent them, or this process was stopped')
        if k in (0, steps):
            moments['began' if k == 0 else 'ended'] = time.monotonic()
        if k <= steps:
            samples[k] = values
        watch.done = k

    with drive_namespace(None, name) as space, Observer(
            name, take, on_begin=begin, namespace=space) as observer, \
            DriveProcesses(given, config=config, namespace=space) as processes:
        moments['started'] = time.monotonic()
        samples = np.zeros((steps + 1, len(observer.names), 2))
        observer.spin(lambda: watch.complete(processes, observer))
    return Sampled(observer.names, samples, len(processes.order),
                   moments['ended'] - moments['began'], moments['began'] - moments['started'])


class RunWatch:
    """
    How far a run of the processes is, and whether it goes on.

    done : the last step that was received, -1 for none
    deadline : when the next step must have come, on the clock of time.monotonic() [s]
    """

    def __init__(self, last: int, progress: Callable[[int], None] | None = None) -> None:
        """Watch a run up to its step `last`; `progress` is called with the step now and then."""
        self.done = -1
        self.deadline = time.monotonic() + BEGIN_PATIENCE_S
        self._last = last
        self._progress = progress
        self._seen = -1
        self._next_look = 0.0

    def complete(self, processes: DriveProcesses, observer: Observer) -> bool:
        """
        Return whether the last step has come.

        Raises AnotherDrive: frames have come from a process that is none of these.
        Raises UserError: a process has ended, or no step comes any more.
        """
        now = time.monotonic()
        if self.done < self._last and now < self._next_look:
            return False
        self._next_look = now + 0.1
        _check_senders(processes, observer)
        if self.done >= self._last:
            return True
        processes.check()
        if self.done != self._seen or observer.paused:
            self._seen, self.deadline = self.done, now + STEP_PATIENCE_S
            if self._progress is not None:
                self._progress(self.done)
        if now > self.deadline:
            raise UserError(f'the drive does not go on at step {self.done + 1}: waiting for '
                            f'{", ".join(observer.missing)}')
        return False


def _check_senders(processes: DriveProcesses, observer: Observer) -> None:
    for unit, senders in observer.doubled.items():
        raise AnotherDrive(f'{two_of_one_name(unit, senders)}: nobody knows whose values the '
                           'others used')
    for unit, count in observer.publishers().items():
        if count > 1:
            raise AnotherDrive(f'{count} nodes are called {unit}; end all but one, or give each '
                               'drive a namespace of its own')
    for unit, sender in observer.senders.items():
        if process_of(sender) != processes.process(unit).pid:
            raise AnotherDrive(f'{unit}: its frames come from process {process_of(sender)}, which '
                               'is none of this drive; give each drive a namespace of its own')
