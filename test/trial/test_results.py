# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The results of a trial in one file: nothing is lost, nothing foreign gets in."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import json
from pathlib import Path
from typing import Any

from lab.cli import main, twin_trial
from lab.trials import batch
from lab.trials.results import FILE, TrialResults
import pytest
from simgap.errors import UserError


def prepared(folder: Path, seed: int = 5) -> dict[str, Any]:
    return batch.prepare(folder, 40, seed, 0.02, 200.0, 30.0, wild=True)


def test_what_many_threads_find_is_all_there_in_the_order_of_the_cases(tmp_path: Path) -> None:
    manifest = prepared(tmp_path)
    names = list(manifest['seals'])
    results = TrialResults(tmp_path, manifest)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda name: results.put(name, open=name < 'case_0020'), reversed(names)))
        list(pool.map(lambda name: results.put(name, told={'right': True}), names))
    again = TrialResults(tmp_path, manifest)
    assert list(again) == names
    assert again['case_0003'] == {'open': True, 'told': {'right': True}}
    lines = [json.loads(line) for line in (tmp_path / FILE).read_text().splitlines()]
    assert [line['case'] for line in lines] == names and {line['seed'] for line in lines} == {5}


def test_of_a_case_without_results_nothing_is_known(tmp_path: Path) -> None:
    results = TrialResults(tmp_path, prepared(tmp_path))
    assert results['case_0001'] == {} and list(results) == []


@pytest.mark.parametrize('line, said', [
    ('{"case": "case_0001", "seed": 6, "open": true}', 'case_0001 of seed 6 is no case'),
    ('{"case": "case_0041", "seed": 5}', 'case_0041 of seed 5 is no case'),
    ('{"seed": 5}', 'no result of a trial'), ('["case_0001"]', 'no result of a trial'),
    ('rubbish', 'no result of a trial')])
def test_what_is_no_result_of_the_trial_is_refused(line: str, said: str, tmp_path: Path) -> None:
    manifest = prepared(tmp_path)
    TrialResults(tmp_path, manifest).put('case_0002', open=False)
    kept = (tmp_path / FILE).read_text()
    (tmp_path / FILE).write_text(kept + line + '\n')
    with pytest.raises(UserError, match=f'{FILE}: line 2: .*{said}'):
        TrialResults(tmp_path, manifest)
    assert (tmp_path / FILE).read_text() == kept + line + '\n'


def test_a_trial_of_the_twin_goes_on_in_another_folder(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    asked = []

    def outcome(truth: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
        asked.append(truth['case'])
        if len(asked) == 3:
            raise UserError('the disk is full')
        return {'waveform': 'square', 'judged': 1800, 'unjudged': 3, 'tuning': 'none',
                'alarms': [{'time_s': 9.0, 'gaps': ['current_1']}] if len(asked) == 1 else []}

    monkeypatch.setattr(twin_trial, 'outcome', outcome)
    words = ['twin-trial', '--kind', 'healthy', '--cases', '4', '--seed', '8', '--jobs', '1',
             '--quiet', '--out']
    assert main([*words, str(tmp_path / 'one')]) == 2
    (tmp_path / 'two').mkdir()
    (tmp_path / 'one' / FILE).rename(tmp_path / 'two' / FILE)
    capsys.readouterr()
    assert main([*words, str(tmp_path / 'two')]) == 0
    assert len(asked) == 5 and set(asked) == {f'case_000{k}' for k in (1, 2, 3, 4)}
    said = capsys.readouterr().out
    assert '1 alarms in 2.00 h' in said and said.count('1800 s judged') == 4


@pytest.mark.parametrize(('words', 'said'), [
    (['--kind', 'verdict'], '--kind verdict reads whole recordings'),
    (['--kind', 'onset', '--jobs', '1000'], 'the number of cores'),
])
def test_what_cannot_be_played_on_topics_is_refused_before_anything_is_sealed(
        words: list[str], said: str, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / 'out'
    assert main(['twin-trial', '--cases', '2', '--seed', '8', '--topics', '--out', str(out),
                 *words]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()
