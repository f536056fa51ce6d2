# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What TAB offers in a real bash."""

from __future__ import annotations

from pathlib import Path
import shutil
import subprocess

from antenna_drive.cli import COMMANDS, main
import pytest

pytest.importorskip('shtab', reason='shtab is not installed, see the test extra')
BASH = shutil.which('bash')
# Call the function that bash calls at TAB, as it would; print what it offers.
TAB = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMPREPLY=()
name=$(complete -p antenna-drive | sed 's/.*-F \\([^ ]*\\).*/\\1/')
"$name" antenna-drive "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope='module')
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp('completion') / 'antenna-drive'
    with pytest.MonkeyPatch.context() as patch, path.open('w') as stream:
        patch.setattr('sys.stdout', stream)
        assert main(['completion', 'bash']) == 0
    return path


def offered(script: Path, folder: Path, *words: str) -> set[str]:
    done = subprocess.run(['bash', '-c', TAB, 'bash', str(script), 'antenna-drive', *words],
                          cwd=folder, text=True, capture_output=True, check=True)
    return {line.rstrip('/ ') for line in done.stdout.splitlines()}


@pytest.mark.skipif(BASH is None, reason='no bash')
def test_commands_options_choices_and_files(script: Path, tmp_path: Path) -> None:
    (tmp_path / 'field.csv').write_text('')
    (tmp_path / 'folder').mkdir()
    assert set(COMMANDS) <= offered(script, tmp_path, '')
    assert offered(script, tmp_path, 'diag') == {'diagnose', 'diagnose-many'}
    assert {'--config', '--json', '--report'} <= offered(script, tmp_path, 'diagnose', '--')
    assert offered(script, tmp_path, 'completion', '') >= {'bash', 'zsh', 'tcsh'}
    assert 'field.csv' in offered(script, tmp_path, 'diagnose', 'fi')
    assert offered(script, tmp_path, 'diagnose-many', 'f') == {'folder'}


@pytest.mark.parametrize('shell', ['bash', 'zsh', 'tcsh'])
def test_every_shell_has_a_script(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['completion', shell]) == 0
    said = capsys.readouterr().out
    assert 'diagnose-many' in said
    program = shutil.which(shell)
    if program:
        subprocess.run([program, '-n'], input=said, text=True, check=True)
