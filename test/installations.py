# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""Other installations of this source tree than the one that the tests run in."""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[1]
NOT_SOURCE = ('.*', '__pycache__', '*.egg-info', 'build', 'dist', 'install', 'log', 'out')
NODES = sorted(path.stem for path in (ROOT / 'antenna_drive' / 'nodes').glob('[a-z]*.py'))


def outside_environment() -> dict[str, str]:
    """
    Return this process's environment without what makes its Python find this source tree.

    The ROS 2 wheels' mark goes too: with it an interpreter of another virtual environment would
    not look for its own libraries.
    """
    ours = ('PYTHONPATH', 'PYTHONHOME', 'VIRTUAL_ENV', '_ROS_WHEELS_BOOTSTRAP_COMPLETE')
    environment = {key: value for key, value in os.environ.items() if key not in ours}
    if '_ROS_WHEELS_BOOTSTRAP_COMPLETE' in os.environ:
        environment.pop('LD_LIBRARY_PATH', None)
    return environment


def copy_source(target: Path) -> Path:
    """Copy this source tree, as a clone would be, to a folder that is not there yet."""
    shutil.copytree(ROOT, target, ignore=shutil.ignore_patterns(*NOT_SOURCE))
    return target


@dataclass(frozen=True)
class Workspace:
    """A colcon workspace with this package built in it."""

    folder: Path

    @property
    def install(self) -> Path:
        """Return the folder that the package was installed into."""
        return self.folder / 'install' / 'antenna_drive'

    def environment(self) -> dict[str, str]:
        """Return the environment of a shell that has sourced the workspace."""
        done = subprocess.run(
            ['sh', '-c', '. ./install/local_setup.sh && env -0'], cwd=self.folder, text=True,
            env=outside_environment() | {'COLCON_CURRENT_PREFIX': str(self.folder / 'install')},
            capture_output=True, check=True)
        return dict(entry.split('=', 1) for entry in done.stdout.split('\0') if entry)


def colcon_build(folder: Path, *options: str) -> Workspace:
    """Build a copy of this source tree in a new workspace, or skip where colcon is not."""
    colcon = shutil.which('colcon', path=f'{Path(sys.executable).parent}:{os.environ["PATH"]}')
    if colcon is None:
        pytest.skip("colcon is not installed: pip install -e '.[colcon]'")
    copy_source(folder / 'src' / 'antenna_drive')
    done = subprocess.run(
        [colcon, '--log-base', 'log', 'build', *options], cwd=folder, text=True,
        env=outside_environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0, done.stdout
    return Workspace(folder)
