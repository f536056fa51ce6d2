# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive's wheel carries the engine, and gives way to an engine that is installed beside it."""

from __future__ import annotations

from collections.abc import Mapping
import json
from pathlib import Path
import subprocess
import sys
import sysconfig
import zipfile

from installations import bare_environment, build, copy_source
import pytest

pytestmark = pytest.mark.slow
WHERE = 'import simgap.cli, antenna_drive; print(simgap.__file__)'
ALONE = 'import simgap.cli; print(simgap.__file__)'
CARRIED = 'antenna_drive/carried/'
Wheels = Mapping[str, Path]


def wheel_of(source: str, folder: Path) -> Path:
    """Build the wheel of a source tree or archive in a folder of its own."""
    target = folder / f'wheel_{Path(source).name}'
    build([sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps', '--wheel-dir', target,
           source], folder, bare_environment())
    [wheel] = target.glob('*.whl')
    return wheel


@pytest.fixture(scope='module')
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of this source tree."""
    return copy_source(tmp_path_factory.mktemp('wheels') / 'source')


@pytest.fixture(scope='module')
def wheels(source: Path) -> Wheels:
    """Return the wheels of the engine and of the drive, in the order in which they were built."""
    # what the first build leaves in its folder must not get into the second
    return {'simgap': wheel_of('./source/simgap', source.parent),
            'antenna_drive': wheel_of('./source', source.parent)}


def names_in(wheel: Path) -> set[str]:
    """Return the files of a wheel without what describes it."""
    return {name for name in zipfile.ZipFile(wheel).namelist() if '.dist-info/' not in name}


class Venv:
    """A virtual environment that finds the libraries of this one, and no package of this tree."""

    def __init__(self, folder: Path) -> None:
        """Make it."""
        build([sys.executable, '-I', '-m', 'venv', folder], folder.parent, bare_environment())
        self.folder = folder
        packages = self.run('-c', 'import sysconfig; print(sysconfig.get_path("purelib"))')
        # a folder on the path, whose own .pth files do not count
        Path(packages, 'zz_libraries.pth').write_text(sysconfig.get_path('purelib') + '\n')

    def run(self, *arguments: str | Path, program: str = 'python') -> str:
        """Run a program of the environment; return what it printed."""
        done = subprocess.run([self.folder / 'bin' / program, *arguments], cwd=self.folder,
                              env=bare_environment(), text=True, capture_output=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout.strip()

    def pip(self, *arguments: str | Path) -> None:
        """Run pip."""
        self.run('-m', 'pip', '--quiet', '--disable-pip-version-check', *arguments)


@pytest.mark.parametrize('order', [('simgap', 'antenna_drive'), ('antenna_drive', 'simgap')],
                         ids=['engine first', 'drive first'])
def test_either_may_come_and_go(wheels: Wheels, order: tuple[str, str], tmp_path: Path) -> None:
    venv = Venv(tmp_path / 'venv')
    for name in order:
        venv.pip('install', '--no-deps', wheels[name])
    assert CARRIED not in venv.run('-c', WHERE)
    venv.pip('uninstall', '--yes', 'simgap')
    assert CARRIED in venv.run('-c', WHERE)
    assert venv.run('--version', program='antenna-drive')
    venv.pip('install', '--no-deps', wheels['simgap'])
    venv.pip('uninstall', '--yes', 'antenna_drive')
    assert CARRIED not in venv.run('-c', ALONE)
    assert venv.run('-m', 'simgap', '--version')


def test_the_drive_alone_brings_both_commands(wheels: Wheels, tmp_path: Path) -> None:
    venv = Venv(tmp_path / 'venv')
    venv.pip('install', '--no-deps', wheels['antenna_drive'])
    for program in ('simgap', 'antenna-drive'):
        assert venv.run('--version', program=program)
    # a folder of packages that is only on the path has no .pth file that counts
    bare = Venv(tmp_path / 'bare')
    bare.pip('install', '--no-deps', '--target', tmp_path / 'packages', wheels['antenna_drive'])
    found = bare.run('-c', f'import sys; sys.path.insert(0, {str(tmp_path / "packages")!r})\n'
                     'import antenna_drive, simgap; print(simgap.__file__)')
    assert CARRIED in found


@pytest.mark.trial
@pytest.mark.timeout(3600)
def test_the_engine_alone_runs_the_example_to_its_verdict(source: Path, wheels: Wheels,
                                                          tmp_path: Path) -> None:
    """No compiler and no YAML: two minutes of processor time instead of five seconds."""
    build([sys.executable, '-I', '-m', 'venv', tmp_path / 'venv'], tmp_path, bare_environment())
    python, joint = tmp_path / 'venv/bin/python', source / 'examples/robot_joint'
    build([python, '-m', 'pip', 'install', '--quiet', wheels['simgap']], tmp_path,
          bare_environment())
    build([python, joint / 'make_logs.py', 'asymmetry', 'logs'], tmp_path, bare_environment())
    build([tmp_path / 'venv/bin/simgap', 'diagnose', joint / 'first.py', 'logs/steps.csv',
           'logs/sweep.csv', '--json', 'verdict.json'], tmp_path, bare_environment())
    verdict = json.loads((tmp_path / 'verdict.json').read_text())
    assert verdict['which'][0]['effects'] == ['motor.friction_asymmetry']


def test_both_wheels_hold_one_engine_and_no_laboratory(wheels: Wheels) -> None:
    engine, drive = (names_in(wheels[name]) for name in ('simgap', 'antenna_drive'))
    carried = {name.removeprefix(CARRIED) for name in drive if name.startswith(CARRIED)}
    assert carried == engine != set()
    assert {name.partition('/')[0] for name in engine} == {'simgap'}
    assert {name.partition('/')[0] for name in drive} == {
        'antenna_drive', 'antenna_drive_carried.pth', 'antenna_drive-0.1.0.data'}
    assert not [name for name in engine if '/build/' in name or '.egg-info' in name]


def test_the_source_archive_makes_the_same_wheel(wheels: Wheels, source: Path) -> None:
    build([sys.executable, 'setup.py', '--quiet', 'sdist', '--dist-dir', '../dist'], source,
          bare_environment())
    [archive] = (source.parent / 'dist').glob('*.tar.gz')
    wheel = wheel_of(str(archive), source.parent)
    assert names_in(wheel) == names_in(wheels['antenna_drive'])
