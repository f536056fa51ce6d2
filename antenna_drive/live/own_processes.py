# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The processes that the page may start: a drive of its own, and a recorder."""

import asyncio
from collections.abc import Mapping, Sequence
from datetime import datetime
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import tempfile
from threading import Lock
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.wiring import TEST_SIGNAL
from antenna_drive.live.experiment_buttons import start_of
from antenna_drive.lockstep.entry import choose_transport
from antenna_drive.lockstep.processes import DriveProcesses, Parameter
from simgap.command.programs import PARENT
from simgap.errors import UserError

# A recorder completes its bag within this [s]; after it, it is ended at once.
_PATIENCE_S = 10.0
_NAME = re.compile(r'[A-Za-z0-9][\w.-]{0,80}')


class OwnDrive:
    """A drive that ends with the page's server, and can be started again with another circuit."""

    def __init__(self, config: Sequence[str], parameters: Mapping[str, Mapping[str, Parameter]],
                 namespace: str = '', pace: float = 1.0) -> None:
        """Say what to start; `start` does it."""
        self._config = tuple(config)
        self._parameters = {unit: dict(values) for unit, values in parameters.items()}
        self._namespace = namespace
        self.pace = pace
        self._processes: DriveProcesses | None = None

    @property
    def config(self) -> tuple[str, ...]:
        """Return the configuration files, without the circuit of an experiment."""
        return self._config

    def start(self, experiment: str | None) -> None:
        """
        Start the processes, for an experiment or as configured.

        The caller's thread has to live as long as they: the kernel ends them with it.

        Raises ParameterError: a configuration is not allowed.
        """
        config = list(self._config)
        parameters: dict[str, dict[str, Any]] = {
            unit: dict(values) for unit, values in self._parameters.items()}
        if experiment is not None:
            chosen = experiments()[experiment]
            config.append(chosen.circuit)
            for unit, values in start_of(chosen, self._config).items():
                parameters.setdefault(unit, {}).update(values)
        parameters.setdefault(TEST_SIGNAL, {})['run.pace'] = self.pace
        self._processes = DriveProcesses(parameters, config=config, namespace=self._namespace)
        self._processes.start()

    def trouble(self) -> str:
        """Say which process has ended by itself and why, '' for none."""
        if self._processes is None:
            return ''
        try:
            self._processes.check()
        except UserError as error:
            return str(error)
        return ''

    def stop(self) -> None:
        """End the processes; takes up to five seconds."""
        processes, self._processes = self._processes, None
        if processes is not None:
            processes.__exit__(None, None, None)


class RecorderProcess:
    """
    The recorder of this package as a process of its own, which the drive does not wait for.

    path : the folder of the recording under way, or of the last one
    said : what the recorder said at its end
    """

    def __init__(self, folder: Path, namespace: str = '') -> None:
        """Record to bags in a folder."""
        self.folder = folder
        self._namespace = namespace
        self._process: subprocess.Popen[bytes] | None = None
        self._log: Any = None
        self._stopping = Lock()
        self.path: Path | None = None
        self.said = ''

    @property
    def running(self) -> bool:
        """Return whether a recording is under way."""
        return self._process is not None and self._process.poll() is None

    def start(self, name: str = '') -> Path:
        """
        Begin to record; return the folder of the bag.

        Raises UserError: a recording is under way, the name is not allowed or taken.
        """
        if self.running:
            raise UserError(f'{self.path}: is being recorded, stop this first')
        name = name.strip() or f'recording_{datetime.now():%Y-%m-%d_%H-%M-%S}'
        if not _NAME.fullmatch(name):
            raise UserError(f'{name}: no name for a recording; allowed are letters, digits and '
                            '. _ -')
        path = self.folder / name
        if path.exists():
            raise UserError(f'{path}: exists already, choose another name')
        self.folder.mkdir(parents=True, exist_ok=True)
        arguments = ['-p', f'out:={path}']
        if self._namespace:
            arguments += ['-r', f'__ns:={self._namespace}']
        environment = {**os.environ, PARENT: str(os.getpid())}
        choose_transport(environment)
        self._log = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'antenna_drive.nodes.recorder', '--ros-args', *arguments],
            env=environment, stdin=subprocess.DEVNULL, stdout=self._log, stderr=self._log,
            start_new_session=True)
        self.path, self.said = path, ''
        return path

    def stop(self) -> None:
        """Complete the bag; from any thread."""
        with self._stopping:
            process = self._process
            if process is None:
                return
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            try:
                process.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            self._log.seek(0)
            lines = self._log.read().decode(errors='replace').strip().splitlines()
            self._log.close()
            self.said = lines[-1].rpartition(']: ')[2] if lines else ''
            self._process = None

    def size(self) -> int:
        """Return how many bytes the recording has on disk."""
        try:
            return sum(item.stat().st_size for item in (self.path or Path()).iterdir()
                       if self.path is not None)
        except OSError:
            return 0


async def off_the_loop(work: Any, *arguments: Any) -> Any:
    """Do what takes a while in another thread."""
    return await asyncio.get_running_loop().run_in_executor(None, work, *arguments)
