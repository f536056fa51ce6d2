# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The nuisances of the antenna: what they change, by how much, and that they change it alone."""

from __future__ import annotations

from dataclasses import replace
import math

from antenna_drive.diagnosis.field_test import FieldTest, prepared
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.modifiers import (
    FieldChange, ReadingModifier, RunSetup, SensorReadings,
)
from antenna_drive.diagnosis.planned_tests import BUILT_IN, planned
from antenna_drive.diagnosis.tolerances import nuisances
from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed
from antenna_drive.readings import AT
from antenna_drive.recording.sheet import Tolerances
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

TOLERANCE = 0.02


def field_tests(*names: str) -> list[FieldTest]:
    return prepared({name: planned(BUILT_IN[name], 2.0, 100.0) for name in names}, load(),
                    lambda note: None)


TESTS = field_tests('square', 'triangle')
NUISANCES = {item.name: item for item in nuisances(TESTS, TOLERANCE)}


@pytest.mark.parametrize(('name', 'path', 'expected'), [
    ('offset:motor_1.amplifier.rate_gain', 'motor_1.amplifier.rate_gain', None),
    ('offset:motor_2.gearbox.stiffness', 'motor_2.gearbox.stiffness', None),
    ('offset:plant.axis.inertia_hub', 'plant.axis.inertia_hub', None),
    ('offset:torque_share.filter_1.gain', 'torque_share.filter_1.gain', None),
    ('offset:motor_1.armature.resistance_change', 'motor_1.armature.resistance_change',
     TOLERANCE * load().motor_1.armature.resistance),
])
def test_a_tolerance_changes_its_number_and_no_other(name: str, path: str,
                                                     expected: float | None) -> None:
    """The record is the one of a configuration in which that number is written down."""
    drive = load()
    item = NUISANCES[name]
    value: float = expected or 1.0 + TOLERANCE
    if expected is None:
        number = drive
        for part in path.split('.'):
            number = getattr(number, part)
        assert isinstance(number, float)
        value *= number
    record = record_of(drive)
    setup = RunSetup(record.view(np.float64), record.dtype, TESTS[0].bias)
    assert isinstance(item.modifier, FieldChange)
    item.modifier.apply(setup, item.high)
    written = record_of(changed(drive, {path: value})).view(np.float64)
    np.testing.assert_allclose(setup.numbers, written, rtol=1e-14)


def test_a_tolerance_is_spread_evenly_between_its_bounds() -> None:
    """The standard deviation of an even spread is its half width by the root of three."""
    for name, item in NUISANCES.items():
        if name.startswith('offset:'):
            assert item.high == -item.low
            assert item.prior_sigma == pytest.approx(item.high / math.sqrt(3.0))
            assert item.experiment is None


@pytest.mark.parametrize('channel', list(AT))
def test_a_zero_shifts_one_reading_of_one_test(channel: str) -> None:
    for k, test in enumerate(TESTS):
        item = NUISANCES[f'zero:{channel}:{test.name}']
        assert item.experiment == k
        readings = SensorReadings()
        assert isinstance(item.modifier, ReadingModifier)
        item.modifier.apply_to_readings(readings, item.high)
        shifted = np.flatnonzero(readings.zero)
        assert list(AT)[shifted[0]] == channel and shifted.size == 1


def test_a_clock_that_is_late_reads_what_comes_later() -> None:
    readings = SensorReadings()
    modifier = NUISANCES['clock:square'].modifier
    assert isinstance(modifier, ReadingModifier)
    modifier.apply_to_readings(readings, 0.01)
    np.testing.assert_allclose(readings.late, -0.01)


def test_every_test_has_its_starting_places_and_the_machine_its_tolerances_once() -> None:
    names = list(NUISANCES)
    assert sum(name.startswith('start:') for name in names) == 2 * len(TESTS)
    more = [item.name for item in nuisances(field_tests('square'), TOLERANCE)]
    assert [n for n in more if n.startswith('offset:')] == [
        n for n in names if n.startswith('offset:')]


GIVEN = Tolerances(tach_zero_rad_s=0.01, amplifier_zero_V=2e-4, recorder_gain=0.01,
                   current_zero_A=0.02, bias_zero_V=0.03, channel_delay_samples=1.0,
                   channel_lag_s=0.003, clock_ppm=100.0)


@pytest.fixture(scope='module')
def tolerant() -> AntennaMachine:
    """Return the drive in a test whose sheet says how far its recorder may be off."""
    recording = planned(replace(BUILT_IN['multisine'], tolerances=GIVEN), 6.0, 200.0)
    return AntennaMachine({'made': recording}, load(), threads=1)


def test_a_sheet_says_what_else_may_be_off(tolerant: AntennaMachine) -> None:
    bounds = {item.name: (item.low, item.high) for item in tolerant.nuisances}
    assert bounds['offset:motor_2.tachometer.offset'] == (-0.01, 0.01)
    assert bounds['offset:motor_1.amplifier.offset'] == (-2e-4, 2e-4)
    assert bounds['gain:bias_voltage'] == (-0.01, 0.01)
    assert bounds['delay:encoder'] == pytest.approx((0.0, 0.005))
    assert bounds['lag:current_2'] == (0.0, 0.003)
    assert bounds['zero:current_1:made'] == (-0.02, 0.02)
    assert bounds['clock_rate:made'] == pytest.approx((-1e-4, 1e-4))
    # the effect in the same number knows its tolerance
    effect = tolerant.catalogue['tach_2.offset'].forms[0].parameters[0]
    assert effect.tolerance == 0.01
    assert tolerant.catalogue['current_1.gain'].forms[0].parameters[0].tolerance == 0.01


def test_a_delayed_channel_reads_what_was_a_moment_before(tolerant: AntennaMachine) -> None:
    """Against the readings themselves, interpolated, to first order; other channels stay."""
    time = tolerant.experiments[0].time
    plain, late = (tolerant.predict(point, 0) for point in ({}, {'delay:encoder': 0.005}))
    encoder = list(AT).index('encoder')
    course = CubicSpline(time, plain[:, encoder])
    second_order = 0.5 * 0.005 ** 2 * np.abs(course(time, 2)).max()
    moving = np.abs(course(time, 1)) > 0.3 * np.abs(course(time, 1)).max()
    np.testing.assert_allclose(late[moving, encoder], course(time - 0.005)[moving], rtol=0.0,
                               atol=second_order)
    assert second_order < 0.05 * np.abs(plain[:, encoder] - late[:, encoder]).max()
    np.testing.assert_array_equal(np.delete(late, encoder, 1), np.delete(plain, encoder, 1))


def test_a_slow_clock_reads_later_the_longer_it_runs(tolerant: AntennaMachine) -> None:
    time = tolerant.experiments[0].time
    plain, slow = (tolerant.predict(point, 0) for point in ({}, {'clock_rate:made': 1e-4}))
    encoder = list(AT).index('encoder')
    course = CubicSpline(time, plain[:, encoder])
    expected = course(time + 1e-4 * (time - time[0]))
    change = np.abs(expected - plain[:, encoder]).max()
    # a spline is not the course where the axis sticks and lets go
    moving = np.abs(course(time, 1)) > 0.3 * np.abs(course(time, 1)).max()
    np.testing.assert_allclose(slow[moving, encoder], expected[moving], rtol=0.0,
                               atol=0.01 * change)


def test_a_zero_within_the_loop_parts_the_currents(tolerant: AntennaMachine) -> None:
    """
    Filter 1 holds the motors together against a zero, at a difference of the currents.

    At rest both rate errors vanish, which takes a counter torque of k_t zero / (2 s_F), and for it
    Filter 1 needs p / (k' k_d) of that as a difference of the currents.
    """
    drive, zero = load(), 0.004
    plain, off = (tolerant.predict(point, 0) for point in (
        {}, {'offset:motor_1.tachometer.offset': zero}))
    apart = (off - plain)[:, 1] - (off - plain)[:, 0]
    amplifier, filter_1 = drive.motor_1.amplifier, drive.torque_share.filter_1
    expected = (amplifier.tach_gain * zero / (2.0 * amplifier.bias_command_gain)
                * filter_1.pole / (filter_1.gain * filter_1.difference_gain))
    assert np.mean(apart[-70:]) == pytest.approx(expected, rel=0.1)
