# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The places of the drive where an unknown input may act, and how it gets into a run."""

from collections.abc import Iterator
from dataclasses import dataclass
import math

from antenna_drive.diagnosis.modifiers import ADD, RunSetup, SET
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import place_of
import numpy as np
from simgap.machine.contract import Course, DisturbanceInput

# One unit of a torque on the axis [N m].
_AXIS = 3e4


@dataclass(frozen=True)
class DriveDisturbance(DisturbanceInput):
    """
    A place of the drive.

    path : the number of the record that the input is added to, in the unit of that number
    settings : other changes of the record that the input needs: path, how, value
    """

    path: str = ''
    settings: tuple[tuple[str, str, float], ...] = ()


def disturbances(wind: float) -> Iterator[DriveDisturbance]:
    """Yield the places; the wind of every day has this rms [N m]."""
    yield DriveDisturbance('torque on the axis', 'axis', 'plant.axis.steady_wind_torque',
                           unit='N m', size=_AXIS, everyday=wind / _AXIS)
    yield DriveDisturbance('voltage in the torque share', 'torque_share',
                           'torque_share.circuit.fade_out_voltage', unit='V', size=0.2)
    for m in (1, 2):
        motor, tooth = f'motor_{m}', f'motor_{m}.gearbox.transmission_error'
        yield DriveDisturbance(f'friction of motor {m}', motor, f'{motor}.motor.coulomb_torque',
                               unit='article A', size=0.2)
        yield DriveDisturbance(f'voltage in amplifier {m}', motor, f'{motor}.amplifier.offset',
                               unit='V', size=0.01)
        yield DriveDisturbance(f'reading of tachometer {m}', f'tach_{m}',
                               f'{motor}.tachometer.offset', unit='rad/s', size=0.2)
        # a transmission error of zero cycles displaces the tooth alike at any angle
        yield DriveDisturbance(f'displacement in gearbox {m}', f'gearbox_{m}', tooth, (
            (tooth, ADD, 1e-12), (f'{tooth}_cycles', SET, 0.0),
            (f'{tooth}_phase', SET, 0.5 * math.pi)), unit='rad', size=2e-3)


def disturbed(plan: batch.Schedule, run: RunSetup, place: DriveDisturbance,
              course: Course) -> batch.Schedule:
    """Return a plan that lets an input into the drive, and set the drive's record up for it."""
    for path, how, value in place.settings:
        run.change(path, how, value)
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    steps[:, batch.CHANGE] = place.size * course(np.cumsum(length) - 0.5 * length)
    return batch.Schedule(steps, plan.keep, place_of(run.kind, place.path))
