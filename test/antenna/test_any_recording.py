# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a crew records is made ready or refused in one line."""

from __future__ import annotations

from antenna_drive.diagnosis.field_test import prepared
from antenna_drive.parameters import load
from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.recording import Recording
from field_runs import FAST_TRIANGLE, field_run, SLOW_SQUARE
from hypothesis import example, given, settings, strategies as st
import numpy as np
from simgap.errors import UserError

DRIVE = load('new_circuit')
RUNS = (field_run(DRIVE, 60.0, start_after=3.0, **FAST_TRIANGLE),
        field_run(DRIVE, 60.0, start_after=20.0, **SLOW_SQUARE),
        field_run(DRIVE, 60.0))


@settings(max_examples=40)
@given(run=st.sampled_from(RUNS), kept=st.sets(st.sampled_from(sorted(SIGNALS)), min_size=1),
       begin=st.floats(0.0, 59.0), length=st.floats(0.02, 60.0), every=st.integers(1, 40),
       missing=st.floats(0.0, 0.9), clock_s=st.sampled_from([0.0, -7.0, 1.8e9]),
       spikes=st.integers(0, 50), seed=st.integers(0, 2**32 - 1))
@example(RUNS[0], set(SIGNALS), 0.0, 60.0, 1, 0.0, 0.0, 0, 0)
@example(RUNS[2], {'motor_2/ammeter'}, 0.0, 60.0, 1, 0.0, 0.0, 0, 0)
@example(RUNS[0], {'motor_1/ammeter'}, 3.0, 2.0, 1, 0.0, 0.0, 0, 0)
@example(RUNS[1], set(SIGNALS), 0.0, 21.0, 40, 0.5, 0.0, 3, 0)
def test_it_is_ready_or_refused(run: Recording, kept: set[str], begin: float, length: float,
                                every: int, missing: float, clock_s: float, spikes: int,
                                seed: int) -> None:
    random = np.random.default_rng(seed)
    time = run[RATE_COMMAND].time_s
    there = np.flatnonzero((time >= begin) & (time < begin + length)
                           & (random.uniform(size=time.size) >= missing))[::every]
    if there.size < 2:
        return
    signals = {RATE_COMMAND: run[RATE_COMMAND].values[there]}
    for name in kept:
        signals[name] = run[name].values[there]
        signals[name][random.integers(0, there.size, spikes)] += 1.0
    recording = Recording.from_arrays(time[there] + clock_s, signals)
    notes: list[str] = []
    try:
        tests = prepared({'rec': recording}, DRIVE, notes.append)
    except UserError as error:
        assert '\n' not in str(error)
        assert str(error).startswith('rec: ')
        return
    assert 1 <= len(tests) <= 2
    for test in tests:
        assert test.time.size >= 2
        assert np.all(np.diff(test.time) > 0.0)
        assert test.time[0] >= 0.0
        assert test.measured.shape == test.slope.shape == (test.time.size, len(SIGNALS))
        assert np.isfinite(test.simulated(5e-3)).all()
    assert all('\n' not in note for note in notes)
