# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Parallel work: on processes or threads of this machine, or on a cluster of dask.distributed.

`workers` is what every command uses. The work ends with the process that asked for it: an
executor of the standard library finishes everything in its queue before it lets an error or
Ctrl-C through, and its processes outlive a parent that is killed. These do neither.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from antenna_drive.workers.processes import worker_processes
from antenna_drive.workers.tasks import TaskLost, Workers

__all__ = ['TaskLost', 'worker_processes', 'Workers', 'workers']


@contextmanager
def workers(count: int, scheduler: str | None = None, *, threads: bool = False,
            ) -> Iterator[Workers]:
    """
    Yield the workers of a batch; the work ends with the context.

    count : how many of this machine, without a scheduler
    scheduler : address of a dask.distributed scheduler, 'tcp://host:8786', whose workers do the
        work
    threads : threads of this machine instead of processes, for tasks that only wait for a process
        of their own

    Raises UserError: the scheduler cannot be reached, or has no workers.
    Raises ModuleNotFoundError: a scheduler is given and dask.distributed is not installed.
    """
    if scheduler is not None:
        from antenna_drive.workers.cluster import cluster
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
