# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Limits of the drive and the tests that are drawn within them."""

from __future__ import annotations

from dataclasses import asdict, fields, replace
import math
from pathlib import Path
from typing import Any

from antenna_drive.diagnosis.allowed_tests import AntennaTests, FAMILIES
from antenna_drive.diagnosis.drive_limits import CHANNELS, DriveLimits, read_limits
from antenna_drive.diagnosis.excitation import SheetCommand
from antenna_drive.diagnosis.planned_tests import BUILT_IN
from antenna_drive.parameters.loading import load
from antenna_drive.recording.sheet import dump_sheet, FixedBias, Knots, parse_sheet
from hypothesis import given, settings, strategies
import numpy as np
import pytest
from simgap.inputs.schema import ParameterError
import yaml

DRIVE = load()
NAMES = [item.name for item in fields(DriveLimits)]
numbers = strategies.floats(1e-5, 1e11)


@settings(max_examples=30, deadline=None)
@given(strategies.dictionaries(strategies.sampled_from(NAMES), numbers))
def test_a_file_of_limits_says_what_it_says_and_nothing_else(
        tmp_path_factory: pytest.TempPathFactory, entries: dict[str, float]) -> None:
    path = tmp_path_factory.mktemp('limits') / 'limits.yaml'
    path.write_text(yaml.safe_dump(entries))
    found, usual = read_limits(path, DRIVE), DriveLimits.of_drive(DRIVE)
    assert asdict(found) == {**asdict(usual), **entries}


@settings(max_examples=30, deadline=None)
@given(strategies.dictionaries(
    strategies.text(strategies.characters(categories=('L', 'N', 'P')), min_size=1, max_size=12)
    | strategies.sampled_from(NAMES),
    strategies.none() | strategies.booleans() | strategies.text(max_size=5)
    | strategies.floats(max_value=0.0) | strategies.lists(numbers, max_size=2), min_size=1))
def test_a_wrong_file_of_limits_is_refused_in_one_line(
        tmp_path_factory: pytest.TempPathFactory, entries: dict[str, Any]) -> None:
    path = tmp_path_factory.mktemp('limits') / 'limits.yaml'
    path.write_text(yaml.safe_dump(entries, allow_unicode=True))
    with pytest.raises(ParameterError) as refusal:
        read_limits(path, DRIVE)
    assert str(path) in str(refusal.value) and '\n' not in str(refusal.value)


def test_an_empty_file_of_limits_leaves_the_usual_ones(tmp_path: Path) -> None:
    (tmp_path / 'limits.yaml').write_text('')
    assert read_limits(tmp_path / 'limits.yaml', DRIVE) == DriveLimits.of_drive(DRIVE)


def limits(**changes: float) -> DriveLimits:
    return replace(DriveLimits(*(1e9,) * len(NAMES)), **changes)


def test_the_use_of_each_limit_is_that_of_a_motion_in_closed_form() -> None:
    drive = DRIVE
    time = np.linspace(0.0, 10.0, 20001)
    pulsation, size = 0.7, math.radians(2.0)
    out = np.zeros((time.size, len(CHANNELS), 2))
    turn = pulsation * time
    out[:, 1, 0] = size * np.sin(turn)
    out[:, 0, 0], out[:, 0, 1] = size * pulsation * np.cos(turn), -(
        size * pulsation ** 2) * np.sin(turn)
    out[:, 2, 0], out[:, 3, 0] = 3.0 * np.sin(turn), -1.0
    out[:, 2, 1] = 3.0 * pulsation * np.cos(turn)
    out[:, 4, 0], out[:, 5, 0] = 20.0, -5.0
    out[:, 6, 0] = 8.0
    use = limits(rate_deg_s=2.0, acceleration_deg_s2=2.0, travel_deg=8.0, current_A=6.0,
                 axis_torque_N_m=30.0 * drive.motor_1.gear_ratio, voltage_V=100.0,
                 hot_current_A=1.5, hot_s=10.0).use(time, out, drive)
    assert use['rate_deg_s'] == pytest.approx(pulsation)
    assert use['acceleration_deg_s2'] == pytest.approx(pulsation ** 2)
    # from the greatest to the least, both reached within 10 s
    assert use['travel_deg'] == pytest.approx(0.5, rel=1e-3)
    assert use['current_A'] == pytest.approx(0.5, rel=1e-4)
    assert use['axis_torque_N_m'] == pytest.approx(0.5)
    # |sin| is above one half for two thirds of each half turn
    above = np.mean(np.abs(np.sin(turn)) > 0.5)
    assert use['hot_s'] == pytest.approx(above, abs=1e-3)
    armature = drive.motor_1.armature
    volts = np.abs(armature.physical_amperes_per_article_ampere * (
        armature.resistance * out[:, 2, 0] + armature.inductance * out[:, 2, 1])
        + 8.0 * armature.back_emf_constant).max()
    assert use['voltage_V'] == pytest.approx(volts / 100.0)


def test_a_run_that_diverged_keeps_no_limit() -> None:
    out = np.full((10, len(CHANNELS), 2), np.nan)
    use = DriveLimits.of_drive(DRIVE).use(np.arange(10.0), out, DRIVE)
    assert use['rate_deg_s'] == math.inf


@pytest.mark.parametrize('name', BUILT_IN)
def test_built_in_tests_keep_the_usual_limits(name: str) -> None:
    space = AntennaTests(BUILT_IN[name], load(), DriveLimits.of_drive(DRIVE))
    use = space.use(space.machine(BUILT_IN[name]), [{}])
    assert max(use.values()) < 0.9


@pytest.mark.parametrize('family', FAMILIES)
def test_drawn_tests_are_sheets_that_begin_and_end_at_rest(family: str) -> None:
    drive = DRIVE
    most = DriveLimits.of_drive(drive)
    space = AntennaTests(BUILT_IN['square'], drive, most, duration=20.0)
    random = np.random.default_rng(5)
    for _ in range(20):
        sheet = space.draw(family, random)
        assert parse_sheet(yaml.safe_load(dump_sheet(sheet))) == sheet
        assert sheet.waveform is not None
        rate = np.abs(SheetCommand(sheet.waveform)(np.linspace(0.0, 20.0, 4001)))
        assert rate.max() > 0.0
        if isinstance(sheet.waveform, Knots):
            # the motion begins soon and has ended, so that all of it is compared
            assert np.flatnonzero(rate)[0] / 200.0 <= 1.2 and rate[-1] == 0.0
        assert np.degrees(rate.max()) <= 5.0 * most.rate_deg_s
        assert isinstance(sheet.bias, FixedBias) == (family == 'torque')


def test_straight_lines_between_points_are_played_as_numpy_draws_them() -> None:
    times, rates = (1.0, 2.5, 2.5, 4.0, 7.0), (0.1, 0.4, -0.2, -0.2, 0.3)
    command = SheetCommand(Knots(times, rates))
    at = np.linspace(0.0, 8.0, 1601)
    # just after each time, where a jump has been made
    expected = np.interp(at + 1e-7, np.array(times) + [0.0, 0.0, 1e-7, 0.0, 0.0], rates)
    expected[(at < 1.0) | (at >= 7.0)] = 0.0
    assert np.degrees(command(at)) == pytest.approx(expected, abs=1e-6)
    assert command.knots(5.0) == pytest.approx([1.0, 2.5, 4.0])


def test_a_sheet_with_times_that_go_back_is_refused() -> None:
    with pytest.raises(ParameterError, match='times_s'):
        parse_sheet({'waveform': {'type': 'knots', 'times_s': [0.0, 2.0, 1.0],
                                  'rates_deg_s': [0.0, 0.1, 0.0]}})
