# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How the programs of the drive begin, and how they end with the process that started them."""

from collections.abc import Callable, Sequence
from importlib import import_module
import os
from pathlib import Path
import signal
import sys

from simgap.command.programs import answered, OK, PARENT


def run_program(name: str, description: str, act: Callable[[list[str]], int] | str,
                args: Sequence[str] | None = None) -> int:
    """
    Run a program or print its help; return its exit code.

    name, description : of the program, for people
    act : what it does with its arguments, or the module whose `run` does it; without ROS 2 the
        import of the module is what says so
    args : command line without the program's name; None for the process's own
    """
    end_with_starter()
    arguments = list(sys.argv[1:] if args is None else args)

    def run() -> int:
        if '-h' in arguments or '--help' in arguments:
            print(description.strip())
            return OK
        return (import_module(act).run if isinstance(act, str) else act)(arguments)

    return answered(name, run)


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
