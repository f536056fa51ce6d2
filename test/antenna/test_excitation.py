# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The waveform of a test sheet, beside that of the program that shares no code with the model."""

from __future__ import annotations

from typing import Any

from antenna_drive.diagnosis.excitation import SheetCommand
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.recording.sheet import parse_sheet
from hypothesis import given, strategies as st
from lab.antenna.sheet import CaseSheet
from lab.antenna.waveform import command, corners
import numpy as np
import pytest

END = 20.0


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda value: round(value, 3))


def periodic(kind: str) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries({
        'type': st.just(kind), 'amplitude_deg_s': number(0.01, 1.0),
        'period_s': number(0.5, 9.0), 'phase': number(-1.0, 1.0)})


def multisine(sines: list[tuple[float, float, float]], start: float) -> dict[str, Any]:
    frequencies, weights, phases = (list(part) for part in zip(*sines))
    return {'type': 'multisine', 'amplitude_deg_s': 0.3, 'frequencies_hz': frequencies,
            'weights': weights, 'phases': phases, 'start_s': start}


WAVEFORMS = st.one_of(
    periodic('square'), periodic('triangle'),
    st.builds(multisine, st.lists(st.tuples(number(0.0, 9.0), number(-1.0, 1.0),
                                            number(-4.0, 4.0)), min_size=1, max_size=32),
              number(0.0, 3.0)),
    st.fixed_dictionaries({
        'type': st.just('chirp'), 'amplitude_deg_s': number(0.01, 1.0), 'f0_hz': number(0.0, 1.0),
        'f1_hz': number(1.0, 9.0), 'duration_s': number(1.0, 25.0), 'start_s': number(0.0, 3.0)}))


@given(WAVEFORMS)
def test_both_programs_play_a_sheet_alike(waveform: dict[str, Any]) -> None:
    parsed = parse_sheet({'waveform': waveform}).waveform
    assert parsed is not None
    ours = SheetCommand(parsed)
    theirs = CaseSheet('new', 'new', {'type': 'circuit'}, waveform).record()[0]
    knots = corners(theirs, END)
    assert ours.knots(END) == pytest.approx(knots, abs=1e-9)
    # within each stretch between two knots, up to a millionth of it from its ends, and no nearer
    # than what is one moment to a program: a billionth of a period
    edges = np.r_[0.0, knots, END]
    margin = np.maximum(1e-6 * np.diff(edges), 1e-7)
    room = np.diff(edges) - 2.0 * margin
    within = room > 0.0
    times = np.ravel((edges[:-1] + margin)[within, np.newaxis]
                     + room[within, np.newaxis] * np.array([0.0, 0.3, 0.5, 1.0]))
    expected = [command(theirs, t, t) for t in times]
    # a chirp's phase is the sum of numbers up to a thousand
    assert ours(times) == pytest.approx(expected, abs=1e-11)
    assert not ours(np.array([-1e-3, -5.0])).any()


def test_a_jump_counts_at_its_own_time() -> None:
    """A step ends on the jump, though in floating point it may end a little before it."""
    waveform = parse_sheet({'waveform': {
        'type': 'square', 'amplitude_deg_s': 180.0 / np.pi, 'period_s': 0.6}}).waveform
    assert waveform is not None
    jumps = np.array([0.3 * k for k in range(100)])     # 0.3, 0.6, 0.8999999999999999 ...
    assert SheetCommand(waveform)(jumps) == pytest.approx(np.tile([1.0, -1.0], 50))


@pytest.mark.parametrize('seed', range(5))
def test_a_corner_between_samples_is_where_its_lines_meet(seed: int) -> None:
    """Slews at 78 Hz, with stamps that err as a recorder's do."""
    random = np.random.default_rng(seed)
    time = np.sort(np.arange(0.0, 40.0, 1.0 / 78.0) + random.uniform(-3e-4, 3e-4, 3120))
    knots = np.cumsum(random.uniform(0.5, 3.0, 24))
    rates = random.uniform(-5e-3, 5e-3, 24)
    found = RecordedCommand.of(time, np.interp(time, knots, rates))
    fine = np.arange(1.0, 39.0, 1e-3)
    exact = np.interp(fine, knots, rates)
    plain = np.abs(np.interp(fine, time, np.interp(time, knots, rates)) - exact).max()
    assert np.abs(found(fine) - exact).max() < 0.15 * plain
    assert found(time) == pytest.approx(np.interp(time, knots, rates), abs=1e-12)


def test_a_curve_has_no_corners() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    curve = np.sin(2.0 * np.pi * 0.7 * time)
    assert RecordedCommand.of(time, curve).time.size == time.size
