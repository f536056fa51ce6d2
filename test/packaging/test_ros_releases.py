# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 releases of the table: extras, pages, and five processes on each of their wheels."""

from __future__ import annotations

from importlib import metadata
import importlib.util
from pathlib import Path
import re
import subprocess
import sys
import sysconfig

from antenna_drive.ros_releases import DEFAULT, extras, release_of, RELEASES, wheels
from installations import bare_environment, build, declared, ROOT
import pytest

TABLE_ROW = re.compile(r'\| (\w+), wheels from PyPI \|.*\| \*\*tried\*\*: (.*?) \|')


def installed() -> str | None:
    """Return the release whose wheels these tests run on."""
    try:
        return release_of(metadata.version('ros-rclpy'))
    except metadata.PackageNotFoundError:
        return None


def test_each_release_is_an_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    said = declared(monkeypatch)['extras_require']
    assert {name: said[name] for name in ('ros', *RELEASES)} == extras()
    assert said['ros'] == said[DEFAULT]
    for wheel in said['ros']:
        # elsewhere pip would look for wheels that are not there
        assert wheel.endswith("; sys_platform == 'linux' and platform_machine == 'x86_64'")


def test_no_wheel_fits_two_releases() -> None:
    """Or a newer one would take the place of the older release's, which does not fit it."""
    for package in zip(*map(wheels, RELEASES), strict=True):
        # ~=X.Y.Z is that minor series alone (PEP 440)
        series = [re.fullmatch(r'([\w-]+)(?:\[\w+\])?~=(\d+\.\d+)\.0', wheel) for wheel in package]
        assert all(series) and len({match[1] for match in series if match}) == 1
        assert len({match[2] for match in series if match}) == len(RELEASES)


def test_a_release_is_known_by_its_rclpy() -> None:
    for release in RELEASES:
        version = wheels(release)[0].partition('~=')[2]
        assert release_of(version.removesuffix('.0') + '.6') == release
    assert release_of('3.3.17') is None, 'that of Humble'


def test_the_page_says_of_each_that_it_was_tried() -> None:
    tried = dict(TABLE_ROW.findall((ROOT / 'docs' / 'distributions.md').read_text()))
    assert [name.lower() for name in tried] == [*RELEASES]


def test_each_is_tested_by_the_workflow() -> None:
    workflow = (ROOT / '.github' / 'workflows' / 'test.yml').read_text()
    for matrix in ('wheels', 'ros'):
        assert f'{matrix}: [{", ".join(RELEASES)}]' in workflow


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec('rclpy') is None, reason='rclpy is not installed')
@pytest.mark.parametrize('release', [name for name in RELEASES if name != installed()])
def test_five_processes_give_the_bits_of_one(release: str, tmp_path: Path,
                                             node_domain: int) -> None:
    """With the wheels of a release that no other test runs on; to install them takes longest."""
    venv = tmp_path / 'venv'
    build([sys.executable, '-I', '-m', 'venv', venv], tmp_path, bare_environment())
    python = venv / 'bin' / 'python'
    build([python, '-m', 'pip', 'install', '--quiet', *wheels(release)], tmp_path,
          bare_environment())
    packages = sysconfig.get_path('purelib', 'posix_prefix', {'base': str(venv)})
    # numpy and the like are those of these tests, and come behind
    Path(packages, 'behind.pth').write_text(sysconfig.get_path('purelib') + '\n')
    environment = {**bare_environment(), 'PYTHONPATH': str(ROOT), 'ROS_DOMAIN_ID': str(
        node_domain), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}

    def run(*words: str) -> str:
        done = subprocess.run([python, '-m', 'antenna_drive', *words], env=environment, text=True,
                              cwd=tmp_path, capture_output=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    assert f'wheels of {release}' in run('doctor', 'nodes')
    assert 'greatest difference 0,' in run('lockstep-check', '--duration', '2')
