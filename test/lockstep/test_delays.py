# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Percentiles of counted delays, against those of numpy."""

from __future__ import annotations

from antenna_drive.lockstep.delays import count, Delays, PERCENTILES
import numpy as np
import pytest

# A bin is a sixteenth of an octave wide.
BIN = 2.0 ** (1.0 / 16.0)


@pytest.mark.parametrize('seed', range(3))
def test_percentiles_are_those_of_all_delays_to_the_width_of_a_bin(seed: int) -> None:
    values = np.random.default_rng(seed).lognormal(np.log(1e-4), 2.0, 5000)
    delays = Delays()
    for value in values:
        delays.note(value)
    found = delays.percentiles()
    # numpy's, without interpolation: the least delay that so many do not exceed
    wanted = np.percentile(values, PERCENTILES, method='inverted_cdf')
    assert np.all(np.array(found) >= wanted * (1.0 - 1e-12))
    assert np.all(np.array(found) <= wanted * BIN * (1.0 + 1e-12))


def test_a_compiled_loop_counts_as_python_does() -> None:
    in_python, compiled = Delays(), Delays()
    for value in (-1.0, 0.0, 1e-7, 1e-6, 3e-4, 0.1, 1e9):
        in_python.note(value)
        count(compiled.counts, value)
    assert in_python.counts.tolist() == compiled.counts.tolist()
    assert in_python.counts.sum() == 7


def test_nothing_counted_has_no_percentiles() -> None:
    delays = Delays()
    delays.note(1.0)
    delays.clear()
    assert delays.percentiles() == []
    assert str(delays) == ''
