# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The twin of a recording: the same bits where everything is known, the same motion elsewhere."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

from antenna_drive.cli import main
from antenna_drive.emulator.run import Emulator
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import write_bag
from antenna_drive.recording.csv_format import write_csv
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.replay import command_table, distances, of_sheet, twin
from antenna_drive.recording.runs import from_run
from antenna_drive.recording.sheet import parse_sheet
import numpy as np
import pytest
from simgap.logs.channel import Channel, nanoseconds, RecordingError


def commanded(drive: Drive, **waveform: Any) -> Drive:
    rate = dataclasses.replace(drive.test_signal.rate, **waveform)
    return dataclasses.replace(
        drive, test_signal=dataclasses.replace(drive.test_signal, rate=rate))


def made(drive: Drive, seconds: float, changes: Any = None) -> Recording:
    return from_run(Emulator(drive).run(seconds, changes), drive)


def test_a_square_wave_with_live_changes_is_replayed_to_the_last_bit(tmp_path: Path) -> None:
    drive = commanded(load('new_circuit'), waveform='square', period=1.0,
                      amplitude=math.radians(0.013))
    real = made(drive, 3.0, {700: {'torque_share': {'bias_pot': 0.8}},
                             1500: {'test_signal': {'amplitude': math.radians(0.05)}}})
    write_bag(real, tmp_path / 'real')
    again = twin(read_bag(tmp_path / 'real'))
    assert again.channels == real.channels
    assert again.notes['parameters'] == 'the recording'
    assert list(again.changes) == [c for c in real.changes if c.unit == 'torque_share']
    assert all(d['rms'] == 0.0 for d in distances(real, again).values())


def test_a_saw_tooth_is_replayed_up_to_rounding() -> None:
    drive = commanded(load('old_circuit'), waveform='saw_tooth', period=2.0,
                      amplitude=math.radians(0.685))
    real = made(drive, 4.0)
    for name, distance in distances(real, twin(real)).items():
        if 'missed_impulse' not in name:
            assert distance['rms'] <= 1e-6 * max(distance['spread'], 1e-12), name


def test_a_field_test_is_replayed_from_its_columns_and_sheet(tmp_path: Path) -> None:
    sheet = parse_sheet({'circuit': 'old', 'filter_1': 'new', 'elevation_deg': 30.0,
                         'bias': {'type': 'fixed_step', 'voltage_V': 5.69, 'at_s': 1.0}})
    drive, changes = of_sheet(sheet, 1e-3)
    assert drive.torque_share.filter_1 == load('new_circuit').torque_share.filter_1
    assert drive.torque_share.circuit.k_2 == load('old_circuit').torque_share.circuit.k_2
    assert drive.plant.axis.start_elevation == pytest.approx(math.pi / 6)
    assert changes == {1000: {'torque_share': {'fixed_voltage': 5.69}}}
    drive = commanded(drive, waveform='saw_tooth', period=3.0, amplitude=math.radians(0.1))
    real = made(drive, 6.0, changes)
    thin = Recording({name: Channel(c.unit, c.time_ns[::10], c.values[::10])
                      for name, c in real.channels.items() if name in FIELD_COLUMNS.values()},
                     sheet=sheet)  # 100 Hz, and no configuration
    again = twin(thin)
    assert again.notes['parameters'] == 'the test sheet'
    found = distances(thin, again)
    assert set(found) == set(FIELD_COLUMNS.values())
    for name in ('plant/encoder', 'motor_1/tach_rate', 'torque_share/bias_voltage'):
        assert found[name]['share'] < 0.01, name


def test_the_clock_of_the_real_recording_is_kept() -> None:
    drive = commanded(load(), waveform='step', amplitude=1e-3)
    real = made(drive, 0.2).shift_ns(1_768_472_890_123_456_789)
    assert twin(real)['plant/encoder'] == real['plant/encoder']


def test_values_and_slopes_at_jumps() -> None:
    time = np.arange(12) * 0.1
    channel = Channel('rad/s', nanoseconds(time), np.array(
        [0.0, 1, 2, 3, -50, -49, -48, -47, -46, -45, -44, -43]))
    table = command_table(channel, nanoseconds(np.array(
        [-0.1, 0.0, 0.05, 0.3, 0.35, 0.4, 0.45, 1.1, 1.3])))
    # before it nothing moves; at 0.3 s the jump to -50 is ahead, and the slope goes on as before
    assert table[:, 0] == pytest.approx([0, 0, 0.5, 3, 3.5, -50, -49.5, -43, -43])
    assert table[:, 1] == pytest.approx([0, 10, 10, 10, 10, 10, 10, 0, 0])
    stairs = Channel('rad/s', nanoseconds(time), np.array(
        [0.0, 0, 1, 1, 1, -1, -1, -1, 0, 1, 1, 1]))
    steps = command_table(stairs, nanoseconds(np.arange(0, 1.1, 0.05)))
    assert np.all(steps[:, 1] == 0.0)
    assert set(steps[:, 0]) == {0.0, 1.0, -1.0}
    one = command_table(Channel('rad/s', np.array([5]), np.array([2.0])), np.array([0, 5, 9]))
    assert one.tolist() == [[2.0, 0.0]] * 3


def test_a_sine_has_no_jump() -> None:
    time = np.arange(0, 2, 0.02)
    channel = Channel('rad/s', nanoseconds(time), np.sin(2 * np.pi * time))
    fine = np.arange(0, 1.9, 0.001)
    table = command_table(channel, nanoseconds(fine))
    assert np.abs(table[:, 0] - np.sin(2 * np.pi * fine)).max() < (2 * np.pi * 0.02)**2 / 8 + 1e-9


def test_a_recording_without_a_command_is_refused() -> None:
    with pytest.raises(RecordingError, match='nothing to replay'):
        twin(Recording.from_arrays([0.0], {'plant/encoder': [0.0]}))


def test_the_command_writes_the_twin_beside_the_real_one(
        tmp_path: Path, capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    drive = commanded(load(), waveform='square', period=0.2, amplitude=1e-3)
    write_bag(made(drive, 0.5), tmp_path / 'real')
    assert main(['replay', 'real', '--json', '-']) == 0
    result = json.loads(capsys.readouterr().out)
    assert result['twin'] == str(tmp_path / 'real_twin')
    assert result['signals']['motor_1/current']['rms'] == 0.0
    assert read_bag(tmp_path / 'real_twin').channels == read_bag(tmp_path / 'real').channels
    assert main(['replay', 'real']) == 2
    assert 'real_twin: exists already' in capsys.readouterr().err
    write_csv(read_bag(tmp_path / 'real'), tmp_path / 'field.csv', field=True)
    assert main(['replay', 'field.csv', '--config', 'new_circuit', '--every', '10']) == 0
    other = read_bag(tmp_path / 'field_twin')
    assert np.all(np.diff(other['plant/encoder'].time_ns) == 10_000_000)
    assert other.notes['parameters'] == 'new_circuit'
    assert main(['replay', 'field.csv', '--config', 'none', '--out', 'x']) == 2
    assert 'none: no such file' in capsys.readouterr().err
