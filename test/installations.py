# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Other installations of this source tree than the one that the tests run in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import importlib.util
import os
from pathlib import Path
import runpy
import shutil
import subprocess
import sys
import sysconfig
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
NOT_SOURCE = ('.*', '__pycache__', '*.egg-info', 'build', 'dist', 'install', 'log', 'out')
# pytest would take a module that begins with test_ for tests
NODES = sorted({'signal_generator': 'test_signal'}.get(path.stem, path.stem)
               for path in (ROOT / 'antenna_drive' / 'nodes').glob('*.py')
               if '\nmain = ' in path.read_text(encoding='utf-8'))
# An interpreter of the ROS 2 wheels leaves this to its children, for whom it may be wrong.
WHEELS_MARK = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'


@dataclass(frozen=True)
class Installation:
    """Where the package is installed, and the environment of a shell that may use it."""

    prefix: Path
    environment: Mapping[str, str]


def bare_environment() -> dict[str, str]:
    """Return this process's environment without anything of ROS 2 and of this Python."""
    dropped = {'PYTHONPATH', 'PYTHONHOME', 'VIRTUAL_ENV', 'AMENT_PREFIX_PATH', WHEELS_MARK}
    if WHEELS_MARK in os.environ or 'AMENT_PREFIX_PATH' in os.environ:
        dropped.add('LD_LIBRARY_PATH')
    return {key: value for key, value in os.environ.items() if key not in dropped}


def outside_environment() -> dict[str, str]:
    """Return this process's environment without what makes Python find this source tree."""
    return {**os.environ, 'PYTHONPATH': os.pathsep.join(
        entry for entry in os.environ.get('PYTHONPATH', '').split(os.pathsep)
        if entry and Path(entry).resolve() != ROOT)}


def declared(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return what setup.py says of this package."""
    found: dict[str, Any] = {}
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, 'argv', ['setup.py'])
    monkeypatch.setattr('setuptools.setup', lambda **said: found.update(said))
    runpy.run_path('setup.py')
    return found


def copy_source(target: Path) -> Path:
    """Copy this source tree, as a clone would be, to a folder that is not there yet."""
    shutil.copytree(ROOT, target, ignore=shutil.ignore_patterns(*NOT_SOURCE))
    return target


def build(command: list[str | Path], folder: Path, environment: Mapping[str, str]) -> None:
    """Run a program that installs; what it printed is the failure."""
    done = subprocess.run(command, cwd=folder, env=environment, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0, f'\n{done.stdout}'


def install_in_new_venv(folder: Path) -> Installation:
    """Install a copy of this source tree, with what it needs, into a virtual environment."""
    copy_source(folder / 'source')
    build([sys.executable, '-I', '-m', 'venv', 'venv'], folder, bare_environment())
    build([folder / 'venv' / 'bin' / 'python', '-m', 'pip', 'install', '--quiet', './source'],
          folder, bare_environment())
    return Installation(folder / 'venv', bare_environment())


def install_with_pip(folder: Path) -> Installation:
    """Install a copy of this source tree with pip, for this Python but apart from it."""
    copy_source(folder / 'source')
    prefix = folder / 'prefix'
    environment = outside_environment()
    # without --ignore-installed pip would remove the tree's own installation
    build([sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps', '--ignore-installed',
           '--prefix', prefix, './source'], folder, environment)
    packages = sysconfig.get_path('purelib', 'posix_prefix', {'base': str(prefix)})
    for variable, entry in (('PYTHONPATH', packages), ('AMENT_PREFIX_PATH', str(prefix))):
        environment[variable] = os.pathsep.join(
            filter(None, (entry, environment.get(variable))))
    return Installation(prefix, environment)


def install_with_colcon(folder: Path, *options: str) -> Installation:
    """Build a copy of this source tree in a colcon workspace, or skip where colcon is not."""
    if importlib.util.find_spec('colcon_ros') is None:
        pytest.skip("colcon is not installed: pip install -e '.[colcon]'")
    copy_source(folder / 'src' / 'antenna_drive')
    # As a module, so that the executables get this Python, and not the one that colcon has.
    build([sys.executable, '-m', 'colcon', 'build', *options], folder, outside_environment())
    shell = subprocess.run(['sh', '-c', '. install/local_setup.sh && env -0'], cwd=folder,
                           env={**outside_environment(),
                                'COLCON_CURRENT_PREFIX': str(folder / 'install')},
                           text=True, capture_output=True, check=True)
    return Installation(folder / 'install' / 'antenna_drive', dict(
        entry.split('=', 1) for entry in shell.stdout.split('\0') if entry))
