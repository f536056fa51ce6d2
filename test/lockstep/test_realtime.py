# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Real-time scheduling and locked memory: had where they are allowed, refused in one line."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

from antenna_drive.lockstep import placement
import pytest
from simgap.errors import UserError

# Threads that are there when the class changes have it, and those that they start have not.
PROGRAM = """
from antenna_drive.lockstep.placement import schedule_first_in_first_out
import os, threading
end = threading.Event()
there = threading.Thread(target=end.wait)
there.start()
schedule_first_in_first_out(3)
later = threading.Thread(target=end.wait)
later.start()
policy = {name: os.sched_getscheduler(thread.native_id) & ~os.SCHED_RESET_ON_FORK
          for name, thread in (('main', threading.main_thread()), ('there', there),
                               ('later', later))}
priority = os.sched_getparam(there.native_id).sched_priority
end.set()
assert policy == {'main': os.SCHED_FIFO, 'there': os.SCHED_FIFO, 'later': os.SCHED_OTHER}, policy
assert priority == 3
"""


def test_every_thread_that_is_there_is_scheduled_first_in_first_out() -> None:
    if not _may_be_real_time():
        pytest.skip('this user may not use SCHED_FIFO')
    done = subprocess.run([sys.executable, '-c', PROGRAM], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def _may_be_real_time() -> bool:
    """Try it in a process of its own."""
    code = 'import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))'
    return subprocess.run([sys.executable, '-c', code], stderr=subprocess.DEVNULL).returncode == 0


def test_who_may_not_is_told_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: Any) -> None:
        raise PermissionError(1, 'Operation not permitted')

    monkeypatch.setattr(os, 'sched_setscheduler', refuse)
    with pytest.raises(UserError, match='^realtime.priority: 50 is not allowed.*rtprio'):
        placement.schedule_first_in_first_out(50)


@pytest.mark.skipif(not sys.platform.startswith('linux'), reason='no /proc/self/status')
@pytest.mark.parametrize('limit', [None, 1])
def test_memory_is_locked_or_refused(limit: int | None) -> None:
    """Under a limit of one byte the system refuses, unless the user may lock any amount."""
    code = ('import resource, sys\n'
            'from simgap.errors import UserError\n'
            'from antenna_drive.lockstep.placement import lock_memory\n'
            f'limit = {limit}\n'
            'if limit: resource.setrlimit(resource.RLIMIT_MEMLOCK, (limit, limit))\n'
            'try:\n'
            '    lock_memory()\n'
            'except UserError as error:\n'
            '    print(error)\n'
            'else:\n'
            '    lines = open("/proc/self/status").read().splitlines()\n'
            '    print(*[line for line in lines if line.startswith("VmLck")])\n')
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = done.stdout.strip()
    assert said.startswith('realtime.memory: ') and 'memlock' in said or (
        said.startswith('VmLck') and int(said.split()[1]) > 0), said
