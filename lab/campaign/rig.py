# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A drive under trial: its processes, a recorder and observers, and somebody who watches them.

The watcher is a member of the drive. It keeps the first steps of each run, to compare them with a
run in one process, and everything that nodes say in /diagnostics.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
import os
from pathlib import Path
import random
import signal
import sys
from threading import Event, Thread
import time
from types import TracebackType
from typing import Any, NamedTuple

from antenna_drive.emulator.run import simulate
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.wiring import TEST_SIGNAL, UNITS
from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.observer import Observer
from antenna_drive.lockstep.processes import DriveProcesses
from antenna_drive.lockstep.serving import Serving
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
from diagnostic_msgs.msg import DiagnosticArray
from lab.campaign.trials import Outcome
import numpy as np
from rclpy.context import Context
from rclpy.node import Node

WATCHER, RECORDER, OBSERVER = 'watcher', 'recorder', 'observer'
MEMBERS = 'lab.campaign.members'
# A drive whose physics must first be compiled takes this long to begin on a busy machine [s].
PATIENCE_S = 180.0
# Steps of each run that are kept and compared.
KEPT = 3000


class InVainError(Exception):
    """What had to come has not come; `logs` has the end of each process' output by its name."""

    def __init__(self, message: str, logs: Mapping[str, str]) -> None:
        """Say what has not come."""
        super().__init__(message)
        self.logs = dict(logs)


class Said(NamedTuple):
    """A report on /diagnostics: when it came [s], of whom, how bad, its text and values."""

    time_s: float
    namespace: str
    node: str
    level: int
    message: str
    values: Mapping[str, str]


class Diagnostics:
    """Everything that is said on /diagnostics, as it comes."""

    def __init__(self, keep: int = 20_000) -> None:
        """Begin to listen."""
        self.said: deque[Said] = deque(maxlen=keep)
        self.count = 0
        context = Context()
        context.init(args=[])
        self.node = Node('campaign', context=context)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._take, 1000)
        self._serving = Serving(self.node)

    def _take(self, message: DiagnosticArray) -> None:
        now = time.monotonic()
        for status in message.status:
            self.count += 1
            namespace, _, node = status.name.rpartition('/')
            self.said.append(Said(now, namespace, node,
                                  int.from_bytes(status.level, 'little'), status.message,
                                  {item.key: item.value for item in status.values}))

    def since(self, time_s: float) -> list[Said]:
        """Return what was said after a moment, as time.monotonic() tells it."""
        return [said for said in self.said.copy() if said.time_s > time_s]

    def last(self, node: str) -> Said | None:
        """Return what a node said last."""
        return next((said for said in reversed(self.said.copy()) if said.node == node), None)

    def close(self) -> None:
        """Listen no more."""
        self._serving.close()
        leave(self.node)


class Watcher:
    """The first steps of each run of a drive, and how far it is."""

    def __init__(self, namespace: str = '', nap_s: float = 0.0, keep: int = KEPT) -> None:
        """Join the drive, which must be told of the name WATCHER; take a nap at each step [s]."""
        self._keep = keep
        self.step = -1
        self.moved_s = time.monotonic()
        self.runs: list[int] = []
        self.changes: list[tuple[str, Mapping[str, Any]]] = []
        self.history: deque[tuple[float, int, int]] = deque(maxlen=2000)
        self._samples: list[FloatArray] = []
        self._nap_s = nap_s
        self._stop = Event()
        self.fault: BaseException | None = None
        self.observer = Observer(WATCHER, self._take, on_begin=self._begin, namespace=namespace,
                                 on_change=lambda unit, record: self.changes.append(
                                     (unit, record)))
        self._thread = Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            self.observer.spin(self._stop.is_set)
        except BaseException as error:  # noqa: B902 (told by the trial)
            self.fault = error

    def _begin(self, run: int, step_s: float) -> None:
        self._samples, self.step = [], -1
        self.runs.append(run)

    def _take(self, step: int, time_s: float, samples: FloatArray) -> None:
        if step == len(self._samples) and step < self._keep:
            self._samples.append(samples.copy())
        self.step = step
        self.moved_s = time.monotonic()
        if step % 16 == 0:
            self.history.append((self.moved_s, len(self.runs), step))
        if self._nap_s:
            time.sleep(self._nap_s)

    def step_at(self, time_s: float) -> int:
        """Return the step of the run in progress that was seen at a moment, -1 for none."""
        run = len(self.runs)
        return max((step for seen, number, step in self.history.copy()
                    if number == run and seen <= time_s), default=-1)

    def samples(self) -> FloatArray:
        """Return the steps that were kept of the run in progress, shape (steps, signals, 2)."""
        return np.array(self._samples)

    def close(self) -> None:
        """Leave the drive."""
        self._stop.set()
        self._thread.join(10.0)
        self.observer.close()


class Rig:
    """A drive with its watcher, as a context manager that leaves no process behind."""

    def __init__(self, outcome: Outcome, folder: Path | None = None, *,
                 recorder: bool = False, observers: Sequence[str] = (), namespace: str = '',
                 order: Sequence[str] = (), conductor: Sequence[str] = (),
                 exchange: str = 'python', environment: Mapping[str, str] | None = None,
                 commands: Mapping[str, Sequence[str]] | None = None,
                 waited_for: Sequence[str] = (), settings: Mapping[str, Any] | None = None,
                 nap_s: float = 0.0, keep: int = KEPT,
                 said: Diagnostics | None = None, nodes_are_killed: bool = False,
                 **run: Any) -> None:
        """
        Say what to start; `start` starts it.

        The outcome is told what is found. A recorder (which records in `folder`), observers and
        the `commands` by name run beside the nodes in processes of their own, with `environment`;
        the drive waits for those in `waited_for`. Processes start in the given order. `conductor`
        is the command of another node in the place of test_signal, which gets `settings` and the
        parameters run.*; `exchange` is auto or python. The watcher takes `nap_s` for each step and
        keeps the last `keep` of each run. `said` hears /diagnostics; None for a listener of the
        rig's own. Where `nodes_are_killed` by the trial, a node may take its last frames along,
        and the recorder lacks steps.
        """
        self.outcome = outcome
        self.namespace = namespace
        self.settings = dict(settings or {})
        self.said = Diagnostics() if said is None else said
        self._owns_said = said is None
        self.watcher = Watcher(namespace, nap_s, keep)
        further = {**(commands or {}),
                   **({RECORDER: _member('recorder', str(folder))} if recorder else {}),
                   **{name: _member('observer') for name in observers}}
        members = [WATCHER, *([RECORDER] if recorder else ()), *observers, *waited_for]
        self.names = tuple(order or (*UNITS, *further))
        parameters: dict[str, dict[str, Any]] = {unit: {'exchange': exchange} for unit in UNITS}
        parameters[TEST_SIGNAL] |= {
            **({} if conductor else self.settings), 'run.observers': members,
            **{f'run.{key}': value for key, value in run.items()}}
        self.processes = DriveProcesses(
            parameters, namespace=namespace, order=self.names, environment=environment,
            commands={**further, **({TEST_SIGNAL: conductor} if conductor else {})})
        self.codes: dict[str, int] = {}
        self._nodes_are_killed = nodes_are_killed

    def start(self, rng: random.Random | None = None, longest_wait_s: float = 0.0) -> None:
        """Start the processes, with a random wait after each [s]."""
        for name in self.names:
            self.processes.start(name)
            if rng is not None:
                time.sleep(rng.uniform(0.0, longest_wait_s))

    def pid(self, name: str) -> int:
        """Return the number of a process."""
        return self.processes.process(name).pid

    def until(self, true: Callable[[], bool], what: str, patience_s: float = PATIENCE_S) -> float:
        """
        Wait until something is true, and return how long it took [s].

        Raise InVainError, which says where the drive stands, after `patience_s`.
        """
        began = time.monotonic()
        while not true():
            if time.monotonic() - began > patience_s:
                raise InVainError(
                    f'in vain for {patience_s:g} s: {what}; {self.state()}',
                    {name: self.processes.log(name)[-1500:] for name in self.names
                     if self._has_started(name)})
            time.sleep(0.01)
        return time.monotonic() - began

    def until_step(self, step: int, runs: int | None = None) -> None:
        """Wait until the watcher has a step of the run in progress, or of a later one."""
        self.until(lambda: self.watcher.step >= step and len(self.watcher.runs) >= (runs or 1),
                   f'step {step}')

    def state(self) -> str:
        """Say in a line where the drive stands."""
        last = {said.node: said.message for said in self.said.said.copy()
                if said.namespace == self.namespace}
        ended = [f'{name} has ended with {code}' for name in self.names
                 if (code := self.processes.process(name).poll()) is not None]
        return '; '.join((f'watcher at step {self.watcher.step}, run {len(self.watcher.runs)}',
                          f'waits for {self.watcher.observer.missing}', *ended,
                          *(f'{name}: {message}' for name, message in last.items())))

    def expected(self, steps: int) -> FloatArray:
        """Return the same steps of the drive in one process, shape (steps, signals, 2)."""
        drive = changed(load(), {f'{TEST_SIGNAL}.rate.{key}': value
                                 for key, value in self.settings.items()})
        return simulate(drive, max(1, steps - 1) * 1e-3, 1e-3, self.schedule()).samples[:steps]

    def schedule(self) -> dict[int, dict[str, dict[str, Any]]]:
        """Return the live changes of the run in progress, as `simulate` takes them."""
        schedule: dict[int, dict[str, dict[str, Any]]] = {}
        for unit, record in self.watcher.changes.copy():
            if 'changes' in record and self.watcher.runs and (
                    record['run'] == self.watcher.runs[-1]):
                at = schedule.setdefault(record['step'], {}).setdefault(unit, {})
                at.update({key: value for key, value in record['changes'].items()
                           if not key.startswith('run.')})
        return schedule

    def compare(self, expected: Callable[[int], FloatArray] | None = None,
                columns: slice = slice(None)) -> bool:
        """Compare what the watcher kept with a run in one process; a difference is a finding."""
        got = self.watcher.samples()[..., columns]
        want = (expected or self.expected)(len(got))[..., columns]
        self.outcome.count('runs_compared')
        self.outcome.count('steps_compared', len(got))
        if got.shape == want.shape and got.tobytes() == want.tobytes():
            return True
        places = (np.nonzero((got != want).any(axis=(1, 2)))[0] if got.shape == want.shape
                  else [-1])
        self.outcome.find(f'bits differ from those of one process at step {int(places[0])}',
                          'wrong_bits', settings=self.settings)
        return False

    def end(self, name: str) -> int:
        """End one process in order, whatever its exit code; return the code."""
        process = self.processes.process(name)
        process.terminate()
        code = process.wait(20.0)
        return code

    def ended_well(self, name: str, code: int) -> bool:
        """Return whether an exit code is right; a recorder that lost steps ends with 1."""
        return code == 0 or (code == 1 and name == RECORDER and self._nodes_are_killed
                             and 'steps lost' in self.processes.log(name))

    def stop(self, number: signal.Signals = signal.SIGTERM) -> None:
        """End every process; a wrong exit code and a traceback are findings."""
        if self.codes:
            return
        for name in self.names:
            process = self.processes.process(name)
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
        before = {name: self.processes.process(name).poll() for name in self.names}
        self.codes = self.processes.stop(number)
        for name, code in self.codes.items():
            if before[name] is None and not self.ended_well(name, code):
                self.outcome.find(f'{name} ended with {code} after {number.name}', 'wrong_exits',
                                  log=self.processes.log(name)[-2000:])
        for name in self.names:
            if 'Traceback' in self.processes.log(name):
                self.outcome.find(f'a traceback in the log of {name}', 'tracebacks',
                                  log=self.processes.log(name)[-3000:])
        if self.watcher.fault is not None:
            self.outcome.find(f'the watcher failed: {self.watcher.fault!r}', 'tracebacks')

    def __enter__(self) -> Rig:
        """Return the rig, with nothing started."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> bool:
        """End every process; what has come in vain becomes a finding."""
        if isinstance(error, InVainError):
            self.outcome.find(str(error), 'hangs', logs=error.logs)
        started = [name for name in self.names if self._has_started(name)]
        self.names = tuple(started)
        self.stop()
        self.processes.__exit__(None, None, None)
        self.watcher.close()
        if self._owns_said:
            self.said.close()
        return isinstance(error, InVainError)

    def _has_started(self, name: str) -> bool:
        try:
            self.processes.process(name)
        except KeyError:
            return False
        return True


def _member(*arguments: str) -> tuple[str, ...]:
    return (sys.executable, '-m', MEMBERS, *arguments)


def memory_bytes(pid: int) -> int:
    """Return the memory that a process holds for itself and that it cannot share."""
    pages = Path(f'/proc/{pid}/statm').read_text().split()
    return (int(pages[1]) - int(pages[2])) * os.sysconf('SC_PAGE_SIZE')


def handles(pid: int) -> int:
    """Return how many file handles a process has open."""
    return len(os.listdir(f'/proc/{pid}/fd'))


def random_settings(rng: random.Random) -> dict[str, Any]:
    """Return a test signal that moves the drive."""
    return {'waveform': rng.choice(['square', 'saw_tooth']),
            'amplitude': round(rng.uniform(1e-4, 8e-3), 6),
            'period': round(rng.uniform(0.4, 3.0), 3)}
