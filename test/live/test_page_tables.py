# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the page shows of parameters, experiments and test signals, against what the drive has."""

from __future__ import annotations

import math
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import simulate
from antenna_drive.emulator.units import build, overridden
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.live.experiment_buttons import levels, listed, plan, preview, start_of
from antenna_drive.live.parameter_table import entry_of, reach
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
import numpy as np
import pytest
from simgap.inputs.schema import ParameterError


def described(unit: str) -> list[tuple[Any, object]]:
    """Return descriptors of a unit's parameters, as its node gives them, with their values."""
    pytest.importorskip('rclpy', reason='rclpy is not installed: there are no descriptors')
    from antenna_drive.lockstep.ros_parameters import describe
    found: list[tuple[Any, object]] = []
    for name, (entry, value) in build(unit, load()).settings().items():
        item = describe(entry)
        item.name = name
        found.append((item, value))
    return found


@pytest.mark.parametrize('unit', UNITS)
def test_every_parameter_has_the_unit_and_range_of_its_entry(unit: str) -> None:
    settings = build(unit, load()).settings()
    for description, value in described(unit):
        entry, _ = settings[description.name]
        shown = entry_of(description, list(value) if isinstance(value, tuple) else value)
        assert shown['live'] == entry.live
        if entry.choices is not None:
            assert shown['choices'] == list(entry.choices)
            continue
        unit_of = {'1': '', 'SI': 'N m' if 'torque.' in description.name else 'rad/s'}.get(
            entry.unit, entry.unit)
        degrees = {'rad': 'deg', 'rad/s': 'deg/s'}
        assert shown['unit'] == degrees.get(unit_of, unit_of), description
        assert shown['factor'] == (180.0 / math.pi if unit_of in degrees else 1.0)
        if shown['kind'] == 'number':
            assert (shown['low'], shown['high']) == (entry.low, entry.high)
            assert entry.low <= shown['from'] <= value <= shown['to'] <= entry.high  # type: ignore


def test_a_slider_goes_over_the_range_or_a_useful_part_of_it() -> None:
    assert reach(0.0, 1.0, '1', 0.8) == (0.0, 1.0)
    assert reach(-50.0, 0.0, 'V', -11.0) == (-50.0, 0.0)
    assert reach(0.0, 1e4, '1/s', 66.7) == (0.0, 150.0)
    assert reach(0.0, 1e4, '1/s', 400.0) == (0.0, 800.0)
    assert reach(None, None, 'N m', 0.0) == (-1e6, 1e6)


@pytest.mark.parametrize('name', experiments())
def test_a_drive_is_started_as_the_experiment_says(name: str) -> None:
    experiment = experiments()[name]
    drive = load(experiment.circuit)
    for unit, values in start_of(experiment, ()).items():
        drive = overridden(drive, {unit: values})
    got, want = simulate(drive, 0.5), simulate(experiment.drive(), 0.5)
    assert got.samples.tobytes() == want.samples.tobytes()


def test_what_differs_is_set_live_or_needs_another_start() -> None:
    old = {unit: {name: value for name, (_, value) in build(
        unit, experiments()['T4a'].drive()).settings().items()} for unit in UNITS}
    same = plan('T4a', old)
    assert (same.live, same.constants) == ({}, {})
    other = plan('T1', old)
    assert other.constants == {}
    assert other.live['test_signal']['waveform'] == 'square'
    assert other.live['torque_share'] == {'bias_source': 'fixed'}
    assert plan('T3b', old).constants['torque_share'] == ['k_2', 's_2', 'k_3', 'g_4', 'start']


def test_published_levels_are_those_of_the_article() -> None:
    bias = {(level.analysis, level.field) for level in levels('T3b')}
    assert bias == {(11.6, 11.4), (7.2, 8.0)}, 'Section V, Fig. 20'
    rates = [level.analysis for level in levels('T1') if level.signal == 'motor_1/tach_rate']
    assert rates == pytest.approx([math.radians(193.0), -math.radians(193.0)]), 'Section IV'
    assert {item['name'] for item in listed()} == set(experiments())
    assert all(item['claims'] for item in listed())
    said = {claim['measure']: claim['says'] for item in listed() for claim in item['claims']}
    assert said['T3b.low'] == '7.2 V (analysis), 8 V (field)', 'Fig. 20'
    assert said['T3b.time_at_zero'] == 'never', 'Fig. 20'
    assert said['T1.tach_rate'] == '193 deg/s', 'Section IV'


def test_a_preview_is_what_the_drive_plays() -> None:
    given = {'waveform': 'saw_tooth', 'amplitude': 0.01, 'period': 4.0, 'offset': 0.002}
    shown = preview(given, 8.0, points=80)
    run = simulate(changed(load(), {f'test_signal.rate.{k}': v for k, v in given.items()}), 8.0)
    command = run['test_signal/rate_command'][:-1].reshape(80, 100)
    # of each interval eight times are read, the drive's steps are a hundred: 0.02 rad/s in 2 s
    nearest = 0.01 * 0.1
    np.testing.assert_allclose(shown['low'], command.min(axis=1), atol=nearest)
    np.testing.assert_allclose(shown['high'], command.max(axis=1), atol=nearest)
    with pytest.raises(ParameterError, match='period'):
        preview({'period': -1.0}, 1.0)
    with pytest.raises(ParameterError, match='weights'):
        preview({'waveform': 'multisine', 'weights': [1.0]}, 1.0)
