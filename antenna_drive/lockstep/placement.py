# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How the kernel schedules a drive's processes: for speed, or in real time where a node asks for it.

For speed it is said where they run, and who may interrupt whom. A node that publishes a frame
wakes its readers. Left to itself the kernel lets each of them interrupt the publisher, or moves it
to another core, several times in every step; that costs more than the step. Both are matters of
speed alone: no bit of a run depends on them. On a machine that does other work it is the other way
round: who interrupts nobody waits for that work several times in every step.
"""

from collections.abc import Mapping
import ctypes
import os
from pathlib import Path
import time

from antenna_drive.emulator.wiring import TEST_SIGNAL, UNITS
from simgap.errors import UserError

# Dealt to the cores in turn: with two, each has one of the motors.
_PLACES = tuple(unit for unit in UNITS if unit != TEST_SIGNAL)

# With more cores than this every process finds one for itself.
_FEW_CORES = 4

# The machine is ours if so much of its time is idle, over so long a look at it [s].
_IDLE = 0.75
_LOOK_S = 0.1

_IDLE_COLUMN, _COLUMNS = 3, 8  # proc_stat(5): user nice system idle iowait irq softirq steal

_MCL_CURRENT, _MCL_FUTURE = 1, 2  # mlockall(2)
_LIMITS = '/etc/security/limits.conf'


def machine_is_idle() -> bool:
    """Look whether the machine has nothing to do; False where the system does not tell."""
    try:
        before = _times()
        time.sleep(_LOOK_S)
        return idle_share(before, _times()) >= _IDLE
    except (OSError, ValueError):
        return False


def _times() -> str:
    return Path('/proc/stat').read_text().partition('\n')[0]


def idle_share(before: str, after: str) -> float:
    """
    Return the share of its time that the machine was idle, from two first lines of /proc/stat.

    Raises ValueError: the lines are no such lines, or no time has passed between them.
    """
    first, last = (list(map(int, line.split()[1:1 + _COLUMNS])) for line in (before, after))
    passed = sum(last) - sum(first)
    if len(first) != _COLUMNS or len(last) != _COLUMNS or passed <= 0:
        raise ValueError(f'{after!r} after {before!r}')
    return (last[_IDLE_COLUMN] - first[_IDLE_COLUMN]) / passed


def hasten(pids: Mapping[str, int]) -> None:
    """
    Let processes finish what they do before others go on, each on one of a few cores.

    Where the system does not offer this (it is Linux's), or does not allow it, nothing changes.

    pids : processes that have just been started, by unit; test_signal, who waits for all the
        others, may run on any core
    """
    if not hasattr(os, 'SCHED_BATCH'):
        return
    cores = sorted(os.sched_getaffinity(0))
    for unit, pid in pids.items():
        try:
            os.sched_setscheduler(pid, os.SCHED_BATCH, os.sched_param(0))
            if unit in _PLACES and 1 < len(cores) <= _FEW_CORES:
                os.sched_setaffinity(pid, {cores[_PLACES.index(unit) % len(cores)]})
        except OSError:  # it has ended already, or may not be touched
            continue


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
    """Keep all memory of this process in RAM, also later; UserError if it may not or cannot."""
    library = ctypes.CDLL(None, use_errno=True)
    if not hasattr(library, 'mlockall'):
        raise UserError('realtime.memory: this system has no mlockall; leave it at pageable')
    if library.mlockall(_MCL_CURRENT | _MCL_FUTURE):
        raise UserError(
            f'realtime.memory: {os.strerror(ctypes.get_errno())}; leave it at pageable, or raise '
            f'the limit "memlock" in {_LIMITS} and log in again')
