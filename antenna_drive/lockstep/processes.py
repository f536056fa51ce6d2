# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Start the drive's processes, watch over them, and end every one of them."""

from collections.abc import Mapping, Sequence
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from typing import IO

from antenna_drive.emulator.wiring import find, TEST_SIGNAL
from antenna_drive.lockstep.entry import choose_transport
from antenna_drive.lockstep.placement import hasten, machine_is_idle
from antenna_drive.yaml_text import yaml_float
from simgap.command.programs import PARENT
from simgap.errors import UserError

# Nodes end within five seconds of a signal, whatever holds them.
END_PATIENCE_S = 6.0

Parameter = float | int | bool | str | Sequence[float] | Sequence[str]


class DriveProcesses:
    """
    The processes of a drive, one for each unit, as a context manager that leaves none behind.

    Those of a drive that is to run as fast as possible (run.pace 0), on a machine that is idle
    when they are started, are placed for speed, see `placement`.

    Should this process die without a word, the kernel ends the nodes (on Linux).
    """

    def __init__(self, parameters: Mapping[str, Mapping[str, Parameter]] | None = None, *,
                 config: Sequence[str] = (), namespace: str = '', order: Sequence[str] = (),
                 wiring: str = '',
                 commands: Mapping[str, Sequence[str]] | None = None,
                 environment: Mapping[str, str] | None = None,
                 placed: bool | None = None) -> None:
        """
        Say what to start; `start` or entering the context does it.

        config, parameters : configuration files or sets of config/ for every node, and what to set
            on each node over them, by unit and parameter name
        namespace : of every node, '/east'; '' for none
        order : the units, in the order in which they are started; that of the wiring if empty
        wiring : module:NAME of the wiring, '' for the drive's own
        commands : commands to run in place of our own nodes, by unit
        environment : variables to set beside those of this process
        placed : whether to place the processes for speed; None for what is said above
        """
        self._wiring = wiring
        self._units = find(wiring).units
        self.order = tuple(order or self._units)
        self._parameters = {name: dict(values) for name, values in (parameters or {}).items()}
        self._config = [str(item) for item in config]
        self._namespace = namespace
        self._commands = dict(commands or {})
        self._environment = {**os.environ, **(environment or {}), PARENT: str(os.getpid())}
        choose_transport(self._environment)
        self._unpaced = self._parameters.get(TEST_SIGNAL, {}).get('run.pace') == 0.0
        self._hurried = placed
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._logs: dict[str, IO[bytes]] = {}

    def command(self, unit: str) -> list[str]:
        """Return the command line of a unit's process."""
        start = self._commands.get(unit) or (sys.executable, '-m', self._units[unit].node)
        arguments = [*start, '--ros-args', '-r', f'__node:={unit}']
        if self._namespace:
            arguments += ['-r', f'__ns:={self._namespace}']
        parameters: dict[str, Parameter] = dict(self._parameters.get(unit, {}))
        if self._config:
            parameters.setdefault('config', self._config)
        if self._wiring and unit in self._units:
            parameters.setdefault('wiring', self._wiring)
        for name, value in parameters.items():
            arguments += ['-p', f'{name}:={_yaml(value)}']
        return arguments

    def start(self, *units: str) -> None:
        """Start the processes of `units`, of all in `order` if none is named."""
        if self._hurried is None:
            self._hurried = self._unpaced and machine_is_idle()
        for unit in units or self.order:
            log = self._logs.setdefault(unit, tempfile.TemporaryFile())
            # A session of their own: Ctrl-C is for us, who then end the nodes in order.
            self._processes[unit] = subprocess.Popen(
                self.command(unit), env=self._environment, stdin=subprocess.DEVNULL,
                stdout=log, stderr=log, start_new_session=True)
        if self._hurried:
            hasten({unit: self._processes[unit].pid for unit in units or self.order})

    def process(self, unit: str) -> subprocess.Popen[bytes]:
        """Return the process of a unit."""
        return self._processes[unit]

    def log(self, unit: str) -> str:
        """Return what a unit's process has printed so far."""
        log = self._logs[unit]
        return os.pread(log.fileno(), os.fstat(log.fileno()).st_size, 0).decode(errors='replace')

    def check(self) -> None:
        """Make sure that all processes run; UserError has the last line of one that has ended."""
        for unit, process in self._processes.items():
            status = process.poll()
            if status is not None:
                lines = self.log(unit).strip().splitlines() or ['nothing said']
                raise UserError(f'the process of {unit} has ended with status {status}: '
                                f'{lines[-1]}')

    def kill(self, unit: str) -> None:
        """End a unit's process as a crash would: at once, without a word."""
        self._processes[unit].kill()
        self._processes[unit].wait()

    def stop(self, number: signal.Signals = signal.SIGINT,
             patience_s: float = END_PATIENCE_S) -> dict[str, int]:
        """End all processes. Returns the exit code by unit; -9 if a process had to be killed."""
        for process in self._processes.values():
            if process.poll() is None:
                process.send_signal(number)
        deadline = time.monotonic() + patience_s
        codes: dict[str, int] = {}
        for unit, process in self._processes.items():
            try:
                codes[unit] = process.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                process.kill()
                codes[unit] = process.wait()
        return codes

    def __enter__(self) -> 'DriveProcesses':
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End all processes that still run, and forget what they have printed."""
        self.stop()
        for log in self._logs.values():
            log.close()


def _yaml(value: Parameter) -> str:
    # JSON is YAML, but for floats
    if isinstance(value, (list, tuple)):
        return '[' + ', '.join(_yaml(item) for item in value) + ']'
    return yaml_float(value) if isinstance(value, float) else json.dumps(value)
