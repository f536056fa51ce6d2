# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends a command in one line: it unwinds, or ends at a second one or after a while."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
import signal
import sys
import threading
from types import FrameType

# Nodes that have to be ended take up to five seconds of it.
GRACE_S = 8.0


@contextmanager
def interruptible(say: Callable[[], int]) -> Iterator[None]:
    """
    Answer Ctrl-C with KeyboardInterrupt, and then by leaving at once.

    What is under way may keep its results and end its processes as the interrupt goes through
    it. Threads that still compute are not waited for. `say` returns the exit code.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    leaving = threading.Event()

    def leave() -> None:
        if leaving.is_set():
            return
        leaving.set()
        status = say()
        if 'multiprocessing' in sys.modules:
            import multiprocessing
            for child in multiprocessing.active_children():
                child.terminate()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    def answer(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, lambda number, frame: leave())
        watchdog.start()
        raise KeyboardInterrupt

    watchdog = threading.Timer(GRACE_S, leave)
    watchdog.daemon = True
    before = signal.signal(signal.SIGINT, answer)
    try:
        yield
    except KeyboardInterrupt:
        if any(thread is not threading.main_thread() and not thread.daemon
               for thread in threading.enumerate()):
            leave()
        raise
    finally:
        watchdog.cancel()
        signal.signal(signal.SIGINT, before)
