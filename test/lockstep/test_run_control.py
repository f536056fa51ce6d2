# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What an operator asks of a run, between the thread that asks and the one that steps."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

from antenna_drive.lockstep.run_control import PAUSED, read_state, RunControl, RunState
import pytest

PATIENCE_S = 60.0


class Drive:
    """A lock-step thread that makes steps as fast as it may, and runs as often as it is told."""

    def __init__(self) -> None:
        self.control = RunControl(PATIENCE_S, nothing)
        self.step = self.runs = 0
        self._stop = Event()
        self._thread = Thread(target=self._turn)

    def _turn(self) -> None:
        self.control.begun()
        while not self._stop.is_set():
            if self.control.reset_wanted:
                self.step = 0
                self.runs += 1
                self.control.begun()
            elif self.control.holds(self.step):
                self.control.stands(self.step)
            else:
                self.step += 1

    def __enter__(self) -> Drive:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        self._thread.join()

    def until(self, true: Callable[[], bool]) -> None:
        while not true():
            assert self._thread.is_alive()


def nothing() -> None:
    pass


def test_a_paused_drive_makes_the_steps_that_are_asked_for_and_no_other() -> None:
    with Drive() as drive:
        control = drive.control
        assert 'not paused' in control.resume()
        assert 'call pause first' in control.step(1, PATIENCE_S)
        for count in (1, 7, 1000):
            assert control.pause() == ''
            at = drive.step
            assert control.step(count, PATIENCE_S) == ''
            assert drive.step == at + count
            assert control.step(count, PATIENCE_S) == ''
            assert drive.step == at + 2 * count
            assert control.resume() == ''
            drive.until(lambda at=at, count=count: (  # type: ignore[misc]
                drive.step > at + 3 * count))


def test_a_reset_leaves_a_paused_drive_at_step_0_and_lets_another_run() -> None:
    with Drive() as drive:
        control = drive.control
        assert control.reset() == ''
        assert drive.runs == 1
        drive.until(lambda: drive.step > 10)
        assert control.pause() == ''
        assert control.reset() == ''
        assert control.pause() == ''
        assert (drive.step, drive.runs) == (0, 2)
        assert control.step(3, PATIENCE_S) == ''
        assert drive.step == 3


def test_what_nobody_answers_is_said() -> None:
    control = RunControl(0.0, nothing)
    assert 'come to its next step' in control.pause()
    assert 'heard from all' in control.reset()


def test_a_pause_ends_steps_that_are_under_way() -> None:
    with Drive() as drive:
        control = drive.control
        assert control.pause() == ''
        assert control.step(10**9, 0.0) == ''
        assert control.pause() == ''
        at = drive.step
        assert at < 10**9
        assert control.step(1, PATIENCE_S) == ''
        assert drive.step == at + 1


def test_a_state_is_read_as_it_was_told_and_nothing_else_is() -> None:
    state = RunState(PAUSED, 1795262948317196, 812)
    assert read_state(state.text()) == state
    assert str(state) == 'paused at step 812 of run 1795262948317196'
    for text in ('', '[]', 'null', '{}', '{"state": "paused", "run": 1, "step": -1}',
                 '{"state": "asleep", "run": 1, "step": 1}', state.text() + ' ' * 200,
                 '{"state": "paused", "run": 1.5, "step": 1}', '[' * 150,
                 '{"state": ["paused"], "run": 1, "step": 1}',
                 '{"state": "paused", "run": 1, "step": 1, "more": 1}'):
        assert read_state(text) is None, text


@pytest.mark.parametrize('step', [0, 5])
def test_a_drive_that_does_not_step_says_once_that_it_stands(step: int) -> None:
    control = RunControl(0.0, nothing)
    control.begun()
    control.pause()
    assert control.holds(step)
    assert control.stands(step)
    assert not control.stands(step)
