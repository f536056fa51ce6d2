# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A recording is whole and of the drive that was started for it, or it is refused."""

from __future__ import annotations

from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any

from antenna_drive.emulator.units import build
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.parameters import load
from antenna_drive.recording.bag_writer import BagWriter
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to start')

from antenna_drive.cli import main  # noqa: E402, I100
from antenna_drive.lockstep.namespaces import AnotherDrive  # noqa: E402
from antenna_drive.recording import own_drive, recorder  # noqa: E402

GIVEN: Mapping[str, Any] = {'test_signal': {'waveform': 'square', 'period': 2, 'run.pace': 0.0},
                            'torque_share': {'bias_pot': 0.5, 'publish_rate': 10.0}}


def told(config: tuple[str, ...] = ('old_circuit',)) -> dict[str, dict[str, Any]]:
    """Return what the nodes of a drive say as a run begins."""
    own: dict[str, Any] = {'test_signal': {'waveform': 'square', 'period': 2.0},
                           'torque_share': {'bias_pot': 0.5}}
    return {unit: json.loads(json.dumps({
        name: value for name, (_, value) in build(
            unit, load(*config), own.get(unit, {})).settings().items()})) for unit in UNITS}


def test_the_parameters_that_were_asked_for_are_accepted() -> None:
    own_drive.check_settings(Path('run'), told(), GIVEN, ('old_circuit',))


def test_another_parameter_or_none_is_refused() -> None:
    with pytest.raises(AnotherDrive, match='run: holds the run of') as other:
        own_drive.check_settings(Path('run'), told(('new_circuit',)), GIVEN, ('old_circuit',))
    assert 'of torque_share is ' in str(other.value)
    changed = told()
    changed['motor_2']['gearbox.stiffness'] *= 0.6
    with pytest.raises(AnotherDrive, match='gearbox.stiffness of motor_2 is '):
        own_drive.check_settings(Path('run'), changed, GIVEN, ('old_circuit',))
    silent = told()
    del silent['plant']
    with pytest.raises(own_drive.IncompleteRecording, match='plant has not told') as missing:
        own_drive.check_settings(Path('run'), silent, GIVEN, ('old_circuit',))
    assert (other.value.status, missing.value.status) == (1, 1)


@pytest.mark.parametrize('rows', [0, 2, 4])
def test_a_bag_with_other_rows_than_steps_is_refused(tmp_path: Path, rows: int) -> None:
    with BagWriter(tmp_path / 'run', {'plant/encoder': 'rad', 'motor_1/current': 'A'}) as bag:
        for k in range(rows):
            bag.write(k, k * 1_000_000, [0.0, 1.0])
    own_drive.check_rows(tmp_path / 'run', rows)
    with pytest.raises(own_drive.IncompleteRecording, match=f'{rows} samples of plant/encoder '):
        own_drive.check_rows(tmp_path / 'run', 3)


@pytest.mark.slow
def test_a_recording_without_its_rows_is_never_called_done(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
        fresh_domain: int) -> None:
    """A second run has a folder of its own, and that of the first was said to hold it."""
    begin = recorder.RunRecorder.begin

    def begin_twice(self: recorder.RunRecorder, run: int, step_s: float) -> None:
        begin(self, run - 1, step_s)
        begin(self, run, step_s)

    monkeypatch.setattr(recorder.RunRecorder, 'begin', begin_twice)
    assert main(['record', '--duration', '0.2', '--out', str(tmp_path / 'run')]) == 1
    said = capsys.readouterr()
    assert said.out == ''
    assert 'run: holds 0 samples of test_signal/rate_command and not 201' in said.err
