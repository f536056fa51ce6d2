# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The nuisances of the antenna: what they change, by how much, and that they change it alone."""

from __future__ import annotations

import math

from antenna_drive.machines.antenna.field_test import CHANNELS, FieldTest, prepared
from antenna_drive.machines.antenna.modifiers import (
    FieldChange, ReadingModifier, RunSetup, SensorReadings,
)
from antenna_drive.machines.antenna.planned_tests import BUILT_IN, planned
from antenna_drive.machines.antenna.tolerances import nuisances
from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed
import numpy as np
import pytest

TOLERANCE = 0.02


def field_tests(*names: str) -> list[FieldTest]:
    return [prepared(name, planned(BUILT_IN[name], 2.0, 100.0), load(), lambda note: None)
            for name in names]


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
    setup = RunSetup(record_of(drive).view(np.float64).copy(), record_of(drive).dtype, 2.0,
                     TESTS[0].bias)
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


@pytest.mark.parametrize('channel', list(CHANNELS.values()))
def test_a_zero_shifts_one_reading_of_one_test(channel: str) -> None:
    for k, test in enumerate(TESTS):
        item = NUISANCES[f'zero:{channel}:{test.name}']
        assert item.experiment == k and item.on_readings
        readings = SensorReadings(np.zeros((3, 6)), np.zeros((3, 6)))
        assert isinstance(item.modifier, ReadingModifier)
        item.modifier.apply_to_readings(readings, item.high)
        shifted = np.flatnonzero(readings.zero)
        assert list(CHANNELS.values())[shifted[0]] == channel and shifted.size == 1


def test_a_clock_that_is_late_reads_what_was_before() -> None:
    slopes = np.arange(18.0).reshape(3, 6)
    readings = SensorReadings(np.zeros((3, 6)), slopes)
    modifier = NUISANCES['clock:square'].modifier
    assert isinstance(modifier, ReadingModifier)
    modifier.apply_to_readings(readings, 0.01)
    np.testing.assert_allclose(readings.values, 0.01 * slopes)


def test_every_test_has_its_starting_places_and_the_machine_its_tolerances_once() -> None:
    names = list(NUISANCES)
    assert sum(name.startswith('start:') for name in names) == 2 * len(TESTS)
    more = [item.name for item in nuisances(field_tests('square'), TOLERANCE)]
    assert [n for n in more if n.startswith('offset:')] == [
        n for n in names if n.startswith('offset:')]
