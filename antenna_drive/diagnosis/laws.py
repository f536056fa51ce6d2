# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The functions that the drive's equations have room for, over what the tests have reached."""

from collections.abc import Iterator, Sequence

from antenna_drive.diagnosis.catalogue import MOTORS
from antenna_drive.diagnosis.field_test import FieldTest
from antenna_drive.diagnosis.modifiers import AntennaParameter, Tabled
from antenna_drive.parameters.sets import Drive, LAW_PLACES
from antenna_drive.readings import AT
import numpy as np
from simgap.machine.contract import Effect, FloatArray, Form, Learnable
from simgap.machine.with_law import walk

# An outlier of a reading has not been reached.
_ENDS = (0.002, 0.998)
# What moves the drive a little: a torque of a motor, one of the axis, a current of an amplifier.
_OF_MOTOR, _OF_AXIS, _CURRENT = (0.05, 'N m'), (2e3, 'N m'), (0.01, 'article A')
# Of a motor: the function, its step, what it depends on with its unit, and readings that tell it.
_OF_A_MOTOR = (('motor.friction_by_rate', _OF_MOTOR, 'rate', 'rad/s', 'tach'),
               ('motor.friction_by_load', _OF_MOTOR, 'gear torque', 'N m', 'current'),
               ('motor.torque_by_current', _OF_MOTOR, 'current', 'article A', 'current'),
               ('amplifier.current_by_demand', _CURRENT, 'demand', 'article A', 'current'))


def learnable(tests: Sequence[FieldTest], predicted: Sequence[FloatArray],
              drive: Drive) -> Iterator[Learnable]:
    """Yield the functions, of one motor, of both alike, and of the axis."""
    def reached(reading: str, turned: float = 0.0) -> list[float]:
        seen = [readings[:, AT[reading]] + turned * test.start_angle
                for test, own in zip(tests, predicted, strict=True)
                for readings in (test.measured, own)]
        return np.nanquantile(np.concatenate(seen), _ENDS).tolist()

    for component, motors in MOTORS.items():
        for function, step, by, unit, reading in _OF_A_MOTOR:
            per = drive.motor_1.motor.torque_constant if by == 'gear torque' else 1.0
            ends = [end for motor in motors for end in reached(f'{reading}_{motor[-1]}')]
            whose = f'of {component}'.replace('_', ' ').replace('motors', 'both motors')
            yield _law(component, whose, step, by, unit, None, per * max(map(abs, ends)), [
                f'{motor}.{function}' for motor in motors])
    for m in (1, 2):
        most = drive.motor_1.motor.torque_constant * max(map(abs, reached(f'current_{m}')))
        yield _law(f'gearbox_{m}', f'of gearbox {m}', _OF_MOTOR, 'gear torque', 'N m', None, most,
                   [f'motor_{m}.gearbox.torque_by_load'])
    most = max(map(abs, reached('tach_1'))) / drive.plant.axis.gear_ratio
    yield _law('axis', 'of the axis', _OF_AXIS, 'rate', 'rad/s', None, most,
               ['plant.axis.friction_by_rate'])
    low, high = reached('encoder', turned=1.0)
    yield _law('axis', 'on the axis', _OF_AXIS, 'angle', 'rad', 0.5 * (low + high),
               0.5 * (high - low), ['plant.axis.torque_by_angle'])


def _law(component: str, whose: str, step: tuple[float, str], by: str, unit: str,
         middle: float | None, reach: float, paths: Sequence[str]) -> Learnable:
    function = paths[0].rpartition('.')[2]
    key, at = f'{component}.{function}', (middle or 0.0) + np.linspace(-reach, reach, LAW_PLACES)
    return Learnable(
        Effect(key, component, f'{function.partition("_")[0]} {whose}', (Form(by, tuple(
            AntennaParameter(f'{key}.{k}', step[1], -1e8, 1e8, step[0],
                             modifier=Tabled(tuple(np.flatnonzero(steps)), middle, reach,
                                             tuple(paths)))
            for k, steps in enumerate(walk(LAW_PLACES).T)), scanned=True),)),
        by, unit, tuple(at.tolist()))
