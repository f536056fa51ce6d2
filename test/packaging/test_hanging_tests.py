# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A test that hangs fails and leaves no process; the tests that follow are run."""

from __future__ import annotations

import os
from pathlib import Path
import re
import subprocess
import sys
import time

import leftovers
import pytest

pytest.importorskip('pytest_timeout', reason='pytest-timeout is not installed, see the test extra')
pytestmark = pytest.mark.skipif(not sys.platform.startswith('linux'), reason='no /proc')
SETTINGS = """\
[tool:pytest]
timeout = 2
markers =
    trial: takes minutes
    xdist_group: run by one worker
"""
# The process it waits for starts another one, in a session of its own, whose parent then ends.
WAITS = """
import subprocess

def test_waits():
    subprocess.run(['sh', '-c', 'sleep 3600 & echo $! > {folder}/orphan'], start_new_session=True)
    waiting = subprocess.Popen(['sleep', '3600'])
    with open('{folder}/child', 'w') as stream:
        stream.write(str(waiting.pid))
    waiting.wait()
"""
# No signal is answered in here.
LOOPS = """
from collections import deque
from itertools import repeat

def test_loops():
    deque(repeat(0), maxlen=0)
"""
FINE = """
def test_fine():
    pass
"""


def run_pytest(folder: Path, *options: str) -> str:
    """Run the tests of a folder with the hooks of ours; return what was said."""
    (folder / 'setup.cfg').write_text(SETTINGS)
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
        [str(Path(__file__).parents[1]), *sys.path])}
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-p', 'conftest', '-p', 'no:cacheprovider', *options],
        cwd=folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 1, done.stdout
    return done.stdout


def runs(pid: int) -> bool:
    """Return whether a process runs; one that has ended and was not asked for does not."""
    try:
        return Path('/proc', str(pid), 'cmdline').read_bytes() != b''
    except OSError:
        return False


@pytest.mark.parametrize('options', [['-p', 'no:xdist'], ['-n', '1']], ids=['alone', 'xdist'])
@pytest.mark.slow
def test_what_waits_for_ever_fails_and_leaves_nothing(tmp_path: Path, options: list[str]) -> None:
    (tmp_path / 'test_it.py').write_text(WAITS.format(folder=tmp_path) + FINE)
    said = run_pytest(tmp_path, *options)
    assert re.search(r'1 failed, 1 passed', said)
    assert 'from pytest-timeout' in said
    for name in ('orphan', 'child'):
        assert not runs(int((tmp_path / name).read_text()))


@pytest.mark.slow
def test_what_cannot_be_interrupted_ends_its_worker(tmp_path: Path) -> None:
    """The tests that follow are run by another worker."""
    (tmp_path / 'test_it.py').write_text(LOOPS + FINE)
    said = run_pytest(tmp_path, '-n', '1')
    assert re.search(r"crashed while running 'test_it.py::test_loops'", said)
    assert re.search(r'1 failed, 1 passed', said)


def test_only_what_this_session_has_started_is_found() -> None:
    assert os.getpid() not in leftovers.started()
    with subprocess.Popen(['sleep', '3600']) as ours, \
            subprocess.Popen(['sleep', '3600'], env={}) as other:
        try:
            # The environment of a process can be read only a moment after it was started.
            deadline = time.monotonic() + 10
            while ours.pid not in (found := leftovers.started()) and time.monotonic() < deadline:
                time.sleep(0.01)
            assert ours.pid in found
            assert other.pid not in found
            assert leftovers.end({ours.pid}) == ['sleep 3600']
            assert ours.wait() == -9
        finally:
            ours.kill()
            other.kill()
