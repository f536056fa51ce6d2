# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A signal stops a program whatever it is doing at that moment."""

from __future__ import annotations

import subprocess
import sys

import pytest

# The main thread holds the lock of the event, as it does within `wait`.
PROGRAM = """
import os, signal, time
from antenna_drive.lockstep.entry import stopped_by_signals
stop = stopped_by_signals()
with stop._cond:
    os.kill(os.getpid(), signal.{name})
    time.sleep(0.1)
assert stop.wait(10.0)
"""


@pytest.mark.parametrize('name', ['SIGINT', 'SIGTERM'])
def test_a_signal_that_comes_while_the_program_waits_is_heard(name: str) -> None:
    done = subprocess.run([sys.executable, '-c', PROGRAM.format(name=name)], timeout=60.0,
                          capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, '')
