# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The cases of joints and axes: their mix, their recordings and their seals."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from lab.cli import main
from lab.joints.cases import draw_truths, make_recording, moved
from lab.joints.machines import kind_of, MACHINES
from lab.joints.mechanism import Mechanism
from lab.joints.programme import draw_tests, reference
from lab.trials import batch, sealing
from lab.trials.scorecard import Case, read_cases, score
from lab.trials.sizes import stated_sizes
from lab.trials.verdict import parse_verdict
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.model import load_model, OwnMachine, read_logs

COUNT = 4


@pytest.fixture(scope='module')
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small trial with all recordings."""
    folder = tmp_path_factory.mktemp('others') / 'small'
    manifest = batch.prepare(folder, COUNT, 3, 0.0, 0.0, 0.0, machines=MACHINES)
    batch.make_cases(folder, manifest, jobs=1)
    return folder


def truth_of(folder: Path, case: str) -> dict[str, Any]:
    """Return the truth of a case."""
    truth: dict[str, Any] = json.loads((folder / 'truth' / f'{case}.json').read_text())
    return truth


def test_sixty_cases_hold_the_mix_of_both_machines() -> None:
    truths = draw_truths(60, 4, MACHINES)
    kinds = [(truth['machine'], truth['kind']) for truth in truths]
    assert {kind: sum(one == kind for _, one in kinds) for kind in (
        'single', 'pair', 'none', 'outside')} == {
            'single': 33, 'pair': 9, 'none': 9, 'outside': 9}
    assert sum(machine == 'joint' for machine, _ in kinds) == 32
    named = {(truth['machine'], truth['effects'][0]['id']) for truth in truths
             if truth['kind'] in ('single', 'outside')}
    # each effect and each outsider is there
    assert named == {(name, key) for name in MACHINES
                     for key in (*kind_of(name).catalogue, *kind_of(name).outside)}
    for truth in truths:
        for entry in truth['effects']:
            kind_of(truth['machine']).cause(entry['id'])
    assert truths == draw_truths(60, 4, MACHINES)
    assert truths != draw_truths(60, 5, MACHINES)


@pytest.mark.parametrize('machine', MACHINES)
def test_every_effect_changes_what_is_read_and_leaves_it_finite(machine: str) -> None:
    kind, random = kind_of(machine), np.random.default_rng(0)
    truth = draw_truths(1, 2, [machine])[0]
    for test in truth['tests']:
        test['duration_s'] = 8.0
    healthy = moved({**truth, 'effects': []}, 0, 0.0)[2]
    for key, cause in {**kind.catalogue, **kind.outside}.items():
        assert set(cause.sets) <= set(Mechanism._fields)
        for size in (0.0, 1.0):
            effects = [{'id': key, 'parameters': cause.draw(size, random)}]
            found = moved({**truth, 'effects': effects}, 0, 0.0)[2]
            change = max(float(np.sqrt(np.mean((found[name] - healthy[name]) ** 2)))
                         / kind.table['noise'][name] for name in found)
            assert np.isfinite(change) and change > 0.3, (key, size)


@pytest.mark.parametrize('machine', MACHINES)
@pytest.mark.slow
def test_references_stay_within_reach_and_begin_at_rest(machine: str) -> None:
    table = kind_of(machine).table
    for seed in range(40):
        for test in draw_tests(table, np.random.default_rng(seed)):
            times = np.arange(0.0, test['duration_s'], 1e-3)
            asked = reference(test, times)
            assert np.abs(asked).max() <= 1.2 * table['reach']
            assert np.ptp(asked[:300]) == 0.0 and np.ptp(asked) > 0.0
            if test['shape'] in ('sine', 'triangle'):
                assert np.abs(np.diff(asked)).max() <= 1.001e-3 * table['greatest_rate']
            assert reference(test, times) == pytest.approx(asked)


def test_noise_has_the_level_and_the_recorder_the_errors_of_the_truth() -> None:
    truth = draw_truths(3, 8, ['joint'])[0]
    flaws = {**truth['imperfections'], 'missing_share': 0.0, 'spike_share': 0.0}
    flaws['noise'] = {name: {'level': 2.0, 'coloured_share': 0.0, 'corner_hz': 5.0}
                      for name in ('position', 'current')}
    flaws['delay_samples'] = {'position': 0.0, 'current': 0.0}
    flaws |= {'gain': {'current': 0.01}, 'zero': {'current': -0.02}}
    truth = {**truth, 'imperfections': flaws}
    loud = make_recording(truth, 0)
    quiet = make_recording({**truth, 'imperfections': {**flaws, 'noise': {
        name: {**values, 'level': 0.0} for name, values in flaws['noise'].items()}}}, 0)
    for column, sigma in (('motor_rad', 1e-3), ('current_A', 0.02)):
        assert np.std(loud[column] - quiet[column]) == pytest.approx(2.0 * sigma, rel=0.1)
    ideal = make_recording({**truth, 'imperfections': {
        **flaws, 'noise': {name: {**values, 'level': 0.0}
                           for name, values in flaws['noise'].items()},
        'gain': {}, 'zero': {}}}, 0)
    assert quiet['current_A'] == pytest.approx(1.01 * ideal['current_A'] - 0.02, abs=1e-12)
    assert np.array_equal(quiet['motor_rad'], ideal['motor_rad'])


def test_the_truth_is_sealed_as_a_whole_and_makes_the_same_case_again(
        made: Path, tmp_path: Path) -> None:
    manifest = sealing.read_manifest(made)
    assert manifest['settings'] == {'cases': COUNT, 'seed': 3, 'machines': list(MACHINES)}
    truth = truth_of(made, 'case_0002')
    text = json.dumps(truth, sort_keys=True, separators=(',', ':'))
    assert hashlib.sha256(text.encode()).hexdigest() == manifest['seals']['case_0002']
    batch.make_case(tmp_path, truth)
    for path in made.glob('case_0002/*'):
        assert (tmp_path / path.relative_to(made)).read_bytes() == path.read_bytes()
    # of the fourth recording and the sheets of the antenna's trial there are none
    assert sorted(path.name for path in made.glob('case_0002/*')) == [
        'rec_a.csv', 'rec_b.csv', 'rec_c.csv']
    with pytest.raises(UserError, match='holds a trial with machines'):
        batch.prepare(made, COUNT, 3, 0.02, 0.0, 0.0, machines=['axis'])


def test_each_case_is_diagnosed_with_the_model_of_its_machine(
        made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    commands: list[list[str]] = []

    def recorded(words: list[str], limit: float) -> str:
        commands.append(list(words))
        return 'not run'

    monkeypatch.setattr(batch, 'run_command', recorded)
    manifest = sealing.read_manifest(made)
    assert batch.diagnose_cases(made, manifest, 1, ['--jobs', '1']) == COUNT
    for words in commands:
        machine = truth_of(made, Path(words[1]).parent.name)['machine']
        assert words[words.index('--model') + 1] == kind_of(machine).model
        assert [Path(word).name for word in words[1:4]] == ['rec_a.csv', 'rec_b.csv', 'rec_c.csv']
        assert not any('truth' in word for word in words)
    for failure in made.glob('case_*/failure.txt'):
        failure.unlink()


@pytest.mark.parametrize('machine', MACHINES)
def test_the_model_knows_every_effect_and_reads_what_is_recorded(machine: str,
                                                                 made: Path) -> None:
    kind, model = kind_of(machine), load_model(kind_of(machine).model)
    assert [item.name for item in model.effects] == list(kind.catalogue)
    for key, cause in kind.catalogue.items():
        if cause.stated:
            item = next(item for item in model.effects if item.name == key)
            number = item.forms[0].numbers[cause.stated['parameter']]
            assert number.unit == cause.stated['unit']
    case = next(case for case in sealing.read_manifest(made)['seals']
                if truth_of(made, case)['machine'] == machine)
    found = OwnMachine(model, read_logs([made / case / f'rec_{one}.csv' for one in 'abc']))
    assert all(np.isfinite(found.predict({}, k)).all() for k in range(3))


def test_sizes_and_machines_are_scored(made: Path) -> None:
    for case in ('case_0001', 'case_0002', 'case_0003', 'case_0004'):
        truth = truth_of(made, case)
        key = truth['effects'][0]['id'] if truth['effects'] else 'none'
        (made / case / 'verdict.json').write_text(json.dumps({
            'verdict': 'explained', 'which': [{'effects': [key], 'probability': 1.0}]}))
    cases, pending = read_cases(made)
    figures = score(cases, len(pending))
    assert pending == [] and figures['top1'] == 1.0
    assert {name: row['cases'] for name, row in figures['by_machine'].items()} == {
        name: sum(case.machine == name for case in cases)
        for name in {case.machine for case in cases}}
    assert main(['score', str(made)]) == 0
    for path in made.glob('case_*/verdict.json'):
        path.unlink()
    truth = {'kind': 'single', 'machine': 'joint', 'effects': [
        {'id': 'motor.torque_constant', 'size': 0.5, 'parameters': {'factor': 0.8}}]}
    verdict = parse_verdict({'verdict': 'explained', 'which': [{
        'effects': ['motor.torque_constant'], 'probability': 1.0, 'parameters': {
            'motor.torque_constant.constant_change': {
                'value': -0.21, 'ci95': [-0.25, -0.19], 'unit': '1'}}}]})
    size, = stated_sizes(truth, verdict)
    assert size.true == pytest.approx(-0.2) and size.covered
    assert Case(truth, verdict).right


@pytest.mark.parametrize('words', [
    ['--wild'], ['--tolerance', '0.01'], ['--sample-rate', '100'], ['--machine', 'antenna']])
def test_options_of_the_antenna_are_refused(words: list[str], tmp_path: Path,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['trial', '--machine', 'joint', '--cases', '1', '--seed', '1', '--out',
                 str(tmp_path / 'trial'), *words]) != 0
    assert 'does not go with --machine joint' in capsys.readouterr().err
    assert not (tmp_path / 'trial').exists()
