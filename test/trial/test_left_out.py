# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The trial without true effects: which cases it takes, what it leaves out, and how it goes on."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
from typing import Any

from lab.cli import main
from lab.trials import batch, sealing
from lab.trials.left_out import run_trial
from lab.trials.scorecard import read_cases
from lab.trials.scored_cases import case_lines
import pytest
from simgap.errors import UserError


def verdict_of(**answers: float) -> dict[str, Any]:
    return {'verdict': 'explained', 'which': [
        {'effects': [name.replace('__', '.')], 'probability': p} for name, p in answers.items()]}


FRICTION, OFFSET = 'axis.coulomb_friction', 'motor_1.amplifier_offset'
NUMBERS = {FRICTION: {'factor': 2.0}, OFFSET: {'voltage': 1.0}}


def truth_of(name: str, kind: str, *effects: str) -> dict[str, Any]:
    return {'case': name, 'kind': kind, 'seed': [1, 2],
            'effects': [{'id': effect, 'size': 0.5, 'parameters': NUMBERS[effect]}
                        for effect in effects]}


@pytest.fixture
def trial(tmp_path: Path) -> Path:
    """Two single effects named first, one that was missed, a pair, a healthy one, one pending."""
    answers: dict[str, Any] = {
        'case_0001': ('single', [FRICTION], verdict_of(axis__coulomb_friction=0.95, unknown=0.05)),
        'case_0002': ('single', [OFFSET], verdict_of(unknown=0.9, none=0.1)),
        'case_0003': ('pair', [FRICTION, OFFSET], {'verdict': 'explained', 'which': [
            {'effects': [FRICTION, OFFSET], 'probability': 1.0}]}),
        'case_0004': ('none', [], {'verdict': 'no_gap', 'which': [
            {'effects': ['none'], 'probability': 1.0}]}),
        'case_0005': ('single', [OFFSET], verdict_of(
            motor_1__amplifier_offset=0.8, unknown=0.2)),
        'case_0006': ('single', [OFFSET], None)}
    sealing.seal(tmp_path, {'cases': 6, 'seed': 1}, [
        truth_of(name, kind, *effects) for name, (kind, effects, _) in answers.items()])
    for name, (_, _, verdict) in answers.items():
        (tmp_path / name).mkdir()
        if verdict is not None:
            (tmp_path / name / 'verdict.json').write_text(json.dumps(verdict))
    return tmp_path


class Diagnoses:
    """Stands for the diagnoses; the offset's fails, or something else is named."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.words: list[list[str]] = []
        self.fails = False
        monkeypatch.setattr(batch, 'run_command', self)

    def __call__(self, words: Sequence[str], limit_s: float = 0.0) -> str:
        self.words.append(list(words))
        left_out = words[words.index('--without') + 1]
        if left_out == OFFSET and self.fails:
            return 'exit code 1\n'
        Path(words[words.index('--json') + 1]).write_text(json.dumps(
            verdict_of(unknown=0.85, none=0.15) if left_out == FRICTION
            else verdict_of(motor_2__amplifier_offset=0.92, unknown=0.08)))
        return 'exit code 0\n'


def test_right_single_effects_are_left_out_in_their_cases(
        trial: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    diagnoses = Diagnoses(monkeypatch)
    found = run_trial(trial, 10, 1, 60.0, ['--config', 'my.yaml'])
    assert [(Path(words[1]).parent.name, words[words.index('--without') + 1])
            for words in diagnoses.words] == [('case_0001', FRICTION), ('case_0005', OFFSET)]
    assert all(words[-2:] == ['--config', 'my.yaml'] for words in diagnoses.words)
    assert [row['unknown_after'] - row['unknown_before'] for row in found['cases']] == [
        pytest.approx(0.8), pytest.approx(-0.12)]
    assert found['recognised'] == 0.5 and found['named_wrongly'] == 0.5
    assert found['median_rise'] == pytest.approx(0.34) and found['failures'] == 0
    # nothing is diagnosed twice
    assert run_trial(trial, 10, 1, 60.0) == found and len(diagnoses.words) == 2
    # the first answers stay as they were
    assert 'axis.coulomb_friction' in (trial / 'case_0001/verdict.json').read_text()


def test_first_answers_may_come_from_a_file(
        trial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Diagnoses(monkeypatch)
    published = tmp_path / 'published.jsonl'
    published.write_text(''.join(case_lines(read_cases(trial)[0])))
    for name in ('case_0001', 'case_0005'):
        (trial / name / 'verdict.json').unlink()
    found = run_trial(trial, 10, 1, 60.0, scored=published)
    assert [row['case'] for row in found['cases']] == ['case_0001', 'case_0005']
    assert found['cases'][0]['unknown_before'] == pytest.approx(0.05)
    published.write_text(published.read_text().replace('case_0001', 'case_0006'))
    with pytest.raises(UserError, match='case_0006: is no case of this trial'):
        run_trial(trial, 10, 1, 60.0, scored=published)


def test_a_diagnosis_that_fails_is_counted_and_made_again(
        trial: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    diagnoses = Diagnoses(monkeypatch)
    diagnoses.fails = True
    found = run_trial(trial, 10, 1, 60.0)
    assert found['failures'] == 1 and [row['effect'] for row in found['cases']] == [FRICTION]
    diagnoses.fails = False
    assert run_trial(trial, 10, 1, 60.0)['failures'] == 0


def test_the_command_says_what_rose(trial: Path, monkeypatch: pytest.MonkeyPatch,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    Diagnoses(monkeypatch)
    assert main(['trial-without', str(trial), '--cases', '1', '--jobs', '1', '--quiet']) == 0
    said = capsys.readouterr().out
    assert 'case_0001  axis.coulomb_friction' in said
    assert "'unknown' rises by 0.80 (median)" in said


def test_a_trial_without_right_answers_is_refused(
        trial: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Diagnoses(monkeypatch)
    for name in ('case_0001', 'case_0005'):
        (trial / name / 'verdict.json').unlink()
    with pytest.raises(UserError, match='no case with a single effect'):
        run_trial(trial, 10, 1, 60.0)
