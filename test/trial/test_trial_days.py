# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What every day and every logger bring to a wild case of family c."""

from __future__ import annotations

from dataclasses import replace
import math

from lab.antenna import cases, days
from lab.antenna.effects import CATALOGUE
from lab.antenna.real_antenna import TrueSignals
import numpy as np
import pytest

TRUTH = cases.draw_truths(3, 5, 0.02, wild=True, family='c')[0]


def test_the_days_are_drawn_beside_what_family_a_draws() -> None:
    plain = cases.draw_truths(3, 5, 0.02, wild=True)[0]
    assert TRUTH['effects'] == plain['effects']
    assert TRUTH['sheets'] == plain['sheets']
    assert 'days' not in plain
    assert len(TRUTH['days']['friction']) == len(TRUTH['days']['wind']) == len(TRUTH['sheets'])


def test_friction_differs_between_recordings_by_at_most_its_share() -> None:
    bare = {**TRUTH, 'effects': []}
    still = {**bare, 'days': {**bare['days'], 'faults': {}}}
    for recording, (axis, *motors) in enumerate(bare['days']['friction']):
        machine = cases.build_machine(still, recording)
        same = cases.build_machine({k: v for k, v in bare.items() if k != 'days'}, recording)
        assert machine.structure['coulomb'][0] == pytest.approx(
            same.structure['coulomb'][0] * (1.0 + axis))
        assert machine.motors['coulomb'] == pytest.approx(
            same.motors['coulomb'] * (1.0 + np.array(motors)))
        assert max(map(abs, (axis, *motors))) <= days.FRICTION


def test_the_wind_is_one_or_two_percent_of_the_friction() -> None:
    machine = cases.build_machine({**TRUTH, 'effects': []}, 0)
    axis = TRUTH['days']['friction'][0][0]
    # a sum of sines has the variance of half its squared amplitudes
    rms = math.sqrt(0.5 * float(np.sum(machine.structure['gust'][0] ** 2)))
    level = float(machine.structure['coulomb'][0]) / (1.0 + axis)
    assert days.WIND[0] <= rms / level <= days.WIND[1]


def test_a_little_fault_is_smaller_than_the_least_that_a_trial_draws() -> None:
    for key, values in TRUTH['days']['faults'].items():
        size = CATALOGUE[key].quantities[0]
        assert abs(values[size.name]) <= days.LITTLE * size.low
    assert {key.split('.')[1] for key in TRUTH['days']['faults']} == set(days.FAULTS)


def test_a_filter_of_the_logger_is_a_first_order_low_pass() -> None:
    rate, corner, count = 400.0, 40.0, 200
    step = np.r_[np.zeros(50), np.ones(count - 50)]
    signals = TrueSignals(
        np.arange(count) / rate, np.zeros(count), np.zeros((2, count)), np.zeros((2, count)),
        np.stack([step.copy(), step.copy()]), np.zeros(count), np.zeros(count), np.zeros(count),
        np.zeros(count), np.zeros((count, 1)), 0, 0, 0)
    found = days.filtered(replace(signals), {'filter_hz': {'tach_2': corner}}, rate)
    # one sample after the step, then the exponential of the corner's time constant
    late = np.arange(1, count - 49) / rate
    assert found.tach[1][50:] == pytest.approx(1.0 - np.exp(-2.0 * math.pi * corner * late))
    assert (found.tach[0] == step).all()
