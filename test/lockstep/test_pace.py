# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The timetable on a clock that the test holds."""

from __future__ import annotations

from antenna_drive.lockstep.pace import Pace
import pytest


def begun(pace: Pace, now: float) -> Pace:
    """Make step 1 of a run at `now`."""
    pace.begin()
    pace.note(1, 1e-3, now)
    return pace


def test_steps_are_due_at_the_pace_asked_for_without_drift() -> None:
    pace = begun(Pace(2.0), 100.0)
    assert pace.remaining(1_000_001, 1e-3, 100.0) == pytest.approx(500.0, abs=1e-9)
    assert pace.remaining(1_000_001, 1e-3, 600.0) == pytest.approx(0.0, abs=1e-9)


def test_as_fast_as_possible_is_always_due() -> None:
    pace = begun(Pace(0.0), 5.0)
    assert pace.remaining(10, 1e-3, 5.0) == 0.0
    pace.note(10, 1e-3, 1e9)
    assert pace.late_steps == 0


def test_late_steps_are_counted_and_the_timetable_stays() -> None:
    pace = begun(Pace(1.0), 0.0)
    pace.note(2, 1e-3, 0.001)
    pace.note(3, 1e-3, 0.0029)
    assert pace.late_steps == 0
    pace.note(4, 1e-3, 0.0041)
    assert pace.late_steps == 1
    assert pace.worst_s == pytest.approx(1.1e-3)
    pace.note(5, 1e-3, 0.0051)
    assert pace.worst_s == pytest.approx(1.1e-3), 'the latest stays'
    assert pace.summary().endswith('2 late by up to 1.1 ms')
    assert pace.remaining(5, 1e-3, 0.0) == pytest.approx(0.004)
    pace.begin()
    assert pace.late_steps == 0
    assert pace.summary() == ''


def test_the_time_until_all_are_there_is_no_lateness() -> None:
    pace = begun(Pace(1.0), 0.0)
    pace.begin()
    # the first step waits for nobody but the others, who come after nine seconds
    assert pace.remaining(1, 1e-3, 0.5) == 0.0
    pace.note(1, 1e-3, 9.0)
    pace.note(2, 1e-3, 9.0015)
    assert pace.late_steps == 0
    assert pace.remaining(11, 1e-3, 9.0) == pytest.approx(0.01)


def test_a_new_pace_goes_on_from_where_the_run_is() -> None:
    pace = begun(Pace(1.0), 0.0)
    pace.change(4.0, now=10.0, step=5000)
    assert pace.remaining(5004, 1e-3, 10.0) == pytest.approx(0.001)


def test_a_pace_set_before_the_first_step_begins_nothing() -> None:
    pace = Pace(1.0)
    pace.change(2.0, now=3.0, step=0)
    assert pace.remaining(1, 1e-3, 3.0) == 0.0
    pace.note(1, 1e-3, 7.0)
    assert pace.late_steps == 0
    assert pace.remaining(3, 1e-3, 7.0) == pytest.approx(0.001)


def test_a_lead_lets_steps_come_early_and_makes_none_late() -> None:
    pace = begun(Pace(1.0, lead_s=0.02), 0.0)
    assert pace.remaining(16, 1e-3, 0.0) == pytest.approx(-0.005)
    assert pace.remaining(26, 1e-3, 0.0) == pytest.approx(0.005)
    # whoever has made step 21 at once and then stands still for 15 ms is late with nothing
    pace.note(22, 1e-3, 0.015)
    assert pace.late_steps == 0
    # lateness is told from when a step is due, as without a lead
    pace.note(23, 1e-3, 0.0241)
    assert pace.late_steps == 1


def test_a_lead_is_wall_time_at_any_pace() -> None:
    pace = begun(Pace(4.0, lead_s=0.02), 0.0)
    assert pace.remaining(81, 1e-3, 0.0) == pytest.approx(0.0, abs=1e-12)


def test_a_drive_that_was_paused_goes_on_without_a_burst() -> None:
    pace = begun(Pace(1.0), 0.0)
    pace.note(2, 1e-3, 0.001)
    pace.change(pace.factor, 100.0, 2)
    assert pace.remaining(3, 1e-3, 100.0) == pytest.approx(1e-3)
    assert pace.remaining(1002, 1e-3, 100.0) == pytest.approx(1.0)
    pace.note(3, 1e-3, 100.001)
    assert pace.late_steps == 0
