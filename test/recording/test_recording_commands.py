# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The commands on recordings, as people type them."""

from __future__ import annotations

import json
import math
from pathlib import Path

from antenna_drive.cli import main
from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import write_bag
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import parse_sheet
import numpy as np
import pytest
from rosbags.highlevel import AnyReader

PNG, PDF = b'\x89PNG\r\n\x1a\n', b'%PDF-'


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write a bag into the current folder."""
    monkeypatch.chdir(tmp_path)
    time = np.arange(600) * 0.01
    recording = Recording.from_arrays(
        time, {**{name: np.sin(time + i) for i, name in enumerate(FIELD_COLUMNS.values())},
               'plant/axis_rate': np.cos(time)},
        configuration={'axis': {'gear_ratio': 14868.0}}, sheet=parse_sheet({'circuit': 'new'}))
    write_bag(recording, tmp_path / 'run')
    return tmp_path / 'run'


def test_export_and_import_are_inverse(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['export', 'run', 'out.csv']) == 0
    assert capsys.readouterr().out.split() == ['out.meta.json', 'out.yaml', 'out.csv']
    assert main(['import', 'out.csv', 'again']) == 0
    assert read_bag(bag.parent / 'again') == read_bag(bag)
    with AnyReader([bag.parent / 'again']) as reader:
        assert reader.message_count == 600 * 8


def test_a_part_of_a_bag_in_the_columns_of_a_field_test(bag: Path) -> None:
    assert main(['export', 'run', 'field.csv', '--field', '--from', '1', '--to', '2']) == 0
    lines = (bag.parent / 'field.csv').read_text().splitlines()
    assert lines[0] == ','.join(['time_s', *FIELD_COLUMNS])
    assert len(lines) == 101
    assert lines[1].split(',')[1] == repr(float(np.sin(1.0)))


def test_only_some_signals(bag: Path) -> None:
    assert main(['export', 'run', 'some.csv', '--signals', 'motor_*/ammeter']) == 0
    header = (bag.parent / 'some.csv').read_text().splitlines()[0]
    assert header == 'time_s,motor_1/ammeter [article A],motor_2/ammeter [article A]'


def test_a_csv_of_others_comes_in_through_a_map(bag: Path,
                                                capsys: pytest.CaptureFixture[str]) -> None:
    (bag.parent / 'log.csv').write_text('Time;Rate\n0;90\n10;-90\n')
    (bag.parent / 'map.yaml').write_text(
        'time: {column: Time, unit: ms}\ndelimiter: ";"\n'
        'signals: {test_signal/rate_command: {column: Rate, unit: deg/s}}\n')
    assert main(['import', 'log.csv', 'log', '--map', 'map.yaml']) == 0
    assert capsys.readouterr().out == 'test_signal/rate_command [rad/s]: 2 samples\n'
    assert read_bag(bag.parent / 'log')['test_signal/rate_command'].values == pytest.approx(
        [math.pi / 2, -math.pi / 2])


def test_zero_samples_are_never_a_success(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['export', 'run', 'field.csv', '--field']) == 0
    head = Path('field.csv').read_text().splitlines(keepends=True)[0]
    Path('none.csv').write_text(head)
    Path('map.yaml').write_text('time: {column: time_s}\n'
                                'signals: {plant/encoder: {column: encoder_rad}}\n')
    capsys.readouterr()
    for words in (['import', 'none.csv', 'new'],
                  ['import', 'none.csv', 'new', '--map', 'map.yaml'],
                  ['export', 'none.csv', 'new'], ['export', 'run', 'new', '--from', '99'],
                  ['plot', 'run', '--out', 'new.png', '--from', '99'],
                  ['report', 'run', '-o', 'new', '--from', '99'], ['diagnose', 'none.csv']):
        assert main(words) == 2, words
        out, err = capsys.readouterr()
        assert not out and len(err.splitlines()) == 1 and ' no ' in err
        assert not list(Path().glob('new*'))


@pytest.mark.parametrize(('seconds', 'said'), [
    (0.05, 'record a longer test'), (3.0, 'at rest, nothing moves')])
def test_a_recording_that_tells_nothing_is_not_diagnosed(
        seconds: float, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['run', '--duration', f'{seconds}', '--out', f'{tmp_path}/a']) == 0
    capsys.readouterr()
    assert main(['diagnose', f'{tmp_path}/a']) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith('antenna-drive diagnose: a: ') and said in line


@pytest.mark.parametrize(('arguments', 'words'), [
    (['export', 'none', 'a.csv'], 'none: no such file or folder'),
    (['export', 'run', 'run/a/b.csv'], 'cannot be written, No such file or directory'),
    (['export', 'run', 'a.csv', '--signals', 'motor_1/amps'], 'did you mean'),
    (['import', 'bad.csv', 'bag'], "bad.csv: line 3, column rate_command_rad_s: 'x' is no number"),
    (['import', 'bad.csv', 'bag', '--map', 'none.yaml'], 'none.yaml: No such file'),
    (['plot', 'run', '--out', 'a.gif'], 'has to end in one of .png, .pdf, .svg'),
    (['plot', 'run', '--from', '99'], 'no sample to draw'),
    (['plot', 'bad.csv'], 'bad.csv: line 3'),
    (['report', 'bad.txt'], 'bad.txt: no recording'),
])
def test_what_cannot_be_done_is_said_in_one_line_and_leaves_nothing(
        arguments: list[str], words: str, bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (bag.parent / 'bad.csv').write_text('time_s,rate_command_rad_s\n0,1\n1,x\n')
    (bag.parent / 'bad.txt').write_text('?')
    before = sorted(bag.parent.rglob('*'))
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert captured.err.startswith(f'antenna-drive {arguments[0]}: ')
    assert captured.err.count('\n') == 1
    assert captured.out == ''
    assert sorted(bag.parent.rglob('*')) == before


def test_a_bag_that_was_cut_off(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    storage = bag / 'run_0.mcap'
    storage.write_bytes(storage.read_bytes()[:-50])
    assert main(['export', 'run', 'a.csv']) == 2
    assert 'cut off or damaged' in capsys.readouterr().err
    assert main(['export', 'run', 'a.csv', '--partial']) == 0
    assert capsys.readouterr().err.startswith('warning: run: cut off or damaged')


def test_pictures(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['plot', 'run']) == 0
    assert (bag.parent / 'run.png').read_bytes().startswith(PNG)
    assert main(['plot', 'run', '--signals', 'plant/*', '--out', 'some.pdf']) == 0
    assert (bag.parent / 'some.pdf').read_bytes().startswith(PDF)
    assert capsys.readouterr().out.split() == ['run.png', 'some.pdf']


def test_the_curves_of_a_picture_are_the_samples(bag: Path) -> None:
    from antenna_drive.recording.picture import draw
    from matplotlib.figure import Figure
    drawn: list[Figure] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, 'savefig', lambda self, *_, **__: drawn.append(self))
        with (bag.parent / 'a.png').open('wb') as stream:
            draw(read_bag(bag), stream, 'png', patterns=['plant/encoder', 'motor_*/ammeter'])
    axes = drawn[0].axes
    assert [axis.get_title(loc='left') for axis in axes] == ['Ammeter', 'Axis angle']
    time, angle = axes[1].lines[0].get_data()
    assert np.asarray(time) == pytest.approx(np.arange(600) * 0.01)
    assert np.asarray(angle) == pytest.approx(np.rad2deg(np.sin(np.arange(600) * 0.01 + 5)))


def test_reports(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['report', 'run', '-o', 'run.html', '--to', '3']) == 0
    assert capsys.readouterr().out == 'run.html\n'
    assert (bag.parent / 'run.html').read_text().startswith('<!doctype html>')
    assert main(['report', 'run', '--json', '-']) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures['bias']['maximum_V'] == pytest.approx(1.0, abs=1e-4)
    assert figures['motors']['motor_1']['current_peak_A'] == pytest.approx(1.0, abs=1e-4)
    assert figures['axis_stick'] == 0.0


@pytest.mark.parametrize('command', ['export', 'import', 'plot', 'report'])
def test_help_teaches(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main([command, '--help'])
    assert end.value.code == 0
    assert f'antenna-drive {command} ' in capsys.readouterr().out
