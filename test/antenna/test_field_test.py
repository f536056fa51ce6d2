# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A recording made ready for a diagnosis: where its time begins, and what cannot serve."""

from __future__ import annotations

from dataclasses import replace

from antenna_drive.diagnosis.field_test import FieldTest, prepared
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import BUILT_IN, planned
from antenna_drive.parameters import load
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import TestSheet
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.logs.channel import nanoseconds

NAME = 'field'


def field(test: str = 'square') -> Recording:
    """Return 20 s of a test at 200 Hz."""
    return planned(BUILT_IN[test], 20.0, 200.0)


def ready(recording: Recording) -> tuple[FieldTest, list[str]]:
    """Return a recording made ready, and what was noted."""
    notes: list[str] = []
    test, = prepared({NAME: recording}, load(), notes.append)
    return test, notes


@pytest.mark.parametrize('test', ['square', 'multisine'])
@pytest.mark.parametrize('clock_s', [1_795_262_948.25, 1763.25, -40.5])
def test_a_clock_that_began_elsewhere_changes_nothing(test: str, clock_s: float) -> None:
    plain, _ = ready(field(test))
    other, notes = ready(field(test).shift_ns(nanoseconds(clock_s)))
    np.testing.assert_allclose(other.time, plain.time, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(other.measured, plain.measured)
    np.testing.assert_allclose(other.command(plain.time), plain.command(plain.time))
    assert f'{NAME}: begins at {clock_s:.3f} s, time is counted from there' in notes


def test_a_recorder_that_joined_late_keeps_the_time_of_the_waveform() -> None:
    joined, notes = ready(field().between(7.0))
    assert not any('begins at' in note for note in notes)
    assert joined.time[0] == pytest.approx(7.0)
    np.testing.assert_array_equal(joined.command(joined.time), ready(field())[0].command(
        joined.time))
    # as much of it is looked at as of any other
    assert joined.until(5.0).time[-1] == pytest.approx(12.0, abs=0.02)


def test_without_a_waveform_time_begins_with_the_recording() -> None:
    late = field().between(7.0)
    bare = Recording(late.channels, sheet=TestSheet())
    assert ready(bare)[0].time[0] == 0.0


def test_too_few_samples_are_refused_in_one_line() -> None:
    whole = field()
    reading = whole.between(end_s=0.03).channels['motor_1/ammeter']
    command = whole.channels['test_signal/rate_command']
    few = Recording({'test_signal/rate_command': command, 'motor_1/ammeter': reading})
    with pytest.raises(UserError, match='field: 6 samples to compare'):
        ready(few)


def test_labels_of_a_sheet_reach_the_experiment() -> None:
    recording = field()
    labelled = replace(recording, sheet=replace(recording.sheet, labels=(('load', 'A'),)))
    machine = AntennaMachine({'a': labelled, 'b': recording}, load(), threads=1)
    assert [dict(e.labels) for e in machine.experiments] == [{'load': 'A'}, {}]
