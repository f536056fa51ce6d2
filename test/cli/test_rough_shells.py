# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
No traceback, whatever the shell that a command is started from does to it.

Names of files that are not UTF-8; streams that are closed, full, or that nobody reads to their
end; characters that a terminal cannot show; and a compiler that is switched off.
"""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path
import subprocess
import sys

from antenna_drive.cli import main
from installations import NODES, ROOT
import pytest
from simgap.command.programs import BROKEN_PIPE
from simgap.command.remedies import remedy

# A byte that is no UTF-8, as a name from an old camera or another system has it.
BAD = os.fsdecode(b'a\xff')
PROGRAMS = [('-m', 'antenna_drive', '--help'), ('-m', 'antenna_drive', 'doctor', 'machine'),
            ('-m', 'simgap', '--help'), ('-m', 'lab', '--help'),
            *(('-m', f'antenna_drive.nodes.{name}', '--help') for name in NODES
              if name != 'test_signal'), ('-m', 'antenna_drive.nodes.signal_generator', '--help')]


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording whose name and folder are not UTF-8."""
    folder = tmp_path_factory.mktemp('rough') / BAD
    folder.mkdir()
    assert main(['run', '--duration', '4', '--set', 'test_signal.waveform=square',
                 'test_signal.amplitude=0.005', '--out', f'{folder / BAD}.csv']) == 0
    return folder / f'{BAD}.csv'


def run(words: list[str], folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    here = Path.cwd()
    os.chdir(folder)
    try:
        code = main(words)
    finally:
        os.chdir(here)
    said = capsys.readouterr()
    return code, said.out + said.err


@pytest.mark.parametrize('words', [
    ['plot', '{rec}', '--out', '{bad}.png'], ['plot', '{rec}', '--out', '{bad}.svg'],
    ['report', '{rec}', '-o', '{bad}.html', '--json', '{bad}.json'],
    ['report', '{rec}', '--json', '-'], ['export', '{rec}', '{bad}.csv'],
    ['export', '{rec}', '{bad}_field.csv', '--field'], ['import', '{rec}', '{bad}_bag'],
    ['replay', '{rec}', '--out', '{bad}_twin'], ['completion', 'bash'],
    ['article', '--json', '{bad}_article.json'],
    pytest.param(['diagnose', '{rec}', '--report', '{bad}_v.html', '--json', '{bad}_v.json',
                  '--corrected', '{bad}.yaml'], marks=pytest.mark.slow),
    pytest.param(['diagnose-many', '{folder}', '--out', '{bad}_found', '--json', '{bad}.json'],
                 marks=pytest.mark.slow)])
def test_a_name_that_is_not_utf_8_serves_as_any_other(
        words: list[str], recording: Path, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    done = [word.format(rec=recording, folder=recording.parent.parent, bad=BAD) for word in words]
    code, said = run(done, tmp_path, capsys)
    assert code == 0, said
    for path in tmp_path.iterdir():
        if path.suffix == '.html':
            assert 'a\\udcff' in path.read_text(encoding='utf-8')
        elif path.suffix == '.json':
            json.loads(path.read_text(encoding='utf-8'))
    if words[0] == 'diagnose-many':
        [page] = (tmp_path / f'{BAD}_found').glob('*.html')
        # the byte itself, as a link has it
        assert 'href="machines/a%FF/verdict.html"' in page.read_text(encoding='utf-8')


@pytest.mark.parametrize('words', [
    ['plot', BAD], ['report', BAD], ['export', BAD, 'x.csv'], ['import', BAD, 'x'],
    ['replay', BAD], ['diagnose', BAD], ['diagnose-many', BAD], ['propose', BAD],
    ['predict', BAD, '--config', BAD], ['check-model', BAD, BAD],
    ['confusability', '--excitation', BAD],
    ['run', '--duration', '0.1', '--out', 'x.csv', '--config', BAD],
    ['run', '--duration', '0.1', '--out', f'{BAD}/{BAD}.csv'], ['doctor', BAD], [BAD]])
def test_such_a_name_of_nothing_is_refused_in_one_line(
        words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, said = run(words, tmp_path, capsys)
    assert code == 2
    assert len(said.splitlines()) == 1 and said.isprintable() is False  # the end of the line
    assert said.rstrip('\n').isprintable()


def start(words: tuple[str, ...], how: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Start a program from a shell: `how` has "$@" where the program is."""
    return subprocess.run(['bash', '-c', how, 'bash', sys.executable, *words], text=True,
                          errors='replace', capture_output=True, stdin=subprocess.DEVNULL, env={
                              **os.environ, 'PYTHONPATH': str(ROOT), **variables})


@pytest.mark.parametrize('words', PROGRAMS, ids=' '.join)
@pytest.mark.parametrize('how', ['"$@" >&-', '"$@" >&- 2>&- <&-', '"$@" 2>&-'])
def test_closed_streams_are_no_fault(words: tuple[str, ...], how: str) -> None:
    done = start(words, how)
    assert done.returncode == 0, done.stderr
    assert 'Traceback' not in done.stderr


@pytest.mark.parametrize('words', PROGRAMS, ids=' '.join)
def test_a_reader_that_has_left_ends_a_program_without_a_word(words: tuple[str, ...]) -> None:
    # the pipe is closed before the first word is written
    done = start(words, 'set -o pipefail; "$@" | exec 0<&-')
    assert (done.returncode, done.stderr) in ((BROKEN_PIPE, ''), (0, ''))


@pytest.mark.skipif(not Path('/dev/full').exists(), reason='this system has no full device')
@pytest.mark.parametrize('words', [words for words in PROGRAMS if 'nodes' in words[1]
                                   or 'doctor' in words], ids=' '.join)
def test_a_full_disk_is_told(words: tuple[str, ...]) -> None:
    done = start(words, '"$@" > /dev/full')
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1 and os.strerror(errno.ENOSPC) in done.stderr


def test_what_a_terminal_cannot_show_is_shown_otherwise(tmp_path: Path) -> None:
    name = f'{tmp_path}/\N{GREEK SMALL LETTER MU}.csv'
    done = start(('-m', 'antenna_drive', 'run', '--duration', '0.1', '--out', name), '"$@"',
                 PYTHONIOENCODING='ascii:strict')
    assert (done.returncode, done.stderr) == (0, '')
    assert f'{tmp_path}/\\u03bc.csv' in done.stdout


@pytest.mark.parametrize('words', [
    ('-m', 'antenna_drive', 'compile'), ('-m', 'antenna_drive', 'confusability'),
    ('-m', 'antenna_drive', 'run', '--duration', '0.1', '--out', '{out}.csv'),
    ('-m', 'lab', 'trial', '--cases', '1', '--seed', '7', '--out', '{out}')], ids=' '.join)
@pytest.mark.slow
def test_a_compiler_that_is_switched_off_is_told(words: tuple[str, ...], tmp_path: Path) -> None:
    done = start(tuple(word.format(out=tmp_path / 'out') for word in words), '"$@"',
                 NUMBA_DISABLE_JIT='1')
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1 and 'NUMBA_DISABLE_JIT is set' in done.stderr
    off = start(('-m', 'antenna_drive', 'doctor', 'physics'), '"$@"', NUMBA_DISABLE_JIT='1')
    assert off.returncode == 1 and 'NUMBA_DISABLE_JIT is set' in off.stdout


def test_a_library_that_is_there_and_does_not_load_is_told(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As MuJoCo after an upgrade in place, whose own message says what to do."""
    (tmp_path / 'fmpy').mkdir()
    (tmp_path / 'fmpy' / '__init__.py').write_text(
        'try:\n    import fmpy._core\nexcept ModuleNotFoundError as error:\n    raise '
        'ImportError("its core is missing:\\n pip install --force core") from error\n')
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [name for name in sys.modules if name.partition('.')[0] == 'fmpy']:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(ImportError) as caught:
        import fmpy  # noqa: F401
    said = remedy(caught.value)
    assert said == 'fmpy does not load, its core is missing: pip install --force core'
    assert remedy(ImportError('of our own')) is None
