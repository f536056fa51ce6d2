# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the plotter is given shows the same curve as the samples."""

from __future__ import annotations

import base64
from typing import Any

from hypothesis import given, strategies as st
import numpy as np
from numpy.typing import NDArray
import pytest
from simgap.report.curves import COLOURS, kept, plotted


def unpacked(curve: dict[str, Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return times and values of a packed curve, as the plotter's script reads them."""
    def numbers(text: str, kind: str) -> NDArray[Any]:
        return np.frombuffer(base64.b64decode(text), kind)

    shares = numbers(curve['values'], '<f4').astype(float)
    since = (np.arange(curve['n']) * (curve['step'] or 0.0) if curve['times'] is None
             else numbers(curve['times'], '<f8'))
    return curve['start'] + since, curve['base'] + curve['scale'] * shares


@given(st.lists(st.tuples(st.integers(1, 10**10),
                          st.one_of(st.floats(-1e6, 1e6), st.just(float('nan')))),
                min_size=1, max_size=50))
def test_packed_samples_are_the_samples(samples: list[tuple[int, float]]) -> None:
    time = np.cumsum([step for step, _ in samples])
    values = np.array([value for _, value in samples])
    there = np.isfinite(values)
    panels = plotted([('', 'a', 'V', [('a/b', time, values)])])['panels']
    assert len(panels) == there.any()
    for curve in (curve for panel in panels for curve in panel['curves']):
        times, found = unpacked(curve)
        assert times == pytest.approx(time[there] / 1e9, abs=2e-9)
        spread = float(np.ptp(values[there]))
        assert found == pytest.approx(values[there], abs=1e-7 * spread + 1e-12)


def test_seconds_and_nanoseconds_are_the_same_time() -> None:
    stamps, values = np.arange(0, 10**9, 7 * 10**6), np.arange(143.0)
    panels = [('', 'a', 'V', [('a/b', time, values)]) for time in (stamps, stamps / 1e9)]
    first, second = plotted(panels)['panels']
    assert first == second
    assert first['curves'][0]['step'] == 0.007


def test_colours_are_given_by_name_or_in_turn() -> None:
    time = np.arange(2)
    curves = [(name, time, np.ones(2)) for name in 'abcdefgh']
    panel, = plotted([('', '', '', curves)], {'b': '#123456'})['panels']
    assert [curve['colour'] for curve in panel['curves']] == [
        COLOURS[0], '#123456', *COLOURS[2:], *COLOURS[:2]]


def test_thinning_keeps_peaks_and_ends() -> None:
    rng = np.random.default_rng(3)
    values = rng.standard_normal(100_003)
    values[[777, 88_888]] = 50.0, -50.0
    few, width = kept(values, 1000)
    assert len(few) <= 1010
    assert width == 201
    assert (values[few].max(), values[few].min()) == (50.0, -50.0)
    assert (few[0], few[-1]) == (0, 100_002)
    assert (np.diff(few) > 0).all()
    for low in range(0, 100_003 - 201, 201 * 50):  # each run's extremes are there
        run = values[low:low + 201]
        assert run.max() in values[few]
        assert run.min() in values[few]
    assert kept(values, 200_000)[0].tolist() == list(range(100_003))
