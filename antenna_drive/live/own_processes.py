# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The processes that the page may start: a drive of its own, and a recorder."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
import re
import sys
from threading import Lock
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.wiring import TEST_SIGNAL
from antenna_drive.live.experiment_buttons import start_of
from antenna_drive.lockstep.processes import DriveProcesses, Parameter
from simgap.errors import UserError

# A recorder completes its bag within this [s]; after it, it is ended at once.
_PATIENCE_S = 10.0
_RECORDER = 'recorder'
_NAME = re.compile(r'[A-Za-z0-9][\w.-]{0,80}')


class OwnDrive:
    """A drive that ends with the page's server, and can be started again with another circuit."""

    def __init__(self, config: Sequence[str], parameters: Mapping[str, Mapping[str, Parameter]],
                 namespace: str = '', pace: float = 1.0) -> None:
        """Say what to start; `start` does it."""
        self.config = tuple(config)  # without the circuit of an experiment
        self._parameters = {unit: dict(values) for unit, values in parameters.items()}
        self._namespace = namespace
        self.pace = pace
        self._processes: DriveProcesses | None = None

    def start(self, experiment: str | None) -> None:
        """
        Start the processes, for an experiment or as configured.

        The caller's thread has to live as long as they: the kernel ends them with it.

        Raises ParameterError: a configuration is not allowed.
        """
        config = list(self.config)
        parameters: dict[str, dict[str, Any]] = {
            unit: dict(values) for unit, values in self._parameters.items()}
        if experiment is not None:
            chosen = experiments()[experiment]
            config.append(chosen.circuit)
            for unit, values in start_of(chosen, self.config).items():
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
        """End the processes; takes up to six seconds."""
        processes, self._processes = self._processes, None
        if processes is not None:
            processes.close()


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
        self._processes: DriveProcesses | None = None
        self._stopping = Lock()
        self.path: Path | None = None
        self.said = ''

    @property
    def running(self) -> bool:
        """Return whether a recording is under way."""
        own = self._processes
        return own is not None and own.process(_RECORDER).poll() is None

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
        own = DriveProcesses(
            {_RECORDER: {'out': str(path)}}, namespace=self._namespace, order=[_RECORDER],
            commands={_RECORDER: [sys.executable, '-m', 'antenna_drive.nodes.recorder']})
        own.start()
        self._processes = own
        self.path, self.said = path, ''
        return path

    def stop(self) -> None:
        """Complete the bag; from any thread."""
        with self._stopping:
            own = self._processes
            if own is None:
                return
            own.stop(patience_s=_PATIENCE_S)
            lines = own.log(_RECORDER).strip().splitlines()
            self.said = lines[-1].rpartition(']: ')[2] if lines else ''
            own.close()
            self._processes = None

    def size(self) -> int:
        """Return how many bytes the recording has on disk."""
        try:
            return sum(item.stat().st_size for item in (self.path or Path()).iterdir()
                       if self.path is not None)
        except OSError:
            return 0
