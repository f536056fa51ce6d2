# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The style of every file: ament's linters, the licence, types, and the oldest Python."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ('simgap', 'antenna_drive', 'lab', 'test', 'examples')
FILES = sorted(str(path.relative_to(ROOT)) for path in
               (ROOT / 'setup.py', *(p for f in FOLDERS for p in (ROOT / f).rglob('*.py')))
               if not {'build', 'install', 'log'} & set(path.relative_to(ROOT).parts))
HEADER = """\
# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
# Without these flake8 would be content with less than ament_flake8 is.
PLUGINS = ('flake8-builtins', 'flake8-comprehensions', 'flake8-deprecated', 'flake8-docstrings',
           'flake8-import-order', 'flake8-quotes')


def check(module: str, *arguments: str) -> None:
    """Run a linter on every file, with its settings in setup.cfg; its findings are the failure."""
    pytest.importorskip(module, reason=f'{module} is not installed, see the test extra')
    command = [sys.executable, '-m', module, *arguments, *FILES]
    if module == 'vermin':  # which has no __main__
        command[1:3] = ['-c', 'import sys, vermin; sys.exit(vermin.main())']
    done = subprocess.run(command, cwd=ROOT, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0, f'\n{done.stdout}'


def test_flake8() -> None:
    """Ament's rules, with its docstring convention, and none of its plugins missing."""
    pytest.importorskip('flake8', reason='flake8 is not installed, see the test extra')
    version = subprocess.run([sys.executable, '-m', 'flake8', '--version'], cwd=ROOT, text=True,
                             capture_output=True, check=True).stdout.replace('_', '-')
    assert [plugin for plugin in PLUGINS if plugin not in version] == []
    check('flake8')


def test_types() -> None:
    """The types fit."""
    check('mypy')


def test_oldest_python() -> None:
    """Nothing is used that Python 3.10 does not have."""
    # a float has had is_integer for long; that of whole numbers is new, and vermin cannot tell
    check('vermin', '--quiet', '--no-tips', '--violations', '--target=3.10-',
          '--exclude=int.is_integer')


def test_copyright() -> None:
    """Copyright and licence stand at the top of every file, in two lines."""
    assert [file for file in FILES if not (ROOT / file).read_text(
        encoding='utf-8').removeprefix('#!/usr/bin/env python3\n').startswith(HEADER)] == []
