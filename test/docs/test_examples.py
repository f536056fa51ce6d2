# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The example scripts do what they say."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
import re
import runpy
import subprocess
import sys
from types import ModuleType
from typing import Any

from antenna_drive.cli import main
from antenna_drive.emulator.wiring import DRIVE
from antenna_drive.parameters import load
import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / 'examples'


def run_example(name: str, *words: str) -> str:
    done = subprocess.run([sys.executable, str(EXAMPLES / name), *words], text=True,
                          capture_output=True, env={**os.environ, 'PYTHONPATH': os.pathsep.join(
                              [str(ROOT), os.environ.get('PYTHONPATH', '')])})
    assert (done.returncode, done.stderr) == (0, '')
    return done.stdout


def test_every_script_is_tested() -> None:
    assert {path.name for path in EXAMPLES.glob('*.py')} == {
        'first_run.py', 'variants.py', 'own_recording.py', 'five_processes.py'}


@pytest.mark.slow
def test_first_run() -> None:
    """Both ranges are the published ones, within half of their last digit's unit."""
    lines = run_example('first_run.py').splitlines()
    assert len(lines) == 2
    for line in lines:
        low, high, got_low, got_high = map(float, re.findall(r'\d+\.?\d*', line))
        assert (got_low, got_high) == pytest.approx((low, high), abs=0.1)


@pytest.mark.slow
def test_variants() -> None:
    found = dict(re.findall(r'gap times ([\d.]+): up to ([\d.]+) A', run_example('variants.py')))
    assert sorted(map(float, found)) == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]


@pytest.mark.slow
def test_own_recording(tmp_path: Path) -> None:
    said = run_example('own_recording.py', str(tmp_path))
    assert 'plant/encoder' in said
    assert (tmp_path / 'square.csv').exists()


@pytest.mark.trial
def test_own_recording_is_diagnosed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The wrong tachometer of the example is named, alone or among what looks like it."""
    run_example('own_recording.py', str(tmp_path))
    assert main(['diagnose', str(tmp_path / 'square.csv')]) == 0
    assert 'tach_1.gain' in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec('rclpy') is None, reason='rclpy is not installed')
def test_five_processes(fresh_domain: int) -> None:
    assert ', all equal to the last bit' in run_example('five_processes.py')


class Recorded:
    """A stand-in for whatever a launch file makes: it keeps what it was given."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        self.arguments, self.options = arguments, options


def test_launch_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """Checked as Python only: ros2 launch cannot be had from a package index."""
    for name in ('launch', 'launch.actions', 'launch.substitutions', 'launch_ros',
                 'launch_ros.actions'):
        module = ModuleType(name)
        vars(module).update(dict.fromkeys(
            ('LaunchDescription', 'DeclareLaunchArgument', 'Shutdown', 'LaunchConfiguration',
             'Node'), Recorded))
        monkeypatch.setitem(sys.modules, name, module)
    made = runpy.run_path(str(EXAMPLES / 'launch' / 'drive_launch.py'))
    [entities] = made['generate_launch_description']().arguments
    nodes = {entity.options['name']: entity.options for entity in entities
             if 'executable' in entity.options}
    assert set(nodes) == set(DRIVE.units)
    for name, options in nodes.items():
        # setup.py names an executable after its module, but for one
        node = (DRIVE.units[name].node or '').rpartition('.')[2]
        assert options['executable'] == {'signal_generator': 'test_signal'}.get(node, node)
        assert options['package'] == 'antenna_drive'
    # every parameter is one of the node's, and the configuration is a set that there is
    from antenna_drive.emulator.units import build
    [given] = nodes['test_signal']['parameters']
    assert set(given) - {'config'} <= set(build('test_signal', load()).settings())
    defaults = {entity.arguments[0]: entity.options['default_value'] for entity in entities
                if 'default_value' in entity.options}
    load(defaults['config'])
