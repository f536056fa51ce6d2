# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What scripts/set-up decides on each kind of machine, with a stand-in for Python that logs."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess

from antenna_drive.ros_releases import RELEASES
from installations import NODES, ROOT
import pytest

PYTHON = """\
#!/bin/sh
# Answers as the machine that a test describes would, and writes down what it is asked to do.
case "$*" in
    *version_info*) exit "${OLD:-0}";;
    *ensurepip*) exit "${NO_VENV:-0}";;
    *rclpy*) exit "${NO_RCLPY:-0}";;
    "-c "*) exit 0;;
    "-m venv"*) echo "$@" >> "$LOG"
        for venv; do :; done
        mkdir -p "$venv/bin" && cp "$0" "$venv/bin/python";;
    *) echo "$@" >> "$LOG";;
esac
"""
ROS, NO_ROS = {'ROS_DISTRO': 'kilted'}, {'NO_RCLPY': '1'}


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a machine's programs, with that Python in it."""
    programs = tmp_path / 'bin'
    programs.mkdir()
    (programs / 'python').write_text(PYTHON)
    (programs / 'python').chmod(0o755)
    monkeypatch.setenv('PYTHON', str(programs / 'python'))
    monkeypatch.setenv('PATH', f'{programs}:{os.environ["PATH"]}')
    monkeypatch.setenv('LOG', str(tmp_path / 'log'))
    for name in ('ROS_DISTRO', 'ROS'):
        monkeypatch.delenv(name, raising=False)
    return programs


def become(machine: Path, name: str) -> None:
    """Let uname say that the machine is another."""
    (machine / 'uname').write_text(
        f'#!/bin/sh\n[ "$1" = -s ] && echo {name.split()[0]} || echo {name.split()[1]}\n')
    (machine / 'uname').chmod(0o755)


def set_up(machine: Path, **variables: str) -> tuple[int, str, str]:
    """Run the script and return its exit code, what it said and what it did."""
    done = subprocess.run([ROOT / 'scripts' / 'set-up', machine.parent / 'venv'], text=True,
                          env={**os.environ, **variables}, capture_output=True)
    log = machine.parent / 'log'
    return done.returncode, done.stdout + done.stderr, log.read_text() if log.exists() else ''


def test_wheels(machine: Path) -> None:
    """On x86-64 Linux without ROS 2 the wheels are installed."""
    become(machine, 'Linux x86_64')
    code, said, did = set_up(machine, **NO_ROS)
    assert code == 0 and '.[ros,' in did and 'system-site-packages' not in did
    assert 'ROS 2' not in said


def test_more_extras(machine: Path) -> None:
    """Whoever sets up may ask for more; one call of pip installs all."""
    become(machine, 'Linux x86_64')
    did = set_up(machine, **NO_ROS, EXTRAS='colcon,cluster')[2]
    assert did.count('-m pip install') == 1
    assert '.[ros,plot,recording,test,colcon,cluster]' in did


def test_sourced_ros(machine: Path) -> None:
    """A sourced ROS 2 is used, and none is installed beside it."""
    code, said, did = set_up(machine, **ROS)
    assert code == 0 and '--system-site-packages' in did and 'ros,' not in did
    assert 'using the sourced ROS 2 kilted' in said


def test_sourced_ros_of_another_python(machine: Path) -> None:
    """A sourced ROS 2 that this Python cannot load is not counted on."""
    become(machine, 'Linux x86_64')
    assert '.[ros,' in set_up(machine, **ROS, **NO_ROS)[2]


@pytest.mark.parametrize('release', RELEASES)
def test_wheels_of_a_release(machine: Path, release: str) -> None:
    """Whoever names a release gets its wheels and no others."""
    become(machine, 'Linux x86_64')
    code, said, did = set_up(machine, **NO_ROS, ROS=release)
    assert code == 0 and f'.[{release},plot,' in did and 'ros,' not in did.replace(release, '')


@pytest.mark.parametrize('variables, remedy', [
    ({'ROS': 'foxy', **NO_ROS}, f'there are {" ".join(RELEASES)}'),
    ({'ROS': 'jazz', **NO_ROS}, f'there are {" ".join(RELEASES)}'),
    ({'ROS': 'jazzy', **ROS}, 'a shell without')])
def test_wheels_that_cannot_be_had(machine: Path, variables: dict[str, str], remedy: str) -> None:
    """A release that is none, or wheels beside a sourced ROS 2, are refused in one line."""
    code, said, did = set_up(machine, **variables)
    assert code == 1 and did == ''
    assert said.count('\n') == 1 and remedy in said and f'ROS={variables["ROS"]}' in said


@pytest.mark.parametrize('name', ['Darwin arm64', 'Linux aarch64'])
def test_no_wheels(machine: Path, name: str) -> None:
    """Where there are no wheels, one line says what works and what does not."""
    become(machine, name)
    code, said, did = set_up(machine, **NO_ROS)
    assert code == 0 and did
    lines = [line for line in said.splitlines() if 'ROS 2' in line]
    assert len(lines) == 1 and name in lines[0]
    assert 'everything works but the five nodes' in lines[0]


@pytest.mark.parametrize('lack, remedy', [('OLD', 'Python 3.10'), ('NO_VENV', 'python3-venv')])
def test_what_is_missing(machine: Path, lack: str, remedy: str) -> None:
    """A Python that will not do is told in one line, and nothing is begun."""
    code, said, did = set_up(machine, **{lack: '1'}, **NO_ROS)
    assert code == 1 and did == ''
    assert said.count('\n') == 1 and remedy in said


def test_what_ros2_run_looks_for(machine: Path, tmp_path: Path) -> None:
    """The environment holds the index entry, and a launcher of every node."""
    become(machine, 'Linux x86_64')
    assert set_up(machine, **NO_ROS)[0] == 0
    venv = tmp_path / 'venv'
    index = venv / 'share' / 'ament_index' / 'resource_index' / 'packages' / 'antenna_drive'
    assert index.is_file()
    assert (venv / 'share' / 'antenna_drive' / 'package.xml').is_file()
    launchers = {path.name: path for path in (venv / 'lib' / 'antenna_drive').iterdir()}
    assert sorted(launchers) == NODES
    for node, launcher in launchers.items():
        executable = venv / 'bin' / node
        executable.write_text('#!/bin/sh\nprintf "%s\\n" "${0##*/}" "$@"\n')
        executable.chmod(0o755)
        printed = subprocess.run([launcher, '--ros-args', 'a b'], cwd='/', text=True,
                                 capture_output=True, check=True).stdout
        assert printed == f'{node}\n--ros-args\na b\n'


def test_again(machine: Path) -> None:
    """An environment that still runs is kept and brought up to date."""
    become(machine, 'Linux x86_64')
    first = set_up(machine, **NO_ROS)[2]
    second = set_up(machine, **NO_ROS)[2].removeprefix(first)
    assert '-m venv' in first and '-m venv' not in second and '-m pip install' in second
