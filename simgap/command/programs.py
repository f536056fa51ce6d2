# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""From a command line to an exit code: what programs have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import os
from pathlib import Path
import signal
import sys
import warnings

from simgap.command.remedies import remedy
from simgap.errors import UserError

OK, NEGATIVE, BAD_INPUT, NOT_INSTALLED = 0, 1, 2, 3
# In the environment of a process that is to end with its parent: the number of the parent.
PARENT = 'SIMGAP_PARENT'


def run_program(name: str, description: str, args: Sequence[str] | None,
                act: Callable[[list[str]], int]) -> int:
    """
    Run a program or print its help; return its exit code.

    Parameters
    ----------
    name
        of the program, at the start of its error messages
    description
        what --help prints
    args
        command line without the program's name; None for the process's own
    act
        the program, from its arguments to its exit code

    """
    arguments = list(sys.argv[1:] if args is None else args)
    if '-h' in arguments or '--help' in arguments:
        print(description.strip())
        return OK
    return answered(name, lambda: act(arguments))


def answered(name: str, act: Callable[[], int]) -> int:
    """Return the exit code of `act`; say in one line what the user can mend."""
    try:
        return act()
    except UserError as error:
        return say(name, str(error), BAD_INPUT)
    except ModuleNotFoundError as error:
        needed = remedy(error)
        if needed is None:
            raise
        return say(name, needed, NOT_INSTALLED)


def say(name: str, message: str, status: int) -> int:
    """Print a message of a program to standard error, in one line; return the exit code."""
    print(f'{name}: {" ".join(message.split())}', file=sys.stderr)
    return status


def end_with_parent() -> None:
    """Let the kernel send SIGTERM to this process when its parent ends (on Linux)."""
    if sys.platform.startswith('linux'):
        import ctypes
        pr_set_pdeathsig = 1  # linux/prctl.h
        ctypes.CDLL(None).prctl(pr_set_pdeathsig, int(signal.SIGTERM))


def end_with_starter() -> None:
    """
    End with the process that has started this one, if the environment has its number.

    The kernel tells of the end of a parent only if it was asked before. A starter that has ended
    by then ends this process at once, also while it is a zombie that nobody has waited for.
    """
    if PARENT in os.environ:
        end_with_parent()
        if not runs(int(os.environ[PARENT])):
            os._exit(OK)


def runs(pid: int) -> bool:
    """Return whether a process is there and is no zombie."""
    try:
        os.kill(pid, 0)
        if sys.platform.startswith('linux'):
            return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] not in 'ZX'
    except PermissionError:
        return True  # of another user
    except OSError:
        return False
    return True


def expect_overflow() -> None:
    """
    Silence the warnings of numbers that overflow or are undefined.

    A search tries values with which a model diverges, and gives these up. The warnings tell the
    user nothing.
    """
    warnings.filterwarnings('ignore', '(overflow|underflow|invalid value|divide by zero) '
                                      'encountered', RuntimeWarning)
