# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of a fleet: what a machine is, what is kept, what is done again."""

from __future__ import annotations

from collections.abc import Callable
import fcntl
import json
from pathlib import Path
import shutil
import sys
import tempfile
from typing import Any

from antenna_drive.cli import main
from antenna_drive.fleet import machines_of, share
import pytest
from simgap.errors import UserError

# A stand-in for the diagnosis: it notes what it was given, and answers from the recording's name.
STAND_IN = """
import json, pathlib, sys
words = sys.argv[3:]
options = [k for k, word in enumerate(words) if word.startswith('--')]
recordings = [pathlib.Path(word) for word in words[1:options[0]]]
given = {{word: words[words.index(word) + 1] for word in words if word.startswith('--')}}
with open({told!r}, 'a') as stream:
    stream.write(json.dumps({{
        'recordings': [path.name for path in recordings],
        'sheets': [path.with_suffix('.yaml').exists() for path in recordings],
        'configs': [pathlib.Path(words[k + 1]).read_text() for k in options
                    if words[k] == '--config' and words[k + 1].startswith('/')],
        'words': [word for word in words if not word.startswith('/')]}}) + '\\n')
content = recordings[0].read_text()
if 'broken' in content:
    sys.exit('antenna-drive diagnose: line 3: no number')
if 'greedy' in content:
    held = bytearray(3 * 2**30)
effects = ['tach_1.gain'] if 'gain' in content else []
pathlib.Path(given['--report']).write_text('<p>' + recordings[0].stem)
if '--corrected' in given:
    pathlib.Path(given['--corrected']).write_text('{{}}')
pathlib.Path(given['--json']).write_text(json.dumps({{
    'verdict': 'explained' if effects else 'no_gap',
    'sentence': 'It is said.' if effects else '',
    'which': [{{'effects': effects, 'probability': 0.75}}],
    'how_far': {{'explained_fraction': {{'value': 0.5, 'ci95': [0.4, 0.6]}} if effects else
                                       {{'value': None, 'reason': 'no gap'}}}},
    'confusable': [], 'notes': ['<b>'], 'seconds': 1.0}}))
"""
Told = Callable[[], list[dict[str, Any]]]


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Told:
    """Put a small program in the place of the diagnosis; return what it was told each time."""
    notes = tmp_path / 'told.txt'
    program = tmp_path / 'stand_in.py'
    program.write_text(STAND_IN.format(told=str(notes)))
    launcher = tmp_path / 'launcher'
    launcher.write_text(f'#!/bin/sh\nexec {sys.executable} {program} "$@"\n')
    launcher.chmod(0o755)
    monkeypatch.setattr(sys, 'executable', str(launcher))
    return lambda: ([json.loads(line) for line in notes.read_text().splitlines()]
                    if notes.exists() else [])


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    """Return a folder with four machines."""
    folder = tmp_path / 'fleet'
    for name, content in (('north/rec_a', 'gain'), ('north/rec_b', ''), ('south/rec_a', 'broken'),
                          ('west_a', ''), ('west_b', ''), ('east', 'gain')):
        path = folder / f'{name}.csv'
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    (folder / 'north' / 'rec_a.yaml').write_text('sheet')
    (folder / 'north' / 'config.yaml').write_text('of the north')
    (folder / 'empty').mkdir()
    return folder


def test_what_a_machine_is(fleet: Path) -> None:
    bag = fleet / 'north' / 'rec_c'
    bag.mkdir()
    (bag / 'rec_c_0.mcap').write_bytes(b'')
    (fleet / 'north' / 'rec_d').mkdir()
    (fleet / 'north' / 'rec_d' / 'rec_d_0.db3').write_bytes(b'')
    found = {machine.name: [path.name for path in machine.recordings]
             for machine in machines_of(fleet)}
    assert found == {'east': ['east.csv'], 'north': ['rec_a.csv', 'rec_b.csv', 'rec_c', 'rec_d'],
                     'south': ['rec_a.csv'], 'west': ['west_a.csv', 'west_b.csv']}
    (fleet / 'north_a.csv').write_text('')
    with pytest.raises(UserError, match='north: a subfolder and a group'):
        machines_of(fleet)
    with pytest.raises(UserError, match='holds no recordings'):
        machines_of(fleet / 'empty')
    with pytest.raises(UserError, match='no such folder'):
        machines_of(fleet / 'nowhere')


def test_one_row_a_machine(fleet: Path, told: Told, tmp_path: Path,
                           capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / 'all.yaml'
    config.write_text('of all')
    assert main(['diagnose-many', str(fleet), '--jobs', '2', '--config', str(config),
                 '--config', 'new_circuit', '--json', '-']) == 1
    answer = capsys.readouterr()
    found = json.loads(answer.out)
    assert found == json.loads((fleet / 'diagnosis' / 'fleet.json').read_text())
    assert [row['machine'] for row in found['rows']] == ['east', 'north', 'south', 'west']
    assert (found['machines'], found['failed']) == (4, 1)
    assert found['verdicts'] == {'explained': 2, 'no_gap': 1}
    assert found['effects'] == {'tach_1.gain': 2}
    failed = found['rows'][2]
    assert failed['failure'] == 'line 3: no number'
    assert 'exit code 1' in (
        fleet / 'diagnosis' / 'machines' / 'south' / 'failure.txt').read_text()
    # the table has the same rows, and what is said of each machine
    assert [line.split()[:2] for line in answer.err.splitlines()[1:7]] == [
        ['east', 'explained'], ['It', 'is'], ['north', 'explained'], ['It', 'is'],
        ['south', 'failed'], ['west', 'no_gap']]
    assert [row['sentence'] for row in found['rows']] == ['It is said.', 'It is said.', '', '']
    # each diagnosis got the recordings of its machine, their sheets and configurations
    given = {tuple(item['recordings']): item for item in told()}
    assert set(given) == {('east.csv',), ('rec_a.csv', 'rec_b.csv'), ('rec_a.csv',),
                          ('west_a.csv', 'west_b.csv')}
    north = given['rec_a.csv', 'rec_b.csv']
    assert north['sheets'] == [True, False]
    assert north['configs'] == ['of all', 'of the north']
    assert north['words'].index('new_circuit') > 0
    assert given['east.csv',]['configs'] == ['of all']


@pytest.mark.parametrize(('explained', 'said'), [
    (None, ''), (0.5, '50 %'), (0.0, '0 %'), (-8453.94, 'nothing')])
def test_share_as_people_read_it(explained: float | None, said: str) -> None:
    assert share({'explained': explained}) == said


def test_page_links_what_there_is(fleet: Path, told: Told) -> None:
    (fleet / 'a <b>').mkdir()
    (fleet / 'a <b>' / 'rec.csv').write_text('')
    assert main(['diagnose-many', str(fleet), '--jobs', '2']) == 1
    page = (fleet / 'diagnosis' / 'fleet.html').read_text()
    assert 'href="machines/a%20%3Cb%3E/verdict.html"' in page
    assert 'a <b>' not in page
    assert 'machines/south' not in page
    assert (fleet / 'diagnosis' / 'machines' / 'a <b>' / 'verdict.html').read_text() == '<p>rec'


def test_nothing_is_diagnosed_twice_and_what_changed_is(fleet: Path, told: Told) -> None:
    words = ['diagnose-many', str(fleet), '--jobs', '1']
    assert main(words) == 1
    assert len(told()) == 4
    before = (fleet / 'diagnosis' / 'fleet.json').read_text()
    # once more, with other cores: only the failed one
    assert main([*words[:-1], '2']) == 1
    assert [item['recordings'] for item in told()[4:]] == [['rec_a.csv']]
    assert (fleet / 'diagnosis' / 'fleet.json').read_text() == before
    (fleet / 'south' / 'rec_a.csv').write_text('gain')
    (fleet / 'west_a.csv').write_text('gain')
    assert main(words) == 0
    assert [item['recordings'] for item in told()[5:]] == [
        ['rec_a.csv'], ['west_a.csv', 'west_b.csv']]
    assert not (fleet / 'diagnosis' / 'machines' / 'south' / 'failure.txt').exists()
    # a verdict that was cut off is none; other options are another diagnosis
    verdict = fleet / 'diagnosis' / 'machines' / 'east' / 'verdict.json'
    verdict.write_text(verdict.read_text()[:-9])
    assert main(words) == 0
    assert [item['recordings'] for item in told()[7:]] == [['east.csv']]
    assert main([*words, '--diagnose-options', '--without tach_1.gain', '--corrected']) == 0
    assert len(told()) == 12
    assert 'tach_1.gain' in told()[-1]['words']
    assert (verdict.parent / 'corrected.yaml').exists()


def test_a_machine_that_breaks_loses_its_old_verdict(fleet: Path, told: Told) -> None:
    main(['diagnose-many', str(fleet)])
    (fleet / 'east.csv').write_text('broken')
    main(['diagnose-many', str(fleet)])
    assert sorted(path.name for path in (fleet / 'diagnosis' / 'machines' / 'east').iterdir()
                  ) == ['failure.txt']


@pytest.mark.skipif(not sys.platform.startswith('linux'), reason='no limit of another process')
@pytest.mark.slow
def test_memory_is_bounded(tmp_path: Path, told: Told,
                           capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'fleet').mkdir()
    (tmp_path / 'fleet' / 'one.csv').write_text('greedy')
    words = ['diagnose-many', str(tmp_path / 'fleet'), '--memory-limit']
    assert main([*words, '1000']) == 1
    assert 'MemoryError' in capsys.readouterr().out
    assert main([*words, '8000']) == 0


def test_what_a_killed_diagnosis_left_is_removed(
        fleet: Path, told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder in which another one works is not."""
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'tmp'))
    left, used = (tmp_path / 'tmp' / f'antenna_drive-fleet-{name}' for name in ('left', 'used'))
    for folder in (left, used):
        folder.mkdir(parents=True)
        (folder / '.lock').write_text('')
    with (used / '.lock').open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        main(['diagnose-many', str(fleet), '--jobs', '2'])
    assert list((tmp_path / 'tmp').iterdir()) == [used]


def test_results_are_not_recordings(fleet: Path, told: Told) -> None:
    shutil.rmtree(fleet / 'south')
    out = fleet / 'found'
    (out / 'machines').mkdir(parents=True)
    (out / 'old.csv').write_text('')
    assert main(['diagnose-many', str(fleet), '--out', str(out)]) == 0
    assert [machine['recordings'] for machine in json.loads(
        (out / 'fleet.json').read_text())['rows']] == [
            ['east.csv'], ['rec_a.csv', 'rec_b.csv'], ['west_a.csv', 'west_b.csv']]
