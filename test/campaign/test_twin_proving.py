# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How a trial looks at tests that grow, and what it says of the answers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.recording import Recording
from lab.campaign import twin_proving as proving
from lab.cli.twin_trial import of_verdicts
import numpy as np
import pytest
from simgap.logs.channel import make_channel

TEST = Recording({RATE_COMMAND: make_channel(
    RATE_COMMAND, 'rad/s', np.arange(0, 31) * 1_000_000_000, np.zeros(31))})
GAP = ('motor_1.coulomb_friction',)


def answer(first: tuple[str, ...], probability: float) -> dict[str, Any]:
    return {'verdict': 'no_gap' if first == ('none',) else 'explained',
            'which': [{'effects': list(first), 'probability': probability, 'parameters': {}},
                      {'effects': ['unknown'], 'probability': 1.0 - probability,
                       'parameters': {}}], 'confusable': [], 'how_far': None, 'seconds': 1.0}


def test_tests_grow_until_the_rule_stops_and_are_looked_at_whole(
        monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[list[float]] = []

    def diagnosed(there: Mapping[str, Recording], drive: Drive) -> dict[str, Any]:
        given.append([float(item[RATE_COMMAND].time_ns[-1]) / 1e9 for item in there.values()])
        return answer(GAP, 0.95 if len(given) > 1 else 0.6)

    monkeypatch.setattr(proving, 'diagnosed', diagnosed)
    stopped, looks = proving.grown([TEST] * 3, [30.0] * 3, [15.0, 30.0, 45.0, 60.0, 75.0, 90.0])
    assert stopped == 45.0
    assert given == [[15.0], [30.0], [30.0, 15.0], [30.0, 30.0, 30.0]]
    assert [(look.seconds, look.tests) for look, _ in looks] == [
        (15.0, 1), (30.0, 1), (45.0, 2), (90.0, 3)]


def test_answers_are_scored_where_the_rule_stopped_and_after_all_tests() -> None:
    def case(kind: str, true: tuple[str, ...], stopped: float | None,
             *looks: tuple[float, tuple[str, ...]]) -> dict[str, Any]:
        effects = [{'id': name, 'size': 0.5, 'parameters': {'factor': 2.0}} for name in true]
        return {'kind': kind, 'effects': effects, 'stopped_s': stopped, 'looks': [
                    {'seconds': seconds, 'verdict': answer(first, 0.95)}
                    for seconds, first in looks]}

    lines = of_verdicts([
        case('single', GAP, 45.0, (30.0, GAP), (45.0, GAP), (90.0, GAP)),
        case('single', GAP, 60.0, (60.0, ('none',)), (90.0, GAP)),
        case('none', (), None, (90.0, ('none',)))])
    assert lines[0].endswith('stopped at 45 s: motor_1.coulomb_friction 0.95, right; '
                             'after 90 s: motor_1.coulomb_friction 0.95, right')
    # of three answers with 0.95 two are right, later all
    assert 'stopped: right 2 of 3; top1 0.500; no_gap_on_none 1.000; ece 0.283' in lines
    assert 'after 90 s: right 3 of 3; top1 1.000; no_gap_on_none 1.000; ece 0.050' in lines
    assert lines[-1] == 'same answer as after 90 s: 2 of 3; median 60 s of testing'
