# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A test sheet that test_signal plays, in five real processes, and that the bag carries."""

from __future__ import annotations

from pathlib import Path

from antenna_drive.diagnosis.excitation import SheetCommand
from antenna_drive.emulator.units import build
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep.exchange import compile_ahead
from antenna_drive.nodes.signal_generator import main
from antenna_drive.parameters import load
from antenna_drive.recording.files import read_recording
from antenna_drive.recording.sheet import load_sheet
from antenna_drive.recording.sheet_signal import settings_for
import numpy as np
from numpy.typing import NDArray
import pytest

TIME: NDArray[np.float64] = np.arange(601, dtype=np.float64) * 1e-3
SHEET = """\
waveform:
  type: knots
  times_s: [0.1, 0.3, 0.3, 0.5]
  rates_deg_s: [0.0, 0.2, -0.1, -0.1]
bias: {type: fixed, voltage_V: 5.0}
"""


def test_the_unit_plays_what_the_sheet_says(tmp_path: Path) -> None:
    (tmp_path / 'next.yaml').write_text(SHEET)
    sheet = load_sheet(tmp_path / 'next.yaml')
    assert sheet.waveform is not None
    unit = build('test_signal', load(), settings_for(sheet.waveform))
    played = [unit.start(1e-3)[0, 0]] + [unit.step(k, np.zeros((0, 2)))[0, 0] for k in range(599)]
    expected = SheetCommand(sheet.waveform)(TIME[:600])
    assert np.abs(np.array(played) - expected).max() < 1e-15


@pytest.mark.slow
def test_five_processes_play_the_sheet_and_the_bag_carries_it(
        tmp_path: Path, fresh_domain: int) -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')
    from antenna_drive.cli import main as command
    for unit in UNITS:  # or both motors would compile at once
        compile_ahead(build(unit, load()))
    (tmp_path / 'next.yaml').write_text(SHEET)
    assert command(['record', '--duration', '0.6', '--out', str(tmp_path / 'bag'), '--play',
                    str(tmp_path / 'next.yaml'), '--quiet']) == 0
    recording = read_recording(tmp_path / 'bag')
    sheet = load_sheet(tmp_path / 'next.yaml')
    assert recording.sheet == sheet and sheet.waveform is not None
    command_played = recording['test_signal/rate_command'].values
    expected = SheetCommand(sheet.waveform)(TIME[:command_played.size])
    assert np.abs(command_played - expected).max() < 1e-15
    # the source of the sheet gives the bias
    assert recording['torque_share/bias_voltage'].values[-1] == pytest.approx(5.0, abs=1e-6)


@pytest.mark.parametrize('text, words', [
    ('elevation_deg: 30.0', 'waveform: is missing'), ('waveform: {type: sawtooth}', 'sawtooth')])
def test_a_sheet_that_cannot_be_played_is_refused(
        text: str, words: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    (tmp_path / 'next.yaml').write_text(text)
    assert main(['--ros-args', '-p', f'sheet:={tmp_path / "next.yaml"}']) == 2
    assert words in capfd.readouterr().err
