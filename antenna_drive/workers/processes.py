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
"""Processes of this machine as workers, which end with the one that asked for them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
import os
import signal
import warnings

from antenna_drive.programs import end_with_parent


@contextmanager
def worker_processes(count: int, finish: bool = True) -> Iterator[ProcessPoolExecutor]:
    """
    Yield a pool of processes; end them at once after an error.

    Ctrl-C in a terminal goes to all of them, but only the parent answers it. If the parent is
    killed, the kernel ends them (on Linux).

    Parameters
    ----------
    count
        how many
    finish
        whether what they have begun is finished when the context ends without an error

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
