# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The antenna-drive command: what it lists, what it imports, how it fails."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import signal
import subprocess
import sys

from antenna_drive import __version__, cli
from hypothesis import given, strategies as st
import pytest
from simgap.command.program import Command
from simgap.command.programs import BAD_INPUT, NOT_INSTALLED
from simgap.errors import UserError
from simgap.inputs.schema import ParameterError

ROOT = Path(__file__).resolve().parents[2]
FakeCommand = Callable[[str], None]
MODULE = """\
import time

def add_arguments(parser):
    pass

def run(args):
    {}
"""
PROGRAM = """\
import sys
from antenna_drive import cli

cli.__path__.append({!r})
cli.COMMANDS['fake'] = cli.Command('fake', '')
sys.exit(cli.main(['fake']))
"""


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeCommand:
    """Return a function that gives the command a subcommand `fake` with this body."""
    def write(body: str) -> None:
        (tmp_path / 'fake.py').write_text(MODULE.format(body))
        monkeypatch.setattr(cli, '__path__', [*cli.__path__, str(tmp_path)])
        monkeypatch.setitem(cli.COMMANDS, 'fake', Command('fake', 'for tests'))
        monkeypatch.delitem(sys.modules, 'antenna_drive.cli.fake', raising=False)
    return write


def start(tmp_path: Path, body: str) -> subprocess.Popen[str]:
    """Start the command in a process of its own, with a subcommand `fake` of this body."""
    (tmp_path / 'fake.py').write_text(MODULE.format(body))
    program = PROGRAM.format(str(tmp_path))
    return subprocess.Popen([sys.executable, '-c', program], cwd=ROOT, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_help_lists_what_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    """Every command whose file is there is listed, and no other."""
    with pytest.raises(SystemExit) as left:
        cli.main(['--help'])
    assert left.value.code == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()
              if line.startswith('    ')]
    folder = ROOT / 'antenna_drive' / 'cli'
    assert [name for name in listed if name in cli.COMMANDS] == [
        name for name, command in cli.COMMANDS.items()
        if (folder / f'{command.module}.py').is_file() or command.module == 'simgap.cli.check']


def test_every_command_file_is_listed() -> None:
    """No file of the folder is forgotten in the list of commands."""
    commands = {path.stem for path in (ROOT / 'antenna_drive' / 'cli').glob('[a-z]*.py')
                if 'def add_arguments(' in path.read_text(encoding='utf-8')}
    assert commands == {command.module for command in cli.COMMANDS.values()
                        if not command.module.startswith('simgap.')}


def test_help_imports_nothing_heavy() -> None:
    """Help comes at once: the compiler, ROS 2 and the scientific libraries stay out of it."""
    done = subprocess.run(
        [sys.executable, '-c', 'import sys\nfrom antenna_drive import cli\n'
         'try:\n    cli.main(["--help"])\nexcept SystemExit:\n    print(*sys.modules)'],
        cwd=ROOT, text=True, capture_output=True, check=True)
    assert not {'numba', 'scipy', 'numpy', 'rclpy', 'yaml'} & set(done.stdout.split())


@pytest.mark.parametrize('name', list(cli.COMMANDS))
def test_every_command_teaches(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Each command's help says what it does."""
    with pytest.raises(SystemExit) as left:
        cli.main([name, '--help'])
    assert left.value.code == 0
    assert f'usage: antenna-drive {name}' in capsys.readouterr().out


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    """The version is the package's."""
    with pytest.raises(SystemExit):
        cli.main(['--version'])
    assert capsys.readouterr().out == f'antenna-drive {__version__}\n'


def test_no_command(capsys: pytest.CaptureFixture[str]) -> None:
    """Without a command the usage is shown, and the exit code is that of wrong input."""
    with pytest.raises(SystemExit) as left:
        cli.main([])
    assert left.value.code == BAD_INPUT
    assert 'usage: antenna-drive' in capsys.readouterr().err


def test_misspelt_command(fake: FakeCommand, capsys: pytest.CaptureFixture[str]) -> None:
    """A misspelt command gets a guess at what was meant."""
    fake('return 0')
    assert cli.main(['fkae']) == BAD_INPUT
    assert capsys.readouterr().err == (
        'antenna-drive fkae: no such command, did you mean fake?\n')


@pytest.mark.parametrize('typed', ['calibrate', 'calibrat'])
def test_a_command_that_has_moved(typed: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What to type now is said."""
    assert cli.main([typed, 'article', '--out', 'x.yaml']) == BAD_INPUT
    assert capsys.readouterr().err == (
        f'antenna-drive {typed}: no such command, did you mean lab calibrate?\n')


def test_exit_code_is_the_commands(fake: FakeCommand) -> None:
    """What the command returns is the exit code."""
    fake('return 1')
    assert cli.main(['fake']) == 1


@pytest.mark.parametrize('error', [UserError, ParameterError])
def test_user_errors_are_one_line(fake: FakeCommand, error: type[UserError],
                                  capsys: pytest.CaptureFixture[str]) -> None:
    """An error that is the user's to mend is one line without a traceback."""
    fake(f'from {error.__module__} import {error.__name__} as E; raise E("a.yaml:\\n  b: wrong")')
    assert cli.main(['fake']) == BAD_INPUT
    assert capsys.readouterr().err == 'antenna-drive fake: a.yaml: b: wrong\n'


@given(st.text(), st.integers(0, 3 * UserError.LONGEST))
def test_an_error_is_a_printable_line_of_bounded_length(quoted: str, times: int) -> None:
    """What a file held may be quoted: a null byte, an escape sequence, a megabyte of brackets."""
    message = str(UserError(f'a.yaml: {quoted}{"[" * times}; mend it'))
    assert message.isprintable() and len(message) <= UserError.LONGEST
    assert message.startswith('a.yaml: ') and message.endswith('; mend it')


def test_missing_file(fake: FakeCommand, tmp_path: Path,
                      capsys: pytest.CaptureFixture[str]) -> None:
    """The operating system's refusals name the file."""
    missing = tmp_path / 'missing.csv'
    fake(f'open({str(missing)!r})')
    assert cli.main(['fake']) == BAD_INPUT
    assert capsys.readouterr().err == (
        f'antenna-drive fake: {missing}: No such file or directory\n')


def test_missing_installation(fake: FakeCommand, monkeypatch: pytest.MonkeyPatch,
                              capsys: pytest.CaptureFixture[str]) -> None:
    """A library that a plain installation lacks is named with the way to get it."""
    fake('import rclpy.node')
    monkeypatch.setitem(sys.modules, 'rclpy', None)
    assert cli.main(['fake']) == NOT_INSTALLED
    error = capsys.readouterr().err
    assert error.startswith('antenna-drive fake: needs rclpy: source a ROS 2')
    assert error.count('\n') == 1


def test_faults_of_ours_are_not_hidden(fake: FakeCommand) -> None:
    """A fault of the program keeps its traceback."""
    fake('import no_such_module_of_ours')
    with pytest.raises(ModuleNotFoundError):
        cli.main(['fake'])


def test_interrupt(tmp_path: Path) -> None:
    """Ctrl-C ends a command with one line and the exit code that shells give it."""
    # signal.pause() would wait for a second signal, had the first come just before it
    process = start(tmp_path, 'print("ready", flush=True)\n    while True: time.sleep(0.05)')
    assert process.stdout is not None
    assert process.stdout.readline() == 'ready\n'
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=30)
    assert (process.returncode, error) == (130, 'antenna-drive fake: interrupted\n')


THREADS = """from concurrent.futures import ThreadPoolExecutor
    pool = ThreadPoolExecutor(2)
    tasks = [pool.submit(time.sleep, 3600) for _ in range(5)]
    print('ready', flush=True)
    tasks[0].result()"""
HANGING = """try:
        print('ready', flush=True)
        while True: time.sleep(0.05)
    finally:
        print('unwinding', flush=True)
        while True: time.sleep(0.05)"""
PROCESSES = """from antenna_drive.workers import worker_processes
    import os
    with worker_processes(2) as pool:
        print(*{pool.submit(os.getpid).result() for _ in range(5)}, flush=True)
        pids = [pool.submit(os.getpid) for _ in range(50)]
        tasks = [pool.submit(time.sleep, 3600) for _ in range(5)]
        print(*{pid.result() for pid in pids}, flush=True)
        print('ready', flush=True)
        tasks[0].result()"""


def test_interrupt_with_threads_at_work(tmp_path: Path) -> None:
    """Threads that still compute are not waited for."""
    process = start(tmp_path, THREADS)
    assert process.stdout is not None
    assert process.stdout.readline() == 'ready\n'
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=30)
    assert (process.returncode, error) == (130, 'antenna-drive fake: interrupted\n')


def test_second_interrupt(tmp_path: Path) -> None:
    """Whatever hangs while the first interrupt goes through it, the second ends it."""
    process = start(tmp_path, HANGING)
    assert process.stdout is not None
    assert process.stdout.readline() == 'ready\n'
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == 'unwinding\n'
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=30)
    assert (process.returncode, error) == (130, 'antenna-drive fake: interrupted\n')


@pytest.mark.skipif(not sys.platform.startswith('linux'), reason='no /proc')
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL])
def test_no_worker_outlives_the_command(tmp_path: Path, number: signal.Signals) -> None:
    """Ctrl-C reaches the workers too; a parent that is killed says nothing to them."""
    process = start(tmp_path, PROCESSES)
    assert process.stdout is not None and process.stderr is not None
    pids: set[int] = set()
    for line in process.stdout:
        if line == 'ready\n':
            break
        pids |= {int(word) for word in line.split()}
    assert pids and all(Path(f'/proc/{pid}').exists() for pid in pids)
    if number == signal.SIGINT:
        for pid in pids:
            os.kill(pid, number)
    process.send_signal(number)
    # the end of what is written is the end of the last who could write
    assert process.stdout.read() == ''
    error = process.stderr.read()
    code = process.wait(timeout=30)
    process.stdout.close()
    process.stderr.close()
    assert (code, error) == ((130, 'antenna-drive fake: interrupted\n')
                             if number == signal.SIGINT else (-9, ''))


def test_overflow_in_a_search_is_not_told(tmp_path: Path) -> None:
    """A trial that runs away is given up; the warnings of the arithmetic help nobody."""
    process = start(tmp_path, """import numpy as np
    x = np.array([1e300, -1.0])
    print(float((x * x)[0]), np.sqrt(x)[1], (x / 0.0)[0])
    import warnings
    warnings.warn('of another kind')
    return 0""")
    out, error = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, 'inf nan inf\n')
    assert 'encountered' not in error
    assert 'of another kind' in error


def test_reader_gone(tmp_path: Path) -> None:
    """A command whose output is cut short, as by head, ends in silence."""
    process = start(tmp_path, 'print("line\\n" * 100000)')
    assert process.stdout is not None and process.stderr is not None
    assert process.stdout.readline() == 'line\n'
    process.stdout.close()
    assert process.stderr.read() == ''
    assert process.wait(timeout=30) == 141
    process.stderr.close()
