# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Real-time scheduling and locked memory for a node, where the user has the right to them."""

import ctypes
import os
from pathlib import Path

from simgap.errors import UserError

# mlockall(2)
_MCL_CURRENT, _MCL_FUTURE = 1, 2

_LIMITS = '/etc/security/limits.conf'


def schedule_first_in_first_out(priority: int) -> None:
    """
    Give every thread that this process has now the scheduling class SCHED_FIFO.

    These are the lock-step's thread and those of the middleware. Threads that they start later
    are scheduled as usual: whoever serves parameters delays no step.

    priority : 1 to 99, higher goes first

    Raises UserError: the user may not do this, or the system does not offer it.
    """
    if not hasattr(os, 'SCHED_FIFO'):
        raise UserError('realtime.priority: this system has no SCHED_FIFO; leave it at 0')
    policy = os.SCHED_FIFO | getattr(os, 'SCHED_RESET_ON_FORK', 0)
    for task in Path('/proc/self/task').iterdir():
        try:
            os.sched_setscheduler(int(task.name), policy, os.sched_param(priority))
        except ProcessLookupError:  # the thread has just ended
            continue
        except PermissionError as error:
            raise UserError(
                f'realtime.priority: {priority} is not allowed for this user; leave it at 0, or '
                f'raise the limit "rtprio" in {_LIMITS} and log in again') from error


def lock_memory() -> None:
    """
    Keep all memory of this process in RAM, also what it asks for later.

    Raises UserError: the user may not do this, or the system does not offer it.
    """
    library = ctypes.CDLL(None, use_errno=True)
    if not hasattr(library, 'mlockall'):
        raise UserError('realtime.memory: this system has no mlockall; leave it at pageable')
    if library.mlockall(_MCL_CURRENT | _MCL_FUTURE):
        raise UserError(
            f'realtime.memory: {os.strerror(ctypes.get_errno())}; leave it at pageable, or raise '
            f'the limit "memlock" in {_LIMITS} and log in again')
