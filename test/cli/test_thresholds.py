# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The table of thresholds, and verdicts that are decided anew from kept fits."""

from __future__ import annotations

import json
from pathlib import Path

from lab.cli import main
from lab.cli.thresholds import DECIDED, variants
import numpy as np
import pytest
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.search.evidence import Evidence
from simgap.settings import DEFAULT
from simgap.verdict.diagnosis import diagnose

TIME: FloatArray = np.arange(800, dtype=np.float64) * 0.01


class Ramp(Machine):
    """A reading that may drift."""

    def __init__(self, drift: float) -> None:
        noise = 0.1 * np.random.default_rng(4).normal(size=TIME.size)
        super().__init__(
            [Experiment('one', TIME, ('y',), ('m',), (drift * TIME + noise)[:, np.newaxis],
                        np.full((TIME.size, 1), 0.1))],
            [Parameter('zero', 'm', -1.0, 1.0, 1e-3, 0.1)],
            [Effect('dial.drift', 'dial', '', '', (Form('', (
                Parameter('dial.drift.rate', 'm/s', -1.0, 1.0, 1e-3),)),))])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the drifting reading."""
        return np.asarray(point.get('dial.drift.rate', 0.0) * TIME
                          + point.get('zero', 0.0))[:, np.newaxis]


def test_every_threshold_says_what_it_decides(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['thresholds', '--json', '-']) == 0
    table = json.loads(capsys.readouterr().out)
    assert len({row['name'] for row in table}) == len(table) > 80
    for row in table:
        assert row['unit'] and row['decides'] and row['set_by'], row['name']


def test_a_threshold_is_changed_by_its_name_alone() -> None:
    changed = DEFAULT.changed('verdict.temperature', 16.0)
    assert changed.verdict.temperature == 16.0 and changed.penalty == DEFAULT.penalty
    with pytest.raises(KeyError):
        DEFAULT.changed('verdict.heat', 1.0)
    names = [name for name, _ in variants(DECIDED)]
    assert 'verdict.temperature halved, 4' in names
    # a probability is never doubled beyond one
    assert 'verdict.most_unknown doubled, 1' in names


def test_kept_fits_give_the_same_verdict_and_another_with_other_thresholds() -> None:
    result = diagnose(Ramp(0.05)).as_data()
    assert result['verdict'] == 'explained'
    evidence = Evidence.of_data(json.loads(json.dumps(result['fits'])))
    again = evidence.decide(DEFAULT)
    assert again.word == result['verdict']
    assert again.answers[0].probability == pytest.approx(
        result['which'][0]['probability'], rel=1e-9)
    gained = result['fits'][0]['cost'] - result['fits'][1]['cost']
    dear = evidence.decide(DEFAULT.changed('penalty.effect', gained + 100.0))
    assert dear.word != 'explained'


def test_a_trial_without_kept_fits_is_told(tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['trial', '--cases', '1', '--seed', '1', '--out', str(tmp_path), '--quiet']) == 0
    assert main(['thresholds', str(tmp_path)]) == 2
    assert 'no case is diagnosed' in capsys.readouterr().err
    (tmp_path / 'case_0001' / 'verdict.json').write_text('{}')
    assert main(['thresholds', str(tmp_path)]) == 2
    assert 'fits: is missing' in capsys.readouterr().err
    # those of an earlier version know of no doubt: the verdict would be another one
    [none, *_] = (dict(fit) for fit in diagnose(Ramp(0.05)).fits)
    del none['doubts']
    (tmp_path / 'case_0001' / 'verdict.json').write_text(json.dumps({'fits': [none]}))
    assert main(['thresholds', str(tmp_path)]) == 2
    assert 'doubts: is missing; diagnose the trial anew' in capsys.readouterr().err
