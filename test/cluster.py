# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A scheduler of dask.distributed and its workers, as processes of this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, ExitStack
import os
from pathlib import Path
import subprocess
import sys
import time
from typing import IO

ROOT = Path(__file__).resolve().parents[1]
# What is waited for comes within seconds on a quiet machine; a test that waits longer fails.
PATIENCE_S = 200.0


class Cluster:
    """A scheduler's address, its process and those of its workers."""

    def __init__(self, address: str, scheduler: subprocess.Popen[bytes],
                 workers: list[subprocess.Popen[bytes]]) -> None:
        self.address = address
        self.scheduler = scheduler
        self.workers = workers

    def kill(self, pid: int) -> None:
        """End a worker without a word."""
        worker = next(worker for worker in self.workers if worker.pid == pid)
        worker.kill()
        worker.wait()

    def alive(self) -> int:
        return sum(worker.poll() is None for worker in self.workers)


@contextmanager
def cluster(folder: Path, count: int, executable: Path | None = None) -> Iterator[Cluster]:
    """
    Start a scheduler and workers of one thread each; end all of them.

    Parameters
    ----------
    folder
        for files
    count
        of workers
    executable
        what the workers take for Python when they start a process

    """
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
        [str(ROOT), str(ROOT / 'test'), os.environ.get('PYTHONPATH', '')])}
    file = folder / 'scheduler.json'
    with ExitStack() as stack:
        log = stack.enter_context(open(folder / 'cluster.log', 'ab'))

        def start(*words: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen(
                [sys.executable, '-m', *words], env=environment, cwd=folder, stdout=log,
                stderr=log, stdin=subprocess.DEVNULL)
            stack.callback(_end, process)
            return process

        scheduler = start(
            'distributed.cli.dask_scheduler', '--host', '127.0.0.1', '--port', '0',
            '--no-dashboard', '--scheduler-file', str(file))
        # --no-nanny: nobody starts a worker again that was killed
        module = 'distributed.cli.dask_worker'
        if executable is not None:
            module = 'worker_with_stand_in'
            environment['STAND_IN'] = str(executable)
        workers = [start(module, '--scheduler-file', str(file), '--nthreads', '1', '--no-nanny',
                         '--no-dashboard') for _ in range(count)]
        from distributed import Client
        wait_for(file, log)
        with Client(scheduler_file=str(file), timeout=PATIENCE_S, set_as_default=False) as client:
            if count:
                client.wait_for_workers(count, timeout=PATIENCE_S)
            address = client.scheduler.address
        yield Cluster(address, scheduler, workers)


def wait_for(path: Path, log: IO[bytes] | None = None) -> str:
    """Return the content of a file once it is there and not empty."""
    deadline = time.monotonic() + PATIENCE_S
    while not path.exists() or not path.stat().st_size:
        assert time.monotonic() < deadline, f'{path.name} never came'
        time.sleep(0.02)
    return path.read_text()


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
