# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What `colcon build` and `pip install` put where."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

from installations import install_with_colcon, Installation, NODES, ROOT
import pytest

pytestmark = pytest.mark.slow
SHOW = 'from antenna_drive.parameters.files import config_dir; print(config_dir())'


@pytest.fixture(params=['colcon', 'pip'])
def installation(request: pytest.FixtureRequest) -> Installation:
    """Return the package installed in either way."""
    installation = request.getfixturevalue(f'{request.param}_installation')
    assert isinstance(installation, Installation)
    return installation


def files(folder: Path) -> dict[Path, bytes]:
    """Return every file below a folder with its content."""
    return {path.relative_to(folder): path.read_bytes()
            for path in folder.rglob('*') if path.is_file()}


def config_dir_seen_in(installation: Installation) -> Path:
    """Return the config folder that a program of the installation finds."""
    done = subprocess.run([sys.executable, '-c', SHOW], cwd=installation.prefix, text=True,
                          env=installation.environment, capture_output=True, check=True)
    return Path(done.stdout.strip())


def test_config_is_shared(installation: Installation) -> None:
    """config/ lies in share, whole, and the package finds it there."""
    shared = installation.prefix / 'share' / 'antenna_drive' / 'config'
    assert files(shared) == files(ROOT / 'config') != {}
    assert config_dir_seen_in(installation) == shared


def test_package_is_marked(installation: Installation) -> None:
    """ROS 2's index and package.xml are where ROS 2 looks for them."""
    share = installation.prefix / 'share'
    assert (share / 'ament_index/resource_index/packages/antenna_drive').is_file()
    assert (share / 'antenna_drive/package.xml').read_text() == (ROOT / 'package.xml').read_text()


def test_executables_are_where_ros2_run_looks(installation: Installation) -> None:
    """Every node is an executable in lib/antenna_drive."""
    installed = installation.prefix / 'lib' / 'antenna_drive'
    executables = {path.name for path in installed.iterdir() if path.stat().st_mode & 0o111}
    assert executables - {'antenna-drive', 'simgap'} == set(NODES)


@pytest.mark.parametrize('way, folder', [('colcon', 'lib/antenna_drive'), ('pip', 'bin')])
def test_command_runs(request: pytest.FixtureRequest, way: str, folder: str) -> None:
    """The installed command runs."""
    installation = request.getfixturevalue(f'{way}_installation')
    done = subprocess.run([installation.prefix / folder / 'antenna-drive', '--version'],
                          cwd=installation.prefix, env=installation.environment, text=True,
                          capture_output=True, check=True)
    assert done.stdout.startswith('antenna-drive ')


def test_links_lead_to_the_source(tmp_path: Path) -> None:
    """With --symlink-install an edit of a parameter file counts without a new build."""
    linked = install_with_colcon(tmp_path, '--symlink-install')
    assert config_dir_seen_in(linked) == tmp_path / 'src' / 'antenna_drive' / 'config'
    assert files(linked.prefix / 'share' / 'antenna_drive' / 'config') == files(ROOT / 'config')
