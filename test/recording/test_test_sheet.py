# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The test sheet: typed, every entry optional, wrong ones refused with one line."""

from __future__ import annotations

from pathlib import Path

from antenna_drive.recording.sheet import (
    CircuitBias, dump_sheet, load_sheet, Multisine, parse_sheet, sheet_tree, Square, TestSheet,
)
import pytest
from simgap.inputs.plain_yaml import LONGEST_FILE
from simgap.inputs.schema import ParameterError
import yaml

FULL = """\
circuit: new            # torque share constants of Table 1: old | new
filter_1: old
bias: {type: circuit, bias_pot: 0.892, start: steady}
waveform: {type: square, amplitude_deg_s: 0.05, period_s: 6.3, phase: 0.25}
start: rest
elevation_deg: 45.0
sensors: {current_noise_A: 0.01, current_step_A: 0.01, tach_noise_rad_s: 0.0035,
          tach_noise_relative: 0.0015, tach_step_rad_s: 0.002, encoder_bits: 21,
          bias_noise_V: 0.01, bias_step_V: 0.01}
parameter_tolerance: 0.02
"""
VARIANTS = [
    {'bias': {'type': 'fixed', 'voltage_V': 5.69}},
    {'bias': {'type': 'fixed_step', 'voltage_V': 5.69, 'at_s': 1.0}},
    {'bias': {'type': 'circuit'}},
    {'waveform': {'type': 'triangle', 'amplitude_deg_s': 0.685, 'period_s': 5.0}},
    {'waveform': {'type': 'multisine', 'amplitude_deg_s': 0.1, 'frequencies_hz': [0.1, 0.7],
                  'weights': [1.0, 0.5], 'phases': [0.0, 0.3], 'start_s': 1.0}},
    {'waveform': {'type': 'chirp', 'amplitude_deg_s': 0.1, 'f0_hz': 0.1, 'f1_hz': 5.0,
                  'duration_s': 20.0, 'start_s': 0.0}},
    {'sensors': {'encoder_bits': 21}},
    {},
]


def test_every_entry_is_read_with_its_type(tmp_path: Path) -> None:
    path = tmp_path / 'field.yaml'
    path.write_text(FULL)
    sheet = load_sheet(path)
    assert (sheet.circuit, sheet.filter_1, sheet.start) == ('new', 'old', 'rest')
    assert sheet.bias == CircuitBias(bias_pot=0.892, start='steady')
    assert sheet.waveform == Square(amplitude_deg_s=0.05, period_s=6.3, phase=0.25)
    assert sheet.elevation_deg == 45.0
    assert sheet.parameter_tolerance == 0.02
    assert sheet.sensors is not None
    assert sheet.sensors.encoder_bits == 21
    assert type(sheet.sensors.encoder_bits) is int
    assert sheet_tree(sheet) == yaml.safe_load(FULL)


@pytest.mark.parametrize('tree', VARIANTS)
def test_a_sheet_survives_its_own_file(tree: dict[str, object], tmp_path: Path) -> None:
    sheet = parse_sheet(tree)
    path = tmp_path / 'sheet.yaml'
    path.write_text(dump_sheet(sheet))
    assert load_sheet(path) == sheet
    assert sheet_tree(sheet) == tree
    assert bool(sheet) == bool(tree)


def test_nothing_is_known_of_an_empty_file(tmp_path: Path) -> None:
    path = tmp_path / 'sheet.yaml'
    path.write_text('# nothing yet\n')
    assert load_sheet(path) == TestSheet()
    assert isinstance(parse_sheet(VARIANTS[4]).waveform, Multisine)


@pytest.mark.parametrize(('text', 'words'), [
    ('circuit: neu', r"circuit: 'neu' given, allowed is one of old, new"),
    ('cirquit: new', 'cirquit: no such entry, did you mean circuit'),
    ('bias: {bias_pot: 0.8}', r'bias\.type: None given, allowed is one of circuit, fixed'),
    ('bias: {type: fixed, bias_pot: 0.8}', r'bias\.bias_pot: no such entry.*voltage_V'),
    ('bias: {type: circuit, bias_pot: 1.2}', r'bias\.bias_pot: 1.2 given.*from 0 to 1'),
    ('bias: 5.69', 'bias: 5.69 given, allowed is a mapping'),
    ('waveform: {type: square, period_s: 0}', r'waveform\.period_s: 0 given'),
    ('waveform: {type: multisine, weights: [' + 33 * '1,' + ']}',
     r'waveform\.weights: 33 numbers given, allowed are up to 32'),
    ('waveform: {type: square, period_s: 6.3s}', r"waveform\.period_s: '6.3s' given"),
    ('waveform: {type: multisine, weights: [1, x]}', r"waveform\.weights\[1\]: 'x' given"),
    ('waveform: {type: multisine, weights: [1], phases: [0, 0]}', 'waveform:.*one of each'),
    ('sensors: {encoder_bits: 20.5}', r'sensors\.encoder_bits: 20.5 given.*whole'),
    ('elevation_deg: .nan', 'elevation_deg: nan given'),
    ('elevation_deg: yes', 'elevation_deg: True given'),
    ('elevation_deg: 1' + 400 * '0', "elevation_deg: 'a int' given"),
    ('circuit: [new]', "circuit: 'a list' given"),
    ('- circuit', r"\['circuit'\] given, allowed is a mapping"),
    ('start: rest\nstart: rest', 'line 2, column 1: the key start is given twice'),
    ('bias: &a {type: fixed}\nwaveform: *a', 'line 2, column 11: an alias is not allowed'),
    ('circuit: {', 'line 1, column 11'),
    ('{' * 20000, 'nested too deeply'),
    ('? [a, b]\n: 1', 'a key must be a word'),
    ('start: \x00', 'no YAML'),
    ('!!python/object:os.system {}', 'could not determine a constructor'),
    ('elevation_deg: 2026-13-45', 'no YAML, month'),
])
def test_wrong_entries_are_refused_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / 'sheet.yaml'
    path.write_text(text)
    with pytest.raises(ParameterError, match=words) as refusal:
        load_sheet(path)
    assert str(refusal.value).startswith(f'{path}: ')
    assert '\n' not in str(refusal.value)


def test_files_that_are_no_sheet_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match='No such file'):
        load_sheet(tmp_path / 'none.yaml')
    binary = tmp_path / 'binary.yaml'
    binary.write_bytes(b'\xff\xfe\x80')
    with pytest.raises(ParameterError, match='not UTF-8'):
        load_sheet(binary)
    long = tmp_path / 'long.yaml'
    long.write_bytes(b'#' * (LONGEST_FILE + 1))
    with pytest.raises(ParameterError, match='longer than'):
        load_sheet(long)


def test_labels_are_words_numbers_or_on_and_off(tmp_path: Path) -> None:
    path = tmp_path / 'sheet.yaml'
    path.write_text('labels: {load: A, compensation: on, mass: 2.5, round: 3}\n')
    sheet = load_sheet(path)
    assert sheet.labels == (('load', 'A'), ('compensation', 'on'), ('mass', '2.5'), ('round', '3'))
    path.write_text(dump_sheet(sheet))
    assert load_sheet(path) == sheet and hash(sheet) == hash(load_sheet(path))


@pytest.mark.parametrize('labels', ['A', '[A]', '{load: [A]}', '{load: {a: 1}}', '{load: ""}',
                                    '{load: }', '{load: ' + 'x' * 61 + '}', '{1: A}'])
def test_other_labels_are_refused(labels: str, tmp_path: Path) -> None:
    path = tmp_path / 'sheet.yaml'
    path.write_text(f'labels: {labels}\n')
    with pytest.raises(ParameterError, match=r'sheet\.yaml: labels'):
        load_sheet(path)
