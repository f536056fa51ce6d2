# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A plain `pip install` without ROS 2, in a virtual environment of its own."""

from __future__ import annotations

from pathlib import Path
import subprocess

from antenna_drive.remedies import ROS_REMEDY
from installations import bare_environment, install_in_new_venv, NODES, ROOT
import pytest
from simgap.command.programs import NOT_INSTALLED
from simgap.command.remedies import REMEDIES

pytestmark = pytest.mark.slow
IMPORT_EVERYTHING = """
import importlib, pkgutil
import antenna_drive

for found in pkgutil.walk_packages(antenna_drive.__path__, 'antenna_drive.'):
    if found.name == 'antenna_drive.__main__':
        continue
    try:
        importlib.import_module(found.name)
    except ModuleNotFoundError as error:
        print(found.name, error.name.partition('.')[0])
"""


@pytest.fixture(scope='module')
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a virtual environment with the package and what it needs, and nothing else."""
    return install_in_new_venv(tmp_path_factory.mktemp('plain')).prefix


def run(prefix: Path, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program of the virtual environment as a user outside of the source tree does."""
    return subprocess.run([prefix / 'bin' / program, *arguments], cwd=prefix, text=True,
                          env=bare_environment(), capture_output=True)


def test_ros_2_is_absent(prefix: Path) -> None:
    """The premise of this file: nothing here brings ROS 2 along."""
    assert run(prefix, 'python', '-c', 'import rclpy').returncode == 1


def test_help(prefix: Path) -> None:
    """The command is on the path and teaches."""
    done = run(prefix, 'antenna-drive', '--help')
    assert (done.returncode, done.stderr) == (0, '')
    assert 'usage: antenna-drive' in done.stdout


def test_engine_comes_along_and_no_laboratory(prefix: Path) -> None:
    """The engine has its own command; the laboratory is run from a checkout."""
    done = run(prefix, 'simgap', '--help')
    assert (done.returncode, done.stderr) == (0, '')
    assert 'usage: simgap' in done.stdout
    assert run(prefix, 'python', '-c', 'import lab').returncode == 1


def test_module(prefix: Path) -> None:
    """`python -m antenna_drive` is the same command."""
    assert (run(prefix, 'python', '-m', 'antenna_drive', '--version').stdout
            == run(prefix, 'antenna-drive', '--version').stdout != '')


def test_config(prefix: Path) -> None:
    """The parameter files are installed in share, and found."""
    done = run(prefix, 'python', '-c', 'from antenna_drive.parameters.files import config_dir; '
                                       'print(config_dir())')
    shared = prefix / 'share' / 'antenna_drive' / 'config'
    assert done.stdout.strip() == str(shared), done.stderr
    assert (sorted(str(path.relative_to(shared)) for path in shared.rglob('*'))
            == sorted(str(path.relative_to(ROOT / 'config'))
                      for path in (ROOT / 'config').rglob('*')) != [])


def test_pages_come_along(prefix: Path, tmp_path: Path) -> None:
    """Templates, style and plotter are installed, and what fills them in."""
    recording = tmp_path / 'field.csv'
    recording.write_text('time_s,rate_command_rad_s\n0.0,0.0\n0.01,0.0\n')
    done = run(prefix, 'antenna-drive', 'report', str(recording), '-o', str(tmp_path / 'a.html'))
    assert (done.returncode, done.stderr) == (0, '')
    page = (tmp_path / 'a.html').read_text()
    assert 'uPlot' in page and '--paper' in page and 'field.csv' in page


def test_everything_but_the_nodes_can_be_imported(prefix: Path) -> None:
    """Only the rooms of ROS 2 need ROS 2, and every other lack has its remedy."""
    done = run(prefix, 'python', '-c', IMPORT_EVERYTHING)
    assert done.returncode == 0, done.stderr
    missing = dict(line.split() for line in done.stdout.splitlines())
    ros = {name for name, module in missing.items() if REMEDIES[module] == ROS_REMEDY}
    assert {name for name in ros
            if name.split('.')[1] not in ('lockstep', 'nodes', 'campaign', 'live')} == set()


@pytest.mark.parametrize('node', NODES)
def test_node_says_what_is_missing(prefix: Path, node: str, tmp_path: Path) -> None:
    """A node says in one line what is missing and how to get it."""
    recording = tmp_path / 'field.csv'
    recording.write_text('time_s,rate_command_rad_s\n0.0,0.0\n0.01,0.0\n')
    done = run(prefix, node, *([str(recording)] if node.endswith('_player') else []))
    assert (done.returncode, done.stdout) == (NOT_INSTALLED, '')
    assert done.stderr.count('\n') == 1
    assert 'rclpy' in done.stderr and 'ROS 2' in done.stderr


def test_command_that_needs_nodes(prefix: Path) -> None:
    """A command that starts nodes says it as well."""
    done = run(prefix, 'antenna-drive', 'lockstep-check', '--duration', '0.1')
    assert (done.returncode, done.stdout) == (NOT_INSTALLED, '')
    assert done.stderr.count('\n') == 1 and 'ROS 2' in done.stderr
