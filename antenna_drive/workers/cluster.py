# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Work on a cluster of dask.distributed.

A worker that is killed loses its task, which dask gives to another one. Results that have come
back are never made again. The workers need the same antenna_drive as the one that asks; each
task carries a digest of its sources.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from functools import cache
import hashlib
from pathlib import Path
import time
from typing import Any

import antenna_drive
from antenna_drive.workers.tasks import Result, TaskLost, Workers
import simgap
from simgap.command.programs import expect_overflow
from simgap.errors import UserError

# How long a scheduler may take to answer, and may be without any worker [s].
CONNECT_S = 10.0
PATIENCE_S = 60.0
_LOOK_S = 2.0


class ClusterWorkers(Workers):
    """The workers of a scheduler; they may come and go."""

    def __init__(self, client: Any, address: str) -> None:
        """Hand tasks to the client of a scheduler at an address."""
        # pure=False: two tasks with the same arguments are two tasks
        super().__init__(client.get_executor(pure=False), 0)
        self._client = client
        self._address = address
        self._seen = time.monotonic()

    def _at_once(self) -> int:
        # at least one task waits at the scheduler for the first worker that comes
        return max(1, self._threads())

    def _threads(self) -> int:
        try:
            found = sum(self._client.nthreads().values())
        except (OSError, CancelledError) as error:
            raise self._lost() from error
        if found:
            self._seen = time.monotonic()
        elif time.monotonic() - self._seen > PATIENCE_S:
            raise TaskLost(f'{self._address}: no worker for {PATIENCE_S:g} s; start workers and '
                           'run the same command again')
        return found

    def _submit(self, function: Callable[..., Result],
                arguments: tuple[Any, ...]) -> Future[Result]:
        return self._executor.submit(_done_there, fingerprint(), function, arguments)

    def _ended(self, running: Iterable[Future[Result]]) -> Iterable[Future[Result]]:
        while not (ended := wait(running, _LOOK_S, FIRST_COMPLETED).done):
            self._threads()
        return ended

    def _result(self, future: Future[Result]) -> Result:
        from distributed.scheduler import KilledWorker
        try:
            return future.result()
        except KilledWorker as error:
            raise TaskLost(f'{self._address}: every worker that was given a task ended, perhaps '
                           "for want of memory; see the workers' logs") from error
        except CancelledError as error:
            raise self._lost() from error
        except ModuleNotFoundError as error:
            if (error.name or '').partition('.')[0] not in ('antenna_drive', 'simgap'):
                raise
            raise UserError(f'{self._address}: a worker has not this antenna_drive; install the '
                            'same one there') from error

    def _lost(self) -> TaskLost:
        return TaskLost(f'{self._address}: the scheduler is gone; start it and run the same '
                        'command again')


@contextmanager
def cluster(address: str) -> Iterator[ClusterWorkers]:
    """
    Yield the workers of a scheduler.

    Tasks that wait are taken back when the context ends; those that run come to their end there.

    address : of the scheduler, 'tcp://host:8786'

    Raises UserError: nobody answers there, or there is no worker.
    Raises ModuleNotFoundError: dask.distributed is not installed.
    """
    from distributed import Client
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UserError(f'--scheduler {address}: no scheduler answers there: {error}') from error
    try:
        try:
            client.wait_for_workers(1, timeout=CONNECT_S)
        except TimeoutError as error:
            raise UserError(f'--scheduler {address}: has no workers; start some with: '
                            f'dask worker {address} --nthreads 1') from error
        yield ClusterWorkers(client, address)
    finally:
        client.close()


def _done_there(wanted: str, function: Callable[..., Result],
                arguments: tuple[Any, ...]) -> Result:
    """Do a task on a worker."""
    if fingerprint() != wanted:
        raise UserError('a worker has another antenna_drive than this one; install the same one '
                        'there')
    expect_overflow()
    return function(*arguments)


@cache
def fingerprint() -> str:
    """Return a digest of the sources and data of drive and engine: equal for the same code."""
    digest = hashlib.sha256()
    for folder in (Path(antenna_drive.__file__).parent, Path(simgap.__file__).parent):
        for path in sorted(folder.rglob('*')):
            if path.suffix in ('.py', '.yaml'):
                digest.update(str(path.relative_to(folder.parent)).encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()
