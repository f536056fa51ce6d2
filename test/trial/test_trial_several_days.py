# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The trial of machines on several days: what is drawn, recorded and scored."""

from __future__ import annotations

from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any

from lab.trials import days
import numpy as np
import pytest
from simgap.model import read_log


def test_days_differ_by_what_is_said_and_machines_by_their_tolerance() -> None:
    truths = days.draw(200, 3)
    assert truths[:20] == days.draw(20, 3) != days.draw(20, 4)[:20]
    assert {truth['machine'] for truth in truths} == {'joint', 'axis'}
    for name, share in days.BY_DAY.items():
        off = [day[name] - 1.0 for truth in truths for day in truth['days']]
        # the rms of a uniform factor between 0.5 and 1.25
        assert np.std(off) == pytest.approx(0.90 * share, rel=0.12)
    assert max(test['duration_s'] for truth in truths for test in truth['tests']) <= 10.0


def written(path: Path, differs: Mapping[str, Any], low: float) -> None:
    numbers = [{'number': 'coulomb', 'belongs_to': 'machine', 'ci95': [low, low + 1.0],
                'differs': differs},
               {'number': 'start[1]', 'belongs_to': 'test', 'ci95': [0.0, 0.0], 'differs': {}}]
    path.write_text(json.dumps({'which': [{'effects': ['none']}], 'labels': [],
                                'reproducibility': numbers}))


def test_the_shares_count_pairs_inventions_and_what_was_found(tmp_path: Path) -> None:
    cases = [tmp_path / name for name in 'ab']
    for case in cases:
        case.mkdir()
        for place, name in enumerate(days.ALONE):
            # the first and the last day of both do not overlap
            written(case / f'{name}.json', {}, 0.6 * place)
        written(case / f'{days.HEALTHY}.json', {'day': {}} if case.name == 'b' else {}, 0.0)
        written(case / f'{days.OTHER}.json', {'specimen': {}}, 0.0)
    overlap, none, invented, found = days.scored(cases).values()
    assert overlap[:1] + overlap[3:] == pytest.approx((4.0 / 6.0, 6))
    assert (none.value, invented.value, found.value) == (1.0, 0.5, 1.0)


def test_recordings_carry_their_labels_and_another_specimen_has_less_friction(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Verdict:
        def to_json(self) -> str:
            return '{}'

    monkeypatch.setattr(days, 'diagnose_logs', lambda model, logs, threads: Verdict())
    truth = next(item for item in days.draw(8, 3) if item['machine'] == 'axis')
    days._diagnosed(tmp_path, truth)
    logs = {name: read_log(tmp_path / truth['case'] / f'{name}.csv')
            for name in (*days.ALONE, 'other')}
    assert {name: dict(log.labels) for name, log in logs.items()} == {
        '1': {'day': '1', 'specimen': 'A'}, '2': {'day': '2', 'specimen': 'A'},
        '3': {'day': '3', 'specimen': 'A'}, 'other': {'day': '3', 'specimen': 'B'}}
    used = {name: float(np.mean(np.abs(logs[name]['current_A']))) for name in ('3', 'other')}
    assert used['other'] < 0.95 * used['3']
