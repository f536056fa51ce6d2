# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""From a command line to an exit code: what programs have in common."""

from collections.abc import Callable
import io
import os
import sys
import warnings

from simgap.command.remedies import remedy
from simgap.errors import UserError

OK, NEGATIVE, BAD_INPUT, NOT_INSTALLED = 0, 1, 2, 3
INTERRUPTED, BROKEN_PIPE = 130, 141  # 128 + the signal's number, as shells do
# In the environment of a process that is to end with its parent: the number of the parent.
PARENT = 'SIMGAP_PARENT'


def answered(name: str, act: Callable[[], int]) -> int:
    """Return the exit code of `act`; say in one line what the user can mend."""
    _open_streams()
    try:
        try:
            return act()
        finally:
            sys.stdout.flush()
    except UserError as error:
        return say(name, str(error), error.status)
    except ImportError as error:
        if (needed := remedy(error)) is None:
            raise
        return say(name, needed, NOT_INSTALLED)
    except BrokenPipeError:
        # The reader has gone. Python would complain again when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except OSError as error:
        if error.strerror is None:
            raise
        return say(name, f'{error.filename or "output"}: {error.strerror}', BAD_INPUT)


def _open_streams() -> None:
    """Open what whoever started the program has closed; let every text be printed."""
    for name in ('stdin', 'stdout', 'stderr'):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, 'r+'))
        elif name != 'stdin' and isinstance(stream := getattr(sys, name), io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')


def say(name: str, message: str, status: int) -> int:
    """Print a message of a program to standard error, in one line; return the exit code."""
    print(f'{name}: {" ".join(message.split())}', file=sys.stderr)
    return status


def expect_overflow() -> None:
    """Silence the warnings of numbers with which a model diverges: a search gives these up."""
    warnings.filterwarnings('ignore', '(overflow|underflow|invalid value|divide by zero) '
                                      'encountered', RuntimeWarning)
