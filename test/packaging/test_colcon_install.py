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
"""What `colcon build` installs, and where."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

from installations import NODES, ROOT, Workspace
import pytest

pytestmark = pytest.mark.slow
SHOW = 'from antenna_drive.parameters.files import config_dir; print(config_dir())'


def files(folder: Path) -> dict[Path, bytes]:
    """Return every file below a folder with its content."""
    return {path.relative_to(folder): path.read_bytes()
            for path in folder.rglob('*') if path.is_file()}


def config_dir_seen_in(workspace: Workspace) -> Path:
    """Return the config folder that a program in the workspace's shell finds."""
    done = subprocess.run([sys.executable, '-c', SHOW], cwd=workspace.folder, text=True,
                          env=workspace.environment(), capture_output=True, check=True)
    return Path(done.stdout.strip())


def test_config_is_shared(workspace: Workspace) -> None:
    """config/ lies in share, whole, and the package finds it there."""
    shared = workspace.install / 'share' / 'antenna_drive' / 'config'
    assert files(shared) == files(ROOT / 'config') != {}
    assert config_dir_seen_in(workspace) == shared


def test_package_is_marked(workspace: Workspace) -> None:
    """ROS 2's index and package.xml are where ROS 2 looks for them."""
    share = workspace.install / 'share'
    assert (share / 'ament_index/resource_index/packages/antenna_drive').is_file()
    assert (share / 'antenna_drive/package.xml').read_text() == (ROOT / 'package.xml').read_text()


def test_executables_are_where_ros2_run_looks(workspace: Workspace) -> None:
    """Every node, and the command, is an executable in lib/antenna_drive."""
    installed = workspace.install / 'lib' / 'antenna_drive'
    assert sorted(path.name for path in installed.iterdir() if path.stat().st_mode & 0o111) == (
        sorted([*NODES, 'antenna-drive']))


def test_command_runs(workspace: Workspace) -> None:
    """The installed command runs in a shell that has sourced the workspace."""
    command = workspace.install / 'lib' / 'antenna_drive' / 'antenna-drive'
    done = subprocess.run([command, '--version'], cwd=workspace.folder, text=True,
                          env=workspace.environment(), capture_output=True, check=True)
    assert done.stdout.startswith('antenna-drive ')


def test_links_lead_to_the_source(linked_workspace: Workspace) -> None:
    """With --symlink-install an edit of a parameter file counts without a new build."""
    source = linked_workspace.folder / 'src' / 'antenna_drive' / 'config'
    assert config_dir_seen_in(linked_workspace) == source
    shared = linked_workspace.install / 'share' / 'antenna_drive' / 'config'
    assert files(shared) == files(ROOT / 'config')
