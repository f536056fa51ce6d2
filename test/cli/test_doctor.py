# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the doctor says of an installation that is whole, lacks something, or is broken."""

from __future__ import annotations

from importlib import metadata
import importlib.util
import json
from pathlib import Path
import sys
from typing import Any

from antenna_drive import health
from antenna_drive.cli import main
from antenna_drive.ros_releases import RELEASES
from installations import declared
import pytest

Capture = pytest.CaptureFixture[str]


def findings(capture: Capture) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(capture.readouterr().out)['findings']
    return found


def test_what_is_needed_works_here(capsys: Capture) -> None:
    assert main(['doctor', *health.NEEDED, '--json', '-']) == 0
    found = findings(capsys)
    assert {item['part'] for item in found} == set(health.NEEDED)
    assert all(item['state'] in ('ok', 'note') for item in found)
    assert {'numpy', 'scipy', 'numba', 'a run of 0.1 s'} <= {item['what'] for item in found}


def test_a_library_that_is_missing_is_no_fault_unless_it_was_asked_for(
        monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setitem(sys.modules, 'shtab', None)
    assert main(['doctor', 'completion', '--json', '-']) == 3
    [item] = findings(capsys)
    assert (item['state'], item['remedy']) == ('missing', 'pip install shtab')
    monkeypatch.setattr(health, 'PARTS', {'completion': health.PARTS['completion']})
    monkeypatch.setattr('antenna_drive.cli.doctor.PARTS', health.PARTS)
    assert main(['doctor']) == 0
    assert 'pip install shtab' in capsys.readouterr().out


def test_a_library_that_does_not_load_is_a_fault(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    (tmp_path / 'shtab.py').write_text("raise ImportError('libx.so: no such file')")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, 'shtab', raising=False)
    assert main(['doctor', 'completion', '--json', '-']) == 1
    [item] = findings(capsys)
    assert item['state'] == 'broken'
    assert 'libx.so: no such file' in item['found']


def test_an_older_version_than_asked_for_is_a_fault(
        monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr(health, '_bounds', lambda: {'jinja2': '>=99.0'})
    assert main(['doctor', 'pages', '--json', '-']) == 1
    [item] = findings(capsys)
    assert item['found'].endswith('wanted >=99.0')
    assert item['remedy'] == "pip install 'Jinja2>=99.0'"


def test_what_an_upgrade_in_place_took_away_is_told(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    """Two distributions share a folder; removing the older whole one took files of the core."""
    (tmp_path / 'shared_arm').mkdir()
    (tmp_path / 'shared_arm' / '__init__.py').write_text('import shared_arm._core')
    for name, files in {'shared-arm': '__init__.py', 'shared-arm-core': '_core.so.4'}.items():
        info = tmp_path / f'{name.replace("-", "_")}-4.0.dist-info'
        info.mkdir()
        (info / 'METADATA').write_text(f'Metadata-Version: 2.1\nName: {name}\nVersion: 4.0\n')
        (info / 'top_level.txt').write_text('shared_arm')
        (info / 'RECORD').write_text(f'shared_arm/{files},,\n')
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setitem(health.PARTS, 'arm', lambda: health._libraries('arm', 'shared_arm'))
    assert main(['doctor', 'arm', '--json', '-']) == 1
    [item] = findings(capsys)
    assert item['found'] == 'files of shared-arm-core are gone, as after an upgrade in place'
    assert item['remedy'] == 'pip install --force-reinstall --no-deps shared-arm-core'
    (tmp_path / 'shared_arm' / '_core.so.4').touch()
    (tmp_path / 'shared_arm' / '_core.py').touch()
    assert main(['doctor', 'arm', '--json', '-']) == 0
    assert [item['found'] for item in findings(capsys)] == ['4.0']


def test_wheels_of_two_releases_do_not_pass_for_one(
        monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    monkeypatch.setattr(health, '_release', lambda: ('wheels of another', {
        'ros-std-msgs': '>=99', 'std_msgs': '>=99'}))
    assert main(['doctor', 'nodes', '--json', '-']) == 1
    found = {item['what']: item for item in findings(capsys)}
    assert found['std_msgs']['found'].endswith('wanted >=99')
    assert 'a message' not in found, 'no part of such a mixture is tried'


def test_every_extra_is_a_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of ROS 2 releases are one part, and a part is an extra or no choice."""
    assert set(declared(monkeypatch)['extras_require']) - {'ros', *RELEASES} == {
        *health.PARTS} - {*health.NEEDED, 'nodes'}


@pytest.mark.parametrize(('version', 'bounds', 'fits'), [
    ('1.24', '>=1.24', True), ('1.24.3', '>=1.24', True), ('1.9', '>=1.24', False),
    ('0.68.1', '<0.69,>=0.58', True), ('0.69.0', '<0.69,>=0.58', False),
    ('9.1.2', '~=9.1', True), ('10.0', '~=9.1', False), ('2.0+local.7', '>=2.0', True),
    ('1.0', '', True)])
def test_versions(monkeypatch: pytest.MonkeyPatch, version: str, bounds: str,
                  fits: bool) -> None:
    """As PEP 440 has it, for the bounds that are used here."""
    monkeypatch.setattr(metadata, 'version', lambda name: version)
    found = health._library('physics', 'numpy', {'numpy': bounds})
    assert (found.state, found.found.partition(',')[0]) == ('ok' if fits else 'broken', version)


def test_a_check_that_fails_hides_no_other(monkeypatch: pytest.MonkeyPatch,
                                           capsys: Capture) -> None:
    def fails() -> Any:
        raise RuntimeError('unforeseen')

    parts = {'nodes': fails, 'pages': health.PARTS['pages']}
    monkeypatch.setattr(health, 'PARTS', parts)
    monkeypatch.setattr('antenna_drive.cli.doctor.PARTS', parts)
    assert main(['doctor', '--json', '-']) == 1
    assert [(item['part'], item['state']) for item in findings(capsys)] == [
        ('nodes', 'broken'), ('pages', 'ok')]


def test_no_such_part(capsys: Capture) -> None:
    assert main(['doctor', 'node']) == 2
    assert 'node: no such part; there are machine' in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec('rclpy') is None, reason='rclpy is not installed')
def test_a_message_is_sent_and_received(fresh_domain: int, capsys: Capture) -> None:
    assert main(['doctor', 'nodes', '--json', '-']) == 0
    found = {item['what']: item for item in findings(capsys)}
    assert found['a message']['state'] == 'ok'
    assert f'domain {fresh_domain}' in found['discovery']['found']
    assert 'rmw_' in found['ROS 2']['found']
