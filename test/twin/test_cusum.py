# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Charts: their false alarms as stated, against simulation and Wald's identity."""

from antenna_drive.twin.cusum import Charts, limit_for, limit_of_rate, run_length
import numpy as np
from numpy.typing import NDArray
import pytest


def simulated_run_lengths(reference: float, limit: float, chains: int,
                          steps: int) -> NDArray[np.int64]:
    """Return when each of many independent one-sided charts alarms; `steps` if it never does."""
    random = np.random.default_rng(3)
    sums, first = np.zeros(chains), np.full(chains, steps)
    for k in range(steps):
        sums = np.maximum(0.0, sums + random.standard_normal(chains) - reference)
        alarm = (sums > limit) & (first == steps)
        first[alarm] = k + 1
        if np.all(first < steps):
            break
    return first


@pytest.mark.parametrize(('reference', 'limit'), [(0.5, 3.0), (1.0, 1.5), (0.25, 5.0)])
def test_mean_time_to_a_false_alarm_is_that_of_the_formula(reference: float,
                                                           limit: float) -> None:
    found = simulated_run_lengths(reference, limit, 4000, 4000)
    assert np.all(found < 4000)
    # 4000 chains tell the mean to 1.6 percent; Siegmund's formula is right to a few
    assert run_length(reference, limit) == pytest.approx(found.mean(), rel=0.08)


def test_limit_is_the_inverse_of_the_run_length() -> None:
    assert run_length(1.0, limit_for(1.0, 4.7e6)) == pytest.approx(4.7e6, rel=1e-9)


def test_all_charts_together_alarm_no_more_often_than_stated() -> None:
    random = np.random.default_rng(11)
    block_s, per_day, charts = 1.0, 20000.0, 12
    limit = limit_of_rate(1.0, per_day, 2 * charts, block_s)
    days, alarms = 0.25, 0
    chart = Charts(np.ones(charts, bool), np.ones(charts), limit, clip=6.0)
    for k in range(int(86400 * days)):
        chart.add(random.standard_normal(charts), k)
        if chart.alarmed.any():
            alarms += 1
            chart.restart()
    # 5000 are stated; independent charts nearly reach the bound
    assert 0.85 * per_day * days < alarms < 1.05 * per_day * days


def test_increments_that_have_a_lot_in_common_alarm_less_often() -> None:
    random = np.random.default_rng(12)
    limit, alarms = limit_of_rate(1.0, 20000.0, 24, 1.0), 0
    chart = Charts(np.ones(12, bool), np.ones(12), limit, clip=6.0)
    for k in range(10800):
        chart.add(np.full(12, random.standard_normal()), k)
        if chart.alarmed.any():
            alarms += 1
            chart.restart()
    assert alarms < 1000


def test_change_is_found_and_dated() -> None:
    random = np.random.default_rng(2)
    chart = Charts(np.array([True, False]), np.ones(2), limit_for(1.0, 1e6), clip=4.0)
    k = 0
    while not chart.alarmed.any():
        chart.add(random.standard_normal(2) - (3.0 if k >= 500 else 0.0), k)
        k += 1
    assert 500 < k < 512
    assert list(chart.alarmed) == [True, False], 'the second looks for an increase only'
    assert abs(chart.began(0) - 500) <= 2
    assert chart.size(0) == pytest.approx(-3.0, abs=1.0)


def test_one_block_alone_never_alarms_and_a_missing_one_changes_nothing() -> None:
    chart = Charts(np.ones(1, bool), np.ones(1), limit=6.0, clip=4.0)
    chart.add(np.array([1e9]), 0)
    chart.add(np.array([np.nan]), 1)
    assert not chart.alarmed[0]
    assert chart.size(0) == 1e9
    chart.add(np.array([0.0]), 2)
    assert not chart.alarmed[0]


def test_charts_come_down_again_when_the_change_is_over() -> None:
    chart = Charts(np.ones(1, bool), np.ones(1), limit=6.0, clip=4.0)
    for k in range(1000):
        chart.add(np.array([9.0]), k)
    blocks = 0
    while not chart.calm:
        chart.add(np.array([0.0]), 1000 + blocks)
        blocks += 1
    assert blocks < 12
