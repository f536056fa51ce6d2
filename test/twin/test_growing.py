# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The verdict that grows: when it looks, at what, and when it stops."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import BrokenExecutor
import time
from typing import Any

from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import TestSheet
from antenna_drive.twin.growing import FIRST_S, GrowingVerdict, look_of
from antenna_drive.twin.intake import Intake
from antenna_drive.workers import worker_processes
from later import Later
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.logs.channel import make_channel
from worker_tasks import lengths_found


def test_of(seconds: float) -> Recording:
    return Recording({RATE_COMMAND: make_channel(
        RATE_COMMAND, 'rad/s', np.array([0, round(seconds * 1e9)]), np.zeros(2))})


test_of.__test__ = False  # type: ignore[attr-defined]


class Diagnoses:
    """Stands in for the diagnosis; remembers what it was given."""

    def __init__(self, *first: float) -> None:
        self.given: list[list[str]] = []
        self._first = iter(first)

    def __call__(self, recordings: Mapping[str, Recording], drive: Drive) -> dict[str, Any]:
        self.given.append(list(recordings))
        p = next(self._first)
        if p < 0.0:
            raise UserError('too short')
        return {'which': [{'effects': ['motor_1.gap'], 'probability': p},
                          {'effects': ['none'], 'probability': 0.01},
                          {'effects': ['unknown'], 'probability': 0.99 - p}],
                'confusable': [['motor_1.gap', 'motor_2.gap']],
                'planning': {'inflation': p}}


def grown(*first: float) -> tuple[GrowingVerdict, Later, Diagnoses]:
    later, diagnoses = Later(), Diagnoses(*first)
    return GrowingVerdict(later, load(), diagnose=diagnoses), later, diagnoses


def look(growing: GrowingVerdict, later: Later, seconds: float) -> None:
    assert growing.due(seconds)
    growing.begin(test_of(seconds))
    assert not growing.due(1e6), 'one look at a time'
    assert not growing.take()
    later.tasks.pop()()
    assert growing.take()


def test_looks_come_at_growing_distances_until_it_is_decided() -> None:
    growing, later, _ = grown(0.6, 0.94, 0.94, 0.94, 0.94)
    assert not growing.due(FIRST_S - 0.1)
    look(growing, later, 16.0)
    assert not growing.due(20.0)
    look(growing, later, 21.0)
    look(growing, later, 28.0)
    assert not growing.decided
    assert growing.message()['say'].startswith(
        'go on, and make another test: motor_1.gap, 94 % after 28 s')
    growing.complete(test_of(30.0))
    look(growing, later, 7.0)
    assert not growing.decided, 'seconds of a second test are no second test'
    look(growing, later, 19.0)
    assert growing.decided
    assert growing.message()['say'].startswith('decided, you can stop')
    assert [item['seconds'] for item in growing.message()['looks']] == [
        16.0, 21.0, 28.0, 37.0, 49.0]
    assert not growing.due(1e6)


def test_tests_before_are_looked_at_with_the_present_one() -> None:
    growing, later, diagnoses = grown(0.5, 0.5)
    look(growing, later, 30.0)
    growing.complete(test_of(30.0))
    assert not growing.due(8.0)
    look(growing, later, 10.0)
    assert diagnoses.given == [['test 1'], ['test 1', 'test 2']]
    assert growing.looks[-1].seconds == pytest.approx(40.0)


def test_look_that_fails_is_told_and_the_next_one_made() -> None:
    growing, later, _ = grown(-1.0, 0.5)
    look(growing, later, 16.0)
    assert growing.message()['fault'] == 'too short'
    assert not growing.due(16.0), 'the same would fail again'
    look(growing, later, 21.0)
    assert growing.message()['fault'] == ''
    assert growing.planning == {'inflation': 0.5}


def test_probabilities_of_a_look_are_those_of_the_diagnosis() -> None:
    result = Diagnoses(0.7)({}, load())
    found = look_of(result, [20.0, 5.0])
    assert (found.seconds, found.tests) == (25.0, 1)
    assert found.first == ('motor_1.gap',)
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    assert found.evidence == pytest.approx(99.0)


def test_a_look_in_another_process_gets_what_the_drive_has_sent() -> None:
    intake = Intake(60.0)
    for k in range(2001):
        intake.put(RATE_COMMAND, k * 10_000_000, 1e-3)
    with worker_processes(1) as executor:
        growing = GrowingVerdict(executor, load(), diagnose=lengths_found)
        assert growing.due(intake.span_s())
        growing.begin(intake.recording(TestSheet(circuit='new'), None))
        while not growing.take():
            time.sleep(0.01)
    assert growing.looks[-1].first == ('test 1, 2001 samples',)
    assert growing.planning == {'circuit': load().torque_share.circuit.saturation_high}


class Faulty:
    """Stands for a diagnosis with a fault of its own, or one that takes very long."""

    def __init__(self, long: bool) -> None:
        self._long = long

    def __call__(self, recordings: Mapping[str, Recording], drive: Drive) -> dict[str, Any]:
        if self._long:
            time.sleep(3600.0)
        raise ZeroDivisionError('of nothing')


@pytest.mark.parametrize('long', [False, True], ids=['a fault', 'killed'])
def test_a_fault_of_a_look_is_told_and_the_end_of_its_process_raised(long: bool) -> None:
    with worker_processes(1, finish=False) as executor:
        growing = GrowingVerdict(executor, load(), diagnose=Faulty(long))
        growing.begin(test_of(16.0))
        if not long:
            while not growing.take():
                time.sleep(0.01)
            assert growing.message()['fault'] == 'of nothing'
            return
        while not executor._processes:
            time.sleep(0.01)
        for process in list(executor._processes.values()):
            process.kill()
        with pytest.raises(BrokenExecutor):
            while not growing.take():
                time.sleep(0.01)
