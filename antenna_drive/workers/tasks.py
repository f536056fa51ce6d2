# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A batch of tasks and those who do it.

A task is a function and its arguments; its result comes back as soon as it is there.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from itertools import islice
from typing import Any, TypeVar

from simgap.errors import UserError

Result = TypeVar('Result')
# Tasks that are handed out for each worker: the one that it does, and the next one.
_AHEAD = 2


class TaskLost(UserError):
    """A task ended its worker, or had no worker."""


class Workers:
    """
    Those who do the tasks of a batch.

    executor : takes the tasks
    count : how many tasks it does at once
    """

    def __init__(self, executor: Executor, count: int) -> None:
        self._executor = executor
        self._count = count

    def each(self, function: Callable[..., Result], tasks: Iterable[tuple[Any, ...]],
             ) -> Iterator[tuple[int, Callable[[], Result]]]:
        """
        Do tasks; yield the number of each, and a function that returns its result, as they end.

        Only two tasks for each worker are handed out at a time, and no result is kept here. The
        memory that is needed therefore does not grow with the number of tasks. Ctrl-C goes
        through once every result that is there has been yielded. Of tasks that have ended
        together those that failed come last: who stops at an error has kept the rest.

        function : a function of a module
        tasks : the arguments of each task; they are asked for when there is room for another

        Yields the number of the task, from 0, and a function that returns its result or raises
        what the task raised; TaskLost if the task ended its worker.
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
                for future in sorted(self._ended(running), key=self._failed):
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

    def _failed(self, future: Future[Result]) -> bool:
        return future.cancelled() or future.exception() is not None

    def _result(self, future: Future[Result]) -> Result:
        try:
            return future.result()
        except BrokenProcessPool as error:
            raise TaskLost('a worker process was ended from outside, perhaps for want of memory; '
                           'try fewer --jobs') from error
