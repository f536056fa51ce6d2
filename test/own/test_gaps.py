# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Rows that a recorder lost."""

from __future__ import annotations

import math

import numpy as np
import pytest
from simgap.model import Log, without_gaps

TIME = np.asarray(0.01 * np.arange(400), float)


def lost(log: Log, rows: slice) -> Log:
    """Return a log without some rows."""
    there = np.ones(log.time.size, dtype=bool)
    there[rows] = False
    return Log(log.name, log.time[there], {name: values[there]
                                           for name, values in log.columns.items()})


def test_rows_come_back_with_the_command_and_without_readings() -> None:
    jitter = np.random.default_rng(1).uniform(-2e-4, 2e-4, TIME.size)
    whole = Log('a', TIME + jitter, {'command': np.sin(TIME), 'angle': np.cos(TIME)})
    found = without_gaps(lost(whole, slice(100, 120)), ['command'], settles_s=0.5)
    assert found.time == pytest.approx(whole.time, abs=5e-4)
    assert found['command'] == pytest.approx(whole['command'], abs=1e-3)
    # a smooth command is known in the gap: only the lost readings lack
    assert np.flatnonzero(np.isnan(found.columns['angle'])).tolist() == list(range(100, 120))


def test_a_command_that_jumps_in_a_gap_blinds_until_the_machine_has_settled() -> None:
    whole = Log('a', TIME, {'command': np.where(TIME < 1.055, 0.0, 1.0), 'angle': TIME})
    found = without_gaps(lost(whole, slice(104, 108)), ['command'], settles_s=0.5)
    blind = TIME[np.isnan(found.columns['angle'])]
    assert blind.min() == pytest.approx(1.04) and blind.max() == pytest.approx(1.58, abs=0.011)
    assert np.isfinite(found.columns['command']).all()


def test_a_clock_that_is_off_loses_no_row() -> None:
    # a ten-thousandth of 40 s is two samples
    time = np.asarray(1.0001 * 2e-3 * np.arange(20000), float)
    whole = Log('a', time, {'command': np.sin(time), 'angle': np.sin(math.pi * time)})
    assert without_gaps(whole, ['command']) is whole
    found = without_gaps(lost(whole, slice(15000, 15003)), ['command'])
    assert found.time == pytest.approx(time, abs=1e-9)
