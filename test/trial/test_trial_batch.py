# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Sealing, making and resuming a trial, and handing its cases to a diagnosis."""

from __future__ import annotations

import csv
import hashlib
import json
from pathlib import Path
import shutil
import sys
from typing import Any

from antenna_drive.recording.csv_format import read_csv
from lab.antenna.cases import make_recording
from lab.cli import main
from lab.trials import batch, sealing
import numpy as np
import pytest
from simgap.errors import UserError
import yaml

SETTINGS = {'count': 3, 'seed': 11, 'tolerance': 0.02, 'sample_rate': 100.0, 'duration': 3.0}
HEADING = ('time_s,rate_command_rad_s,current_1_A,current_2_A,tach_rate_1_rad_s,'
           'tach_rate_2_rad_s,encoder_rad,bias_voltage_V')


def prepare(folder: Path, **changes: Any) -> dict[str, Any]:
    """Seal a small trial."""
    return batch.prepare(folder, **{**SETTINGS, **changes})


@pytest.fixture(scope='module')
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small trial with all recordings."""
    folder = tmp_path_factory.mktemp('trial') / 'small'
    batch.make_cases(folder, prepare(folder), jobs=1)
    return folder


def test_hashes_can_be_checked_by_hand(made: Path) -> None:
    manifest = json.loads((made / 'manifest.json').read_text())
    assert sorted(manifest['seals']) == ['case_0001', 'case_0002', 'case_0003']
    for name, seal in manifest['seals'].items():
        truth = json.loads((made / 'truth' / f'{name}.json').read_text())
        text = json.dumps(truth, sort_keys=True, separators=(',', ':'))
        assert hashlib.sha256(text.encode()).hexdigest() == seal
        assert len(truth['salt']) == 32


def test_same_truth_has_another_hash_in_another_trial(tmp_path: Path) -> None:
    first, second = prepare(tmp_path / 'a'), prepare(tmp_path / 'b')
    assert not set(first['seals'].values()) & set(second['seals'].values())


def test_tampering_is_noticed(tmp_path: Path) -> None:
    manifest = prepare(tmp_path)
    path = tmp_path / 'truth' / 'case_0002.json'
    truth = json.loads(path.read_text())
    truth['tolerance'] = 0.021
    path.write_text(json.dumps(truth))
    with pytest.raises(sealing.SealError, match='case_0002.json: not the truth'):
        sealing.open_truth(tmp_path, 'case_0002', manifest)
    shutil.copy(tmp_path / 'truth' / 'case_0001.json', path)
    with pytest.raises(sealing.SealError, match='not the truth'):
        sealing.open_truth(tmp_path, 'case_0002', manifest)
    path.unlink()
    with pytest.raises(sealing.SealError, match='no such file'):
        sealing.open_truth(tmp_path, 'case_0002', manifest)


@pytest.mark.parametrize('text', [
    '', '[]', '{}', '{"format": 1, "settings": {}, "seals": {"case_0002": ""}}',
    '{"format": 9, "settings": {}, "seals": {}}', '\udcff'])
def test_manifest_that_is_none_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / 'manifest.json').write_bytes(text.encode(errors='surrogateescape'))
    with pytest.raises(sealing.SealError, match='manifest.json'):
        sealing.read_manifest(tmp_path)


def test_recordings_are_in_the_input_format(made: Path) -> None:
    for case in ('case_0001', 'case_0002', 'case_0003'):
        assert sorted(path.name for path in (made / case).iterdir()) == [
            'rec_a.csv', 'rec_a.yaml', 'rec_b.csv', 'rec_b.yaml', 'rec_c.csv', 'rec_c.yaml']
        for name in ('rec_a', 'rec_b', 'rec_c'):
            with open(made / case / f'{name}.csv', newline='') as stream:
                rows = list(csv.reader(stream))
            assert ','.join(rows[0]) == HEADING
            values = np.array(rows[1:], dtype=float)
            assert values.shape == (301, 8)
            assert np.all(np.isfinite(values))
            assert np.all(np.diff(values[:, 0]) > 0.0)
            sheet = yaml.safe_load((made / case / f'{name}.yaml').read_text())
            assert set(sheet) == {'circuit', 'filter_1', 'bias', 'waveform', 'start',
                                  'elevation_deg', 'sensors', 'parameter_tolerance'}
            assert sheet['start'] == 'rest'
            assert 'truth' not in (made / case / f'{name}.yaml').read_text()


def test_another_reader_takes_recording_and_sheet(made: Path) -> None:
    for path in sorted(made.glob('case_*/rec_*.csv')):
        recording = read_csv(path)
        assert len(recording.channels) == 7
        assert recording.sheet.parameter_tolerance == 0.02
        assert recording.sheet.waveform is not None
        assert recording.sheet.sensors is not None


def test_sheet_commands_what_the_csv_holds(made: Path) -> None:
    """The recorded command against the sheet's waveform, written anew from the format's words."""
    for path in sorted(made.glob('case_*/rec_*.yaml')):
        shape = yaml.safe_load(path.read_text())['waveform']
        columns = np.loadtxt(path.with_suffix('.csv'), delimiter=',', skiprows=1)
        t, r = columns[:, 0], np.degrees(columns[:, 1])
        amplitude = shape['amplitude_deg_s']
        if shape['type'] == 'square':
            cycle = np.mod(t / shape['period_s'] + shape['phase'], 1.0)
            expected = np.where(cycle < 0.5, amplitude, -amplitude)
            usable = np.abs(np.mod(cycle, 0.5) - 0.25) < 0.249
        elif shape['type'] == 'triangle':
            cycle = t / shape['period_s'] + shape['phase']
            expected = amplitude * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * cycle))
            usable = np.ones(len(t), dtype=bool)
        elif shape['type'] == 'multisine':
            tau = t - shape['start_s']
            expected = np.zeros(len(t))
            for f, w, p in zip(shape['frequencies_hz'], shape['weights'], shape['phases']):
                expected += amplitude * w * np.sin(2.0 * np.pi * f * tau + p)
            expected[tau < 0.0] = 0.0
            usable = np.abs(tau) > 1e-3
        else:
            tau = t - shape['start_s']
            rise = (shape['f1_hz'] - shape['f0_hz']) / shape['duration_s']
            expected = amplitude * np.sin(
                2.0 * np.pi * (shape['f0_hz'] * tau + 0.5 * rise * tau**2))
            expected[(tau < 0.0) | (tau > shape['duration_s'])] = 0.0
            usable = np.abs(tau - shape['duration_s']) > 1e-3
        # The stamps are 0.05 ms off, and digits do the rest.
        slope = np.gradient(expected, t)
        error = np.abs(r - expected)[usable]
        assert np.all(error < 3e-4 * np.abs(slope[usable]) + 2e-3 * amplitude)


def test_case_can_be_made_again(made: Path) -> None:
    truth = json.loads((made / 'truth' / 'case_0003.json').read_text())
    again = make_recording(truth, 1)
    stored = np.loadtxt(made / 'case_0003' / 'rec_b.csv', delimiter=',', skiprows=1)
    assert stored[:, 2] == pytest.approx(again['current_1_A'], abs=1e-8)
    assert stored[:, 6] == pytest.approx(again['encoder_rad'], rel=1e-10, abs=1e-15)


def test_interrupted_trial_goes_on(made: Path, tmp_path: Path,
                                   monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / 'trial'
    shutil.copytree(made, folder)
    before = (folder / 'case_0001' / 'rec_a.csv').stat().st_mtime_ns
    original = (folder / 'case_0002' / 'rec_c.csv').read_bytes()
    shutil.rmtree(folder / 'case_0002')
    (folder / '.case_0002.4711').mkdir()
    manifest = prepare(folder)
    told: list[tuple[int, int]] = []
    monkeypatch.setattr(batch, 'write_csv', _fails)
    with pytest.raises(OSError, match='disk full'):
        batch.make_cases(folder, manifest, jobs=1)
    assert not (folder / 'case_0002').exists()
    assert not list(folder.glob('.case*'))
    monkeypatch.undo()
    batch.make_cases(folder, manifest, 1, lambda done, total: told.append((done, total)))
    assert told == [(2, 3), (3, 3)]
    assert (folder / 'case_0001' / 'rec_a.csv').stat().st_mtime_ns == before
    assert (folder / 'case_0002' / 'rec_c.csv').read_bytes() == original


def _fails(*_: object) -> None:
    raise OSError('disk full')


def test_several_processes_make_the_same(made: Path, tmp_path: Path) -> None:
    folder = tmp_path / 'trial'
    shutil.copytree(made, folder, ignore=shutil.ignore_patterns('case_????'))
    assert not list(folder.glob('case_*'))
    batch.make_cases(folder, sealing.read_manifest(folder), jobs=2)
    for path in made.glob('case_*/*'):
        assert path.read_bytes() == (folder / path.parent.name / path.name).read_bytes()


def test_other_settings_are_refused(made: Path) -> None:
    with pytest.raises(UserError, match='seed 11, not 12'):
        prepare(made, seed=12)


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Put a small program in the place of the diagnosis; it notes what it was told."""
    program = tmp_path / 'stand_in.py'
    program.write_text(
        'import json, pathlib, sys\n'
        'arguments = sys.argv[3:]\n'
        f'with open({str(tmp_path / "told.txt")!r}, "a") as stream:\n'
        '    stream.write(json.dumps(arguments) + "\\n")\n'
        'if arguments[0] == "predict":\n'
        '    if "broken.yaml" in arguments:\n'
        '        sys.exit("no prediction")\n'
        '    pathlib.Path(arguments[arguments.index("--out") + 1]).write_text("time_s")\n'
        '    sys.exit()\n'
        'if "--corrected" in arguments:\n'
        '    pathlib.Path(arguments[arguments.index("--corrected") + 1]).write_text("")\n'
        'case = pathlib.Path(arguments[1]).parent.name\n'
        'target = arguments[arguments.index("--json") + 1]\n'
        'if case == "case_0002" and "--stumble" in arguments:\n'
        '    sys.exit("stumbled")\n'
        'pathlib.Path(target).write_text("{}")\n')
    launcher = tmp_path / 'launcher'
    launcher.write_text(f'#!/bin/sh\nexec {sys.executable} {program} "$@"\n')
    launcher.chmod(0o755)
    monkeypatch.setattr(sys, 'executable', str(launcher))
    return tmp_path / 'told.txt'


def test_diagnosis_is_told_the_recordings_and_never_the_truth(
        made: Path, tmp_path: Path, stand_in: Path) -> None:
    folder = tmp_path / 'trial'
    shutil.copytree(made, folder)
    manifest = sealing.read_manifest(folder)
    assert batch.diagnose_cases(folder, manifest, 2, ['--stumble'], 60.0) == 1
    assert 'stumbled' in (folder / 'case_0002' / 'failure.txt').read_text()
    assert not (folder / 'case_0002' / 'verdict.json').exists()
    told = [json.loads(line) for line in stand_in.read_text().splitlines()]
    assert len(told) == 3
    for arguments in told:
        assert arguments[0] == 'diagnose'
        assert [Path(a).name for a in arguments[1:4]] == ['rec_a.csv', 'rec_b.csv', 'rec_c.csv']
        assert not any('truth' in argument or 'manifest' in argument for argument in arguments)
    # Once more: only the failed one is tried again.
    assert batch.diagnose_cases(folder, manifest, 1, [], 60.0) == 0
    assert len(stand_in.read_text().splitlines()) == 4
    assert not (folder / 'case_0002' / 'failure.txt').exists()
    assert (folder / 'case_0002' / 'verdict.json').exists()


def test_diagnosis_never_gets_what_is_kept_back(tmp_path: Path, stand_in: Path) -> None:
    folder = tmp_path / 'trial'
    manifest = prepare(folder, count=1, wild=True)
    batch.make_cases(folder, manifest, jobs=1)
    assert (folder / 'kept' / 'case_0001' / 'rec_d.csv').exists()
    assert not list(folder.glob('case_*/rec_d*'))
    assert batch.diagnose_cases(folder, manifest, 1, ['--config', 'mine.yaml'], 60.0) == 0
    told, *others = [json.loads(line) for line in stand_in.read_text().splitlines()]
    assert [Path(a).name for a in told[1:4]] == ['rec_a.csv', 'rec_b.csv', 'rec_c.csv']
    assert not any('kept' in argument or 'rec_d' in argument for argument in told)
    case, recording = folder / 'case_0001', str(folder / 'kept' / 'case_0001' / 'rec_d.csv')
    assert told[told.index('--corrected') + 1] == str(case / 'corrected.yaml')
    # other processes predict it, with the configuration as it was and with the corrected one
    assert others == [
        ['predict', recording, '--config', 'mine.yaml', '--out', str(case / 'before.csv')],
        ['predict', recording, '--config', str(case / 'corrected.yaml'), '--recorder',
         str(case / 'verdict.json'), '--out', str(case / 'after.csv')]]
    verdict = json.loads((case / 'verdict.json').read_text())
    assert verdict == {'held_back': {'before': 'before.csv', 'after': 'after.csv'}}
    # nothing is done twice
    assert batch.diagnose_cases(folder, manifest, 1, [], 60.0) == 0
    assert len(stand_in.read_text().splitlines()) == 3


def test_a_failed_prediction_does_not_lose_the_verdict(
        tmp_path: Path, stand_in: Path) -> None:
    folder = tmp_path / 'trial'
    manifest = prepare(folder, count=1, wild=True)
    batch.make_cases(folder, manifest, jobs=1)
    assert batch.diagnose_cases(folder, manifest, 1, ['--config', 'broken.yaml'], 60.0) == 0
    case = folder / 'case_0001'
    assert json.loads((case / 'verdict.json').read_text()) == {}
    assert 'before: exit code 1\nno prediction' in (case / 'prediction_failure.txt').read_text()
    # once more: the prediction alone is tried again
    assert batch.diagnose_cases(folder, manifest, 1, ['--config=mine.yaml'], 60.0) == 0
    told = [json.loads(line)[0] for line in stand_in.read_text().splitlines()]
    assert told == ['diagnose', 'predict', 'predict', 'predict']
    assert not (case / 'prediction_failure.txt').exists()
    assert 'held_back' in json.loads((case / 'verdict.json').read_text())


def test_a_tame_case_has_no_correction(made: Path, tmp_path: Path, stand_in: Path) -> None:
    folder = tmp_path / 'trial'
    shutil.copytree(made, folder)
    assert batch.diagnose_cases(folder, sealing.read_manifest(folder), 1, [], 60.0) == 0
    assert '--corrected' not in stand_in.read_text()


def test_a_wild_trial_is_not_resumed_as_a_tame_one(tmp_path: Path) -> None:
    prepare(tmp_path, wild=True)
    with pytest.raises(UserError, match='wild True, not None'):
        prepare(tmp_path)
    with pytest.raises(UserError, match='family a, not b'):
        prepare(tmp_path, wild=True, family='b')


@pytest.mark.parametrize('words', [
    ['--family', 'b'], ['--wild', '--sample-rate', '100']])
def test_command_refuses_what_does_not_go_together(
        words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / 'x')
    assert main(['trial', '--cases', '1', '--seed', '1', '--out', out, *words]) == 2
    told = capsys.readouterr().err.strip()
    assert len(told.splitlines()) == 1
    assert words[-2] in told
    assert not (tmp_path / 'x').exists()


@pytest.mark.parametrize(('option', 'value'), [
    ('--cases', '0'), ('--seed', '-1'), ('--tolerance', '0.2'), ('--sample-rate', '20'),
    ('--jobs', '0'), ('--time-limit', '0'), ('--tolerance', 'nan')])
def test_command_refuses_what_is_not_allowed(
        option: str, value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = {'--cases': '1', '--seed': '1', '--out': str(tmp_path / 'x'), option: value}
    words = [word for pair in arguments.items() for word in pair]
    assert main(['trial', *words]) == 2
    told = capsys.readouterr().err.strip()
    assert len(told.splitlines()) == 1
    assert option in told
    assert not (tmp_path / 'x').exists()


def test_command_prints_the_seal_first(tmp_path: Path,
                                       capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / 'trial'
    assert main(['trial', '--cases', '1', '--seed', '2', '--sample-rate', '50', '--jobs', '1',
                 '--out', str(folder)]) == 0
    lines = capsys.readouterr().out.splitlines()
    manifest = json.loads((folder / 'manifest.json').read_text())
    text = json.dumps(manifest, sort_keys=True, separators=(',', ':'))
    assert hashlib.sha256(text.encode()).hexdigest() in lines[0]
    assert (folder / 'case_0001' / 'rec_c.yaml').exists()


def test_command_leaves_out_what_a_file_of_scored_cases_holds(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, rest, file = tmp_path / 'first', tmp_path / 'rest', tmp_path / 'first.jsonl'
    words = ['trial', '--cases', '2', '--sample-rate', '50', '--jobs', '1', '--quiet']
    assert main([*words, '--seed', '2', '--out', str(first)]) == 0
    (first / 'case_0001' / 'failure.txt').write_text('none')
    assert main(['score', str(first), '--cases', str(file), '--json', '-']) == 0
    assert main([*words, '--seed', '2', '--out', str(rest), '--skip', str(file)]) == 0
    assert not (rest / 'case_0001').exists()
    assert ((rest / 'case_0002' / 'rec_a.csv').read_bytes()
            == (first / 'case_0002' / 'rec_a.csv').read_bytes())
    capsys.readouterr()
    assert main([*words, '--seed', '3', '--out', str(tmp_path / 'x'), '--skip', str(file)]) == 2
    assert 'case_0001: is no case of this trial' in capsys.readouterr().err
