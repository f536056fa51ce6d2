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
"""
Parallel work: on processes or threads of this machine, or on a cluster of dask.distributed.

`workers` is what every command uses. A task is a function and its arguments; its result comes
back as soon as it is there. The work ends with the process that asked for it: an executor of the
standard library finishes everything in its queue before it lets an error or Ctrl-C through, and
its processes outlive a parent that is killed. These do neither.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    Executor, FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import islice
import os
import signal
from typing import Any, TypeVar
import warnings

from antenna_drive.errors import UserError
from antenna_drive.programs import end_with_parent

Result = TypeVar('Result')
# Tasks that are handed out for each worker: the one that it does, and the next one.
_AHEAD = 2


class TaskLost(UserError):
    """A task ended its worker, or had no worker."""


class Workers:
    """
    Those who do the tasks of a batch.

    Parameters
    ----------
    executor
        takes the tasks
    count
        how many tasks it does at once

    """

    def __init__(self, executor: Executor, count: int) -> None:
        """Hand tasks to an executor."""
        self._executor = executor
        self._count = count

    def each(self, function: Callable[..., Result], tasks: Iterable[tuple[Any, ...]],
             ) -> Iterator[tuple[int, Callable[[], Result]]]:
        """
        Do tasks; yield the number of each, and a function that returns its result, as they end.

        Only two tasks for each worker are handed out at a time, and no result is kept here. The
        memory that is needed therefore does not grow with the number of tasks. Ctrl-C goes
        through once every result that is there has been yielded.

        Parameters
        ----------
        function
            a function of a module
        tasks
            the arguments of each task; they are asked for when there is room for another

        Yields
        ------
        number of the task, from 0, and a function that returns its result or raises what the
        task raised; TaskLost if the task ended its worker

        """
        ahead = enumerate(tasks)
        running: dict[Future[Result], int] = {}
        try:
            while True:
                room = max(0, _AHEAD * self._at_once() - len(running))
                for number, arguments in islice(ahead, room):
                    running[self._submit(function, arguments)] = number
                if not running:
                    return
                for future in self._ended(running):
                    yield running.pop(future), partial(self._result, future)
        except KeyboardInterrupt:
            for future, number in running.items():
                if future.done() and not future.cancelled():
                    yield number, partial(self._result, future)
            raise
        finally:
            for future in running:
                future.cancel()

    def _at_once(self) -> int:
        return self._count

    def _submit(self, function: Callable[..., Result],
                arguments: tuple[Any, ...]) -> Future[Result]:
        return self._executor.submit(function, *arguments)

    def _ended(self, running: Iterable[Future[Result]]) -> Iterable[Future[Result]]:
        return wait(running, return_when=FIRST_COMPLETED).done

    def _result(self, future: Future[Result]) -> Result:
        try:
            return future.result()
        except BrokenProcessPool as error:
            raise TaskLost('a worker process was ended from outside, perhaps for want of memory; '
                           'try fewer --jobs') from error


@contextmanager
def workers(count: int, scheduler: str | None = None, *, threads: bool = False,
            ) -> Iterator[Workers]:
    """
    Yield the workers of a batch; the work ends with the context.

    Parameters
    ----------
    count
        how many of this machine, without a scheduler
    scheduler
        address of a dask.distributed scheduler, 'tcp://host:8786', whose workers do the work
    threads
        threads of this machine instead of processes, for tasks that only wait for a process of
        their own

    Raises
    ------
    UserError : the scheduler cannot be reached, or has no workers
    ModuleNotFoundError : a scheduler is given and dask.distributed is not installed

    """
    if scheduler is not None:
        from antenna_drive.cluster import cluster
        with cluster(scheduler) as found:
            yield found
    elif threads:
        pool = ThreadPoolExecutor(count)
        try:
            yield Workers(pool, count)
        except BaseException:
            # what the threads wait for ends with this process
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        pool.shutdown()
    else:
        with worker_processes(count) as processes:
            yield Workers(processes, count)


@contextmanager
def worker_processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """
    Yield a pool of processes; end them at once after an error.

    Ctrl-C in a terminal goes to all of them, but only the parent answers it. If the parent is
    killed, the kernel ends them (on Linux).
    """
    pool = ProcessPoolExecutor(count, initializer=_become_worker, initargs=(os.getpid(),))
    try:
        yield pool
    except BaseException:
        # public from Python 3.14 on, as terminate_workers
        for process in list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(cancel_futures=True)
        raise
    pool.shutdown()


def expect_overflow() -> None:
    """
    Silence the warnings of numbers that overflow or are undefined.

    A search tries values with which a model diverges, and gives these up. The warnings tell the
    user nothing.
    """
    warnings.filterwarnings('ignore', '(overflow|underflow|invalid value|divide by zero) '
                                      'encountered', RuntimeWarning)


def _become_worker(parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent()
    if os.getppid() != parent:
        os._exit(0)
    expect_overflow()
