# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Processes of this machine as workers, which end with the one that asked for them."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
import os
import signal

from antenna_drive.programs import end_with_parent
from simgap.command.programs import expect_overflow


@contextmanager
def worker_processes(count: int, finish: bool = True) -> Iterator[ProcessPoolExecutor]:
    """
    Yield a pool of processes; end them at once after an error.

    Ctrl-C in a terminal goes to all of them, but only the parent answers it. If the parent is
    killed, the kernel ends them (on Linux).

    count : how many
    finish : whether what they have begun is finished when the context ends without an error
    """
    pool = ProcessPoolExecutor(count, initializer=_become_worker, initargs=(os.getpid(),))
    try:
        yield pool
    except BaseException:
        _end(pool)
        raise
    if not finish:
        _end(pool)
    pool.shutdown()


def _end(pool: ProcessPoolExecutor) -> None:
    # public from Python 3.14 on, as terminate_workers
    for process in list((pool._processes or {}).values()):
        process.terminate()
    pool.shutdown(cancel_futures=True)


def _become_worker(parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent()
    if os.getppid() != parent:
        os._exit(0)
    expect_overflow()
