# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Live changes on their way to the lock-step thread: in force once answered so, or never."""

from __future__ import annotations

from threading import Thread
from typing import Any

from antenna_drive.emulator.unit import FloatArray, Unit
import numpy as np
import pytest
from simgap.inputs.schema import Entry, Value

pytest.importorskip('rclpy', reason='rclpy is not installed')

from antenna_drive.lockstep import ros_parameters  # noqa: E402, I100
from antenna_drive.lockstep.ros_parameters import Tuning  # noqa: E402

GAIN = Entry('1', 0.0, 1.0, 'a gain', live=True)


class Tunable(Unit):
    """A unit with one setting, which remembers every value that was put in force."""

    def __init__(self) -> None:
        super().__init__('plant')
        self.in_force: list[Value] = []

    def start(self, step_s: float) -> FloatArray:
        return np.zeros((0, 2))

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        return np.zeros((0, 2))

    def settings(self) -> dict[str, tuple[Entry, Value]]:
        return {'gain': (GAIN, 0.5)}

    def tune(self, changes: Any) -> None:
        self.check(changes)
        self.in_force.append(changes['gain'])


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a change wait for the lock-step thread no longer than a test may."""
    monkeypatch.setattr(ros_parameters, 'PATIENCE_S', 0.01, raising=False)
    monkeypatch.setattr(ros_parameters, '_PATIENCE_S', 0.01, raising=False)


def test_what_was_refused_is_never_put_in_force() -> None:
    unit = Tunable()
    tuning = Tuning(unit)
    assert 'next step' in tuning.request({'gain': 0.9})
    assert not tuning.pending
    assert tuning.apply() == {}
    assert unit.in_force == []


def test_what_waits_behind_a_refused_change_is_put_in_force() -> None:
    unit = Tunable()
    tuning = Tuning(unit)
    assert tuning.request({'gain': 0.2}, wait=False) == ''
    assert tuning.request({'gain': 0.9})
    assert tuning.request({'gain': 0.3}, wait=False) == ''
    assert tuning.apply() == {'gain': 0.3}
    assert unit.in_force == [0.2, 0.3]


@pytest.mark.parametrize('answers', [True, False])
def test_the_answer_says_what_the_unit_uses_however_late_the_step_is(answers: bool) -> None:
    # patience ends at any moment of the other thread's work: before, while or after it applies
    unit = Tunable()
    tuning = Tuning(unit)
    said: dict[float, str] = {}

    def ask() -> None:
        for number in range(1, 200):
            said[number / 200] = tuning.request({'gain': number / 200})

    asking = Thread(target=ask)
    asking.start()
    while asking.is_alive():
        if answers:
            tuning.apply()
        else:
            asking.join(0.004)
            tuning.apply()
    tuning.apply()
    assert unit.in_force == [value for value, refusal in said.items() if not refusal]
    assert len(said) == 199
