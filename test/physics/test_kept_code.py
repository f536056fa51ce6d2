# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Compiled code that is kept on disk: a damaged file, a full or a closed disk cost time alone."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import subprocess
import sys

import pytest

# Both ways in which code is kept: a function of a module, and a text of functions.
PROGRAM = """
import functions
from pathlib import Path
import resource
import signal
import sys
from numba.core import event
from simgap.laws.compiling import generated, Keeping

keeping = Keeping('kept', frozenset({Path(functions.__file__).parent}))
if len(sys.argv) > 1:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
with event.install_recorder('numba:compile') as compiled:
    half = keeping.compiled(functions.half)
    text = '''
@compiled
def third(x):
    return x / 3.0
'''
    third = generated(keeping, 'thirds', text, {}).third
    print(half(5.0), third(6.0), end=' ')
print(any(item.is_start for _, item in compiled.buffer))
"""
FUNCTIONS = """
def half(x):
    return x / 2.0
"""
COMPILED, KEPT = '2.5 2.0 True\n', '2.5 2.0 False\n'


class Program:
    """A program that keeps what it compiles in a folder."""

    def __init__(self, folder: Path) -> None:
        self.cache = folder / 'cache'
        (folder / 'functions').mkdir()
        (folder / 'functions' / '__init__.py').write_text(FUNCTIONS)
        self._folder = folder

    def run(self, *arguments: str) -> tuple[str, str]:
        """Return what it prints and what it says, once it has ended well."""
        done = subprocess.run(
            [sys.executable, '-c', PROGRAM, *arguments], cwd=self._folder, text=True,
            capture_output=True, env={**os.environ, 'NUMBA_CACHE_DIR': str(self.cache)})
        assert done.returncode == 0, done.stderr
        return done.stdout, done.stderr

    def files(self) -> list[Path]:
        """Return the files that are kept of compiled code."""
        return list(self.cache.rglob('*.nb?'))


@pytest.fixture
def program(tmp_path: Path) -> Program:
    """Return a program that has run once."""
    found = Program(tmp_path)
    assert found.run() == (COMPILED, '')
    assert found.run() == (KEPT, '')
    assert len(found.files()) == 4, 'an index and the code of each function'
    return found


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    'emptied': lambda content: b'', 'cut off': lambda content: content[:len(content) // 2],
    'zeros': lambda content: bytes(len(content))}


@pytest.mark.parametrize('damage', DAMAGES)
@pytest.mark.parametrize('suffix', ['.nbi', '.nbc'])
@pytest.mark.slow
def test_a_damaged_file_is_told_and_replaced(program: Program, suffix: str, damage: str) -> None:
    for path in program.files():
        if path.suffix == suffix:
            path.write_bytes(DAMAGES[damage](path.read_bytes()))
    printed, said = program.run()
    assert printed == COMPILED
    folders = {str(path.parent) for path in program.files()}
    assert len(folders) == 2
    assert {line.partition(': ')[0] for line in said.splitlines()} <= {
        *folders, *(str(Path(folder).parent) for folder in folders)}
    assert all(line.endswith('compiled again, a file is damaged') for line in said.splitlines())
    assert 1 <= said.count('\n') <= 2
    assert program.run() == (KEPT, '')


@pytest.mark.slow
def test_a_full_disk_is_told_and_stops_nothing(tmp_path: Path) -> None:
    program = Program(tmp_path)
    printed, said = program.run('full')
    assert printed == COMPILED
    assert str(program.cache) in said
    assert 'File too large' in said
    assert 'Traceback' not in said
    assert program.run() == (COMPILED, ''), 'there is room again'
    assert program.run() == (KEPT, '')
    # a disk that is full when a file is found damaged
    for path in program.files():
        path.write_bytes(b'')
    assert program.run('full')[0] == COMPILED
    assert program.run()[0] == COMPILED
    assert program.run() == (KEPT, '')


@pytest.mark.skipif(not hasattr(os, 'geteuid') or os.geteuid() == 0,
                    reason='root reads and writes everything')
def test_a_file_that_may_not_be_read_is_told(program: Program) -> None:
    for path in program.files():
        path.chmod(0)
    printed, said = program.run()
    assert printed == COMPILED
    assert 'Permission denied' in said
