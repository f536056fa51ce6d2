# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks on processes and threads of this machine: all done, bounded, and ended by an error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path
import time
from typing import Any

from antenna_drive.workers import TaskLost, worker_processes, Workers, workers
import pytest
import worker_tasks
from worker_tasks import square, told


@pytest.mark.parametrize('threads', [False, True])
def test_every_task_is_done_once(threads: bool) -> None:
    with workers(2, threads=threads) as pool:
        found = {number: result() for number, result in pool.each(
            worker_tasks.square, ((k,) for k in range(30)))}
    assert found == {k: k * k for k in range(30)}


def test_tasks_are_asked_for_as_there_is_room() -> None:
    """A long batch is never in memory as a whole."""
    given = []

    def tasks() -> Iterator[tuple[int]]:
        for k in range(100):
            given.append(k)
            yield k,

    with workers(2, threads=True) as pool:
        for done, (_, result) in enumerate(pool.each(worker_tasks.square, tasks()), start=1):
            result()
            # two for each worker beyond those whose results have been asked for
            assert len(given) <= done + 4
    assert len(given) == 100


def test_an_error_is_that_of_its_task_and_ends_no_other() -> None:
    with workers(2, threads=True) as pool:
        errors = []
        for number, result in pool.each(worker_tasks.fail, ((k,) for k in range(5))):
            with pytest.raises(ValueError, match=f'task {number}'):
                result()
            errors.append(number)
    assert sorted(errors) == list(range(5))


class _AtOnce(Executor):
    """Does each task as it is handed out."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any,
               **named: Any) -> Future[Any]:
        """Return a future that has ended."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **named))
        except ValueError as error:
            future.set_exception(error)
        return future


def test_of_tasks_that_end_together_those_that_failed_come_last() -> None:
    """Who stops at the first error has every result that was there."""
    def odd_ones_fail(k: int) -> int:
        return worker_tasks.fail(k) if k % 2 else k

    for _again in range(10):
        found = []
        with pytest.raises(ValueError, match='task'):
            for _, result in Workers(_AtOnce(), 4).each(odd_ones_fail, ((k,) for k in range(8))):
                found.append(result())
        assert sorted(found) == [0, 2, 4, 6]


def test_a_process_that_dies_is_told() -> None:
    with pytest.raises(TaskLost, match='ended from outside'):
        with workers(1) as pool:
            for _, result in pool.each(worker_tasks.end_worker, [(1,)]):
                result()


def test_what_nobody_waits_for_is_not_finished(tmp_path: Path) -> None:
    with worker_processes(1, finish=False) as pool:
        pool.submit(square, 3).result()
        [worker] = (pool._processes or {}).values()
        pool.submit(told, str(tmp_path), 0, 1)  # waits for ever
        while not list(tmp_path.glob('waiting-0')):
            time.sleep(0.01)
    assert not worker.is_alive()
