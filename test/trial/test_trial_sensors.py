# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors: noise, digits, clock and errors are what the test sheet and the machine say."""

from __future__ import annotations

import math

from lab.antenna.machine import apply_tolerances, draw_tolerances, reference_machine
from lab.antenna.real_antenna import TrueSignals
from lab.antenna.sensors import COLUMNS, record, sample_instants
from lab.antenna.sheet import SensorGrade
import numpy as np
from numpy.typing import NDArray
import pytest


def still_history(count: int, rate: float = 0.0) -> tuple[TrueSignals, NDArray[np.float64]]:
    """Return a history of constants."""
    times = np.arange(count) / 200.0
    flat = np.ones(count)
    return TrueSignals(
        time=times, command=0.0 * flat, current=np.stack([flat, -flat]),
        rate=rate * np.stack([flat, flat]), tach=rate * np.stack([flat, flat]),
        axis_angle=1e-3 * flat, axis_rate=0.0 * flat, encoder_angle=1e-3 * flat,
        bias=5.0 * flat, state=np.zeros((count, 1)), steps=0, rejected=0, switchings=0), times


def test_noise_and_digits_are_those_of_the_sheet() -> None:
    history, times = still_history(20000, rate=100.0)
    grade = SensorGrade(current_step_A=0.004, tach_step_rad_s=0.002)
    columns = record(history, reference_machine(), grade, times, np.random.default_rng(1))
    assert tuple(columns) == COLUMNS
    expected = {'current_1_A': math.hypot(0.01, 0.004 / math.sqrt(12.0)),
                'tach_rate_2_rad_s': math.hypot(0.0035, 0.15),
                'bias_voltage_V': math.hypot(0.01, 0.01 / math.sqrt(12.0))}
    for name, spread in expected.items():
        assert np.std(columns[name]) == pytest.approx(spread, rel=0.03)
    digits = columns['current_1_A'] / 0.004
    assert digits == pytest.approx(np.round(digits), abs=1e-6)
    assert abs(np.mean(columns['current_1_A']) - 1.0) < 0.0102
    line = 2.0 * math.pi / 2**21
    assert columns['encoder_rad'][0] / line == pytest.approx(
        round(columns['encoder_rad'][0] / line), abs=1e-6)
    assert columns['encoder_rad'][0] == pytest.approx(1e-3, abs=5e-6 + line)


def test_errors_of_the_recorder() -> None:
    history, times = still_history(4000)
    machine = reference_machine()
    machine.sensors['current_error_2'] = 0.2
    machine.sensors['current_offset_1'] = 0.3
    machine.sensors['bias_error'] = -0.1
    machine.sensors['encoder_offset'] = 4e-4
    columns = record(history, machine, SensorGrade(), times, np.random.default_rng(2))
    assert np.mean(columns['current_1_A']) == pytest.approx(1.3, abs=0.011)
    assert np.mean(columns['current_2_A']) == pytest.approx(-1.2, abs=0.011)
    assert np.mean(columns['bias_voltage_V']) == pytest.approx(4.5, abs=0.011)
    assert np.mean(columns['encoder_rad']) == pytest.approx(1.4e-3, abs=1e-5)


@pytest.mark.parametrize('rate', [50.0, 200.0, 500.0])
def test_clock_is_uneven_but_runs_forwards(rate: float) -> None:
    instants, stamps = sample_instants(rate, 30.0, np.random.default_rng(3))
    assert len(instants) == len(stamps) == int(30 * rate) + 1
    assert instants[0] == stamps[0] == 0.0
    assert np.all(np.diff(instants) > 0.0)
    assert np.all(np.diff(stamps) > 0.0)
    assert np.std(np.diff(instants)) == pytest.approx(0.03 * math.sqrt(2.0) / rate, rel=0.1)
    assert np.std(stamps - instants) == pytest.approx(5e-5, rel=0.1)


def test_tolerances_stay_within_and_leave_teeth_alone() -> None:
    exact, off = reference_machine('new', 'new', 0.8), reference_machine('new', 'new', 0.8)
    apply_tolerances(off, draw_tolerances(0.05, np.random.default_rng(4)))
    assert off.structure['gear_ratio'] == exact.structure['gear_ratio']
    for records, others in ((exact.motors, off.motors), (exact.structure, off.structure),
                            (exact.circuit, off.circuit)):
        for name in records.dtype.names or ():
            before, after = records[name], others[name]
            changed = before != after
            assert np.all(np.abs(after[changed] / before[changed] - 1.0) <= 0.05)
    ratio = off.motors['torque_constant'] / exact.motors['torque_constant']
    assert off.motors['back_emf'] / exact.motors['back_emf'] == pytest.approx(ratio)
    assert len(set(ratio)) == 2
