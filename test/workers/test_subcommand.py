# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A command in a process of its own: what it says, its limits, and its end."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys
import time

from antenna_drive.subcommand import run_command
import pytest

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 200.0
# A parent with a command that would take many minutes.
PARENT = """
import sys
from antenna_drive.subcommand import run_command
run_command(['trial', '--cases', '2000', '--seed', '1', '--jobs', '1', '--out', sys.argv[1]],
            program='lab')
"""


def test_what_a_command_says() -> None:
    assert run_command(['--version']) == 'exit code 0\n'
    said = run_command(['diagnose', 'nowhere.csv'])
    assert said.startswith('exit code 2\nantenna-drive diagnose: nowhere.csv: no such file')


def test_time_is_limited(tmp_path: Path) -> None:
    said = run_command(['trial', '--cases', '100000', '--seed', '1', '--jobs', '1', '--out',
                        str(tmp_path)], limit_s=1.0, program='lab')
    assert said == 'no result after 1 s'


@pytest.mark.skipif(not sys.platform.startswith('linux'), reason='the kernel of Linux does it')
def test_a_command_ends_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    deadline = time.monotonic() + PATIENCE_S
    with subprocess.Popen([sys.executable, '-c', PARENT, str(tmp_path / 'trial')],
                          cwd=ROOT) as parent:
        try:
            # the command is at work once it seals its truths
            while not (tmp_path / 'trial' / 'truth').exists():
                assert time.monotonic() < deadline and parent.poll() is None
                time.sleep(0.02)
            [child] = [int(pid) for path in Path('/proc', str(parent.pid), 'task').glob(
                '*/children') for pid in path.read_text().split()]
        finally:
            parent.kill()
    while _runs(child):
        assert time.monotonic() < deadline, 'the command goes on'
        time.sleep(0.02)


@pytest.mark.skipif(not sys.platform.startswith('linux'), reason='the kernel of Linux tells')
@pytest.mark.parametrize('module', [
    'antenna_drive', 'antenna_drive.nodes.rate_loop_plant', 'antenna_drive.nodes.recorder'])
def test_a_process_ends_at_once_if_its_starter_is_dead_and_not_yet_buried(module: str) -> None:
    with subprocess.Popen([sys.executable, '-c', '']) as starter:
        # a zombie: it has ended and nobody has waited for it
        stat = Path('/proc', str(starter.pid), 'stat')
        while stat.read_text().rpartition(')')[2].split()[0] != 'Z':
            time.sleep(0.02)
        done = subprocess.run(
            [sys.executable, '-m', module], cwd=ROOT, capture_output=True, text=True,
            env={**os.environ, 'SIMGAP_PARENT': str(starter.pid)}, timeout=PATIENCE_S)
    assert (done.returncode, done.stdout, done.stderr) == (0, '', '')


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        return Path('/proc', str(pid), 'cmdline').read_bytes() != b''
    except OSError:
        return False
