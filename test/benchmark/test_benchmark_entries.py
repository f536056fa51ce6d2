# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Commands on cases: what they get, what is kept of them, and what it scores."""

from __future__ import annotations

import json
import math
from pathlib import Path
import shutil
import sys
from typing import Any

from lab.benchmark.cases import draw_truths, PRACTICE
from lab.benchmark.entries import answered, enter, table
from lab.benchmark.methods.ours import WIND
from lab.cli import main
from lab.joints.machines import BENCHMARK, kind_of
from lab.trials import batch, sealing
from lab.trials.held_back import closed_fraction, noise_power
from lab.trials.scorecard import Case, score
from lab.trials.scored_cases import read_scored
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.model import load_model

COUNT = 12
# Writes the verdict of its case from a file beside it, and notes that it was there.
METHOD = """\
import pathlib, shutil, sys
here, case = pathlib.Path(__file__).parent, pathlib.Path(sys.argv[-1])
with open(here / 'seen.txt', 'a') as stream:
    stream.write(case.name + ' ' + ' '.join(sorted(item.name for item in case.parent.rglob('*'))))
    stream.write(chr(10))
answer = here / 'answers' / (case.name + '.json')
if not answer.exists():
    sys.exit('no answer to ' + case.name)
shutil.copy(answer, case / 'verdict.json')
"""


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    """Return a sealed set whose cases hold a file instead of recordings."""
    folder = tmp_path / 'cases'
    manifest = batch.prepare(folder, COUNT, 5, 0.0, 0.0, 0.0, machines=['mujoco_joint'])
    for name in manifest['seals']:
        (folder / name).mkdir()
        (folder / name / 'rec_a.csv').write_text('time_s\n')
        shutil.copy(folder / 'truth' / f'{name}.json', folder / name / 'truth.json')
    (tmp_path / 'answers').mkdir()
    (tmp_path / 'method.py').write_text(METHOD)
    return folder


def truth_of(folder: Path, name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / 'truth' / f'{name}.json').read_text())
    return found


def answer(folder: Path, name: str, effects: list[str] | None = None, sure: float = 0.95) -> None:
    """Let the method say these effects of a case; None for the truth."""
    truth = truth_of(folder, name)
    if effects is None:
        effects = ['unknown'] if truth['kind'] == 'outside' else [
            entry['id'] for entry in truth['effects']] or ['none']
    word = {'none': 'no_gap', 'unknown': 'unknown_effect'}.get(effects[0], 'explained')
    (folder.parent / 'answers' / f'{name}.json').write_text(json.dumps({
        'verdict': word, 'which': [{'effects': effects, 'probability': sure},
                                   {'effects': ['other.effect'], 'probability': 1.0 - sure}]}))


def run(folder: Path, out: str, limit: float = 60.0) -> int:
    command = [sys.executable, str(folder.parent / 'method.py')]
    return enter(folder, command, folder.parent / out, limit, 2, lambda done, total: None)


def test_a_method_that_knows_all_has_every_point(cases: Path) -> None:
    for name in sealing.read_manifest(cases)['seals']:
        answer(cases, name)
    assert run(cases, 'all.jsonl') == 0
    found = table({'all': answered(cases, cases.parent / 'all.jsonl')})['methods']['all']
    assert found['cases'] == COUNT and found['failures'] == 0
    for figure in ('top1', 'pairs_both', 'no_gap_on_none', 'auroc_unknown'):
        assert found[figure] == 1.0
    assert found['overconfident_outside'] == 0.0 and found['auroc_ci95'] == (1.0, 1.0)
    assert 0.0 < found['seconds_median'] < 60.0
    # the results hold no truth
    assert 'parameters"' not in (cases.parent / 'all.jsonl').read_text().replace(
        '"parameters": {}', '')


def test_a_method_gets_a_case_and_nothing_else(cases: Path) -> None:
    run(cases, 'none.jsonl')
    seen = (cases.parent / 'seen.txt').read_text().splitlines()
    assert sorted(line.split()[0] for line in seen) == list(sealing.read_manifest(cases)['seals'])
    for line in seen:
        assert line.split()[1:] == [line.split()[0], 'rec_a.csv', 'said.txt']


def test_what_failed_is_tried_again_and_what_is_there_is_kept(cases: Path) -> None:
    names = list(sealing.read_manifest(cases)['seals'])
    for name in names[:5]:
        answer(cases, name)
    assert run(cases, 'part.jsonl') == COUNT - 5
    first = [json.loads(line) for line in (cases.parent / 'part.jsonl').read_text().splitlines()]
    assert 'no answer to case_0006' in first[5]['failure'] and first[0]['failure'] == ''
    found = table({'part': answered(cases, cases.parent / 'part.jsonl')})['methods']['part']
    assert found['failures'] == COUNT - 5
    for name in names[5:]:
        answer(cases, name)
    (cases.parent / 'seen.txt').unlink()
    assert run(cases, 'part.jsonl') == 0
    seen = (cases.parent / 'seen.txt').read_text().splitlines()
    assert sorted(line.split()[0] for line in seen) == names[5:]


def test_a_method_that_does_not_end_fails(cases: Path) -> None:
    (cases.parent / 'method.py').write_text('while True: pass')
    assert run(cases, 'late.jsonl', limit=0.3) == COUNT


def test_what_is_said_of_an_outsider_and_of_two_methods(cases: Path) -> None:
    names = list(sealing.read_manifest(cases)['seals'])
    kinds = {name: truth_of(cases, name)['kind'] for name in names}
    for name in names:
        answer(cases, name)
    run(cases, 'right.jsonl')
    for name in names:
        if kinds[name] in ('outside', 'none'):
            answer(cases, name, ['load.inertia'])
    run(cases, 'sure.jsonl')
    found = table({name: answered(cases, cases.parent / f'{name}.jsonl')
                   for name in ('right', 'sure')})
    sure, wrong = found['methods']['sure'], sum(
        kind in ('outside', 'none') for kind in kinds.values())
    assert sure['overconfident_outside'] == 1.0 and sure['no_gap_on_none'] == 0.0
    assert sure['top1'] == 1.0 and sure['auroc_unknown'] == 0.5
    pair, = found['pairs']
    assert (pair['both'], pair['first'], pair['second']) == (COUNT - wrong, wrong, 0)
    assert pair['p'] == pytest.approx(2.0 * 0.5 ** wrong)


def test_what_a_prediction_closes(tmp_path: Path) -> None:
    truth = draw_truths(1, 1, ['mujoco_joint'])[0]
    random, time = np.random.default_rng(0), np.arange(2000) / truth['sample_rate_hz']
    level = truth['imperfections']['noise']['position']['level'] * 1e-3
    power = noise_power('motor_rad', truth, time)
    assert power >= level ** 2

    def write(name: str, gap: float, noise: float) -> Path:
        rows = np.column_stack([time, gap * np.sin(time) + noise * random.normal(size=2000),
                                np.zeros(2000)])
        path = tmp_path / name
        np.savetxt(path, rows, '%.9g', ',', header='time_s,motor_rad,current_A', comments='')
        return path

    recording = write('rec_d.csv', 0.0, math.sqrt(power))
    before, half = write('before.csv', 0.1, 0.0), write('half.csv', 0.05, 0.0)
    assert closed_fraction(recording, before, half, truth) == pytest.approx(0.75, abs=0.01)
    assert closed_fraction(recording, before, before, truth) == pytest.approx(0.0, abs=0.01)


def test_practice_and_sealed_sets_share_no_case() -> None:
    # the seed of practice is one that no sealed set may have
    with pytest.raises(SystemExit):
        main(['benchmark', '--make', '2', '--out', 'nowhere', '--seed', str(PRACTICE), '--bad'])
    assert main(['benchmark', '--make', '2', '--out', 'nowhere', '--seed', str(PRACTICE)]) == 2
    assert not Path('nowhere').exists()


def test_truths_hold_what_days_bring_and_a_fourth_test() -> None:
    truths = draw_truths(20, 1, ['mujoco_joint', 'mujoco_axis'])
    assert truths == draw_truths(20, 1, ['mujoco_joint', 'mujoco_axis'])
    for truth in truths:
        flaws = kind_of(truth['machine']).table['nuisances']
        assert len(truth['tests']) == 4 == len(truth['nuisances']['coulomb'])
        assert all(abs(share - 1.0) <= flaws['viscous'] for share in truth['nuisances']['viscous'])
        assert 0.0 <= truth['nuisances']['wind'] <= flaws['wind']


@pytest.mark.parametrize(('words', 'told'), [
    (['--make', '3', '--out', 'x'], '--seed: is missing'),
    (['--entry', 'true', '--cases', 'nothing', '--out', 'x.jsonl'], 'nothing/manifest.json'),
    (['--score', 'nothing'], '--score: no results'),
    (['--score', 'nothing', 'none.jsonl'], 'none.jsonl: no such file')])
def test_a_mistake_is_told_in_a_line(words: list[str], told: str,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['benchmark', *words, '--quiet']) == 2
    error = capsys.readouterr().err
    assert told in error and error.count('\n') == 1


def test_a_command_that_is_not_there_is_told(cases: Path) -> None:
    with pytest.raises(UserError, match='no_such_command'):
        enter(cases, ['no_such_command'], cases.parent / 'x.jsonl', 9.0, 1, lambda a, b: None)


def test_the_table_is_printed_and_a_changed_truth_is_refused(
        cases: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in sealing.read_manifest(cases)['seals']:
        answer(cases, name)
    command = f'{sys.executable} {cases.parent / "method.py"}'
    out = str(cases.parent / 'mine.jsonl')
    assert main(['benchmark', '--entry', command, '--cases', str(cases), '--out', out,
                 '--quiet']) == 0
    assert main(['benchmark', '--score', str(cases), out]) == 0
    printed = capsys.readouterr().out
    assert 'top-1 single' in printed and '1.00 [' in printed and 'mine' in printed
    truth = cases / 'truth' / 'case_0001.json'
    truth.write_text(truth.read_text().replace('"salt": "', '"salt": "0'))
    assert main(['benchmark', '--score', str(cases), out]) == 2
    assert Case(truth_of(cases, 'case_0002'), None).machine == 'mujoco_joint'


@pytest.mark.parametrize(('name', 'singles', 'pairs'), [
    ('joint_1_ours', 11, 1), ('joint_1_least_squares', 11, 3), ('joint_1_residuals', 3, 0),
    ('axis_1_ours', 6, 2), ('axis_1_least_squares', 4, 2)])
def test_the_notebook_quotes_its_published_cases(name: str, singles: int, pairs: int) -> None:
    notebook = Path(batch.__file__).parents[1] / 'notebook'
    figures = score(read_scored(notebook / f'benchmark_{name}.jsonl'))
    text = (notebook / 'benchmark.md').read_text()
    of_singles, of_pairs = (figures['by_kind'][kind]['cases'] for kind in ('single', 'pair'))
    assert figures['top1'] * of_singles == pytest.approx(singles)
    assert figures['pairs_both'] * of_pairs == pytest.approx(pairs)
    for figure in ('top1', 'pairs_both', 'no_gap_on_none', 'overconfident_outside'):
        low, high = figures['ci95'][figure]
        assert f'{figures[figure]:.2f} ({low:.2f} to {high:.2f})' in text
    assert f'{figures["auroc_unknown"]:.2f} (' in text


@pytest.mark.parametrize('machine', BENCHMARK)
def test_our_entry_states_the_wind_where_the_task_says_that_it_acts(machine: str) -> None:
    """On the last body, and nowhere else."""
    places = load_model(kind_of(machine).model).push
    assert [name for name in places if name in WIND] == list(places)[-1:]
