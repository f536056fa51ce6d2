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
"""
Limits of the drive that a test must keep, and how near a simulated test comes to them.

A limit that the user does not give follows from the configuration: the current limit, the voltage
limit, and the rate and the torque that they allow.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
import math
from pathlib import Path

from antenna_drive.diagnosis import FloatArray
from antenna_drive.parameters.plain_yaml import read_yaml
from antenna_drive.parameters.schema import Entry, mapping_of, ParameterError
from antenna_drive.parameters.sets import Drive
import numpy as np

CHANNELS = ('plant/axis_rate', 'plant/axis_angle', 'motor_1/current', 'motor_2/current',
            'motor_1/gear_torque', 'motor_2/gear_torque', 'motor_1/tach_rate',
            'motor_2/tach_rate')
# Shares of the greatest rate and current that a long test keeps, and the travel of a test of half
# a minute. None of them is in the article.
_RATE, _HOT, _HOT_S, _TRAVEL_DEG = 0.9, 0.8, 2.0, 10.0


@dataclass(frozen=True)
class DriveLimits:
    """
    What a test must not exceed; the same names say what a test reaches.

    Attributes
    ----------
    rate_deg_s, acceleration_deg_s2, travel_deg : of the axis
    current_A : of each motor, article amperes
    voltage_V : of each armature
    axis_torque_N_m : of both gearboxes together, at the axis
    hot_s : time that a motor spends above hot_current_A

    """

    rate_deg_s: float
    acceleration_deg_s2: float
    travel_deg: float
    current_A: float
    voltage_V: float
    axis_torque_N_m: float
    hot_s: float

    @classmethod
    def of_drive(cls, drive: Drive) -> DriveLimits:
        """Return the limits that follow from a configuration."""
        armature, motor = drive.motor_1.armature, drive.motor_1.motor
        ratio = drive.motor_1.gear_ratio
        rate = armature.voltage_limit / armature.back_emf_constant / ratio
        torque = 2.0 * motor.current_limit * motor.torque_constant * ratio
        inertia = (drive.plant.axis.inertia_hub + sum(drive.plant.axis.mode_inertias)
                   + 2.0 * motor.rotor_inertia * ratio ** 2)
        return cls(_RATE * math.degrees(rate), math.degrees(torque / inertia), _TRAVEL_DEG,
                   motor.current_limit, armature.voltage_limit, torque, _HOT_S)

    def changed(self, given: Mapping[str, object]) -> DriveLimits:
        """
        Return the limits with some of them given.

        Raises
        ------
        ParameterError : a name or a value is not allowed; the message names the key

        """
        known = {item.name: item for item in fields(self)}
        return replace(self, **{
            name: Entry('', 1e-6, 1e12).check(name, value)
            for name, value in mapping_of('', given, known).items()})

    def worst(self, reached: DriveLimits) -> tuple[str, float]:
        """Return the limit that a test uses most, and its share of it."""
        shares = {item.name: getattr(reached, item.name) / getattr(self, item.name)
                  for item in fields(self)}
        name = max(shares, key=lambda key: shares[key])
        return name, shares[name]


def read_limits(path: Path, drive: Drive) -> DriveLimits:
    """
    Read limits from a file; what it does not give follows from the configuration.

    Raises
    ------
    ParameterError : the file cannot be read or an entry is not allowed; the message names both

    """
    tree = read_yaml(path)
    try:
        return DriveLimits.of_drive(drive).changed(mapping_of('', {} if tree is None else tree))
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None


def reached(time: FloatArray, out: FloatArray, drive: Drive) -> DriveLimits:
    """
    Return what a simulated test reaches.

    Parameters
    ----------
    time
        shape (n,) [s]
    out
        values and slopes of `CHANNELS`, shape (n, 8, 2)
    drive
        the configuration

    """
    value, slope = out[:, :, 0], out[:, :, 1]
    armature, ratio = drive.motor_1.armature, drive.motor_1.gear_ratio
    current = value[:, 2:4]
    voltage = (armature.physical_amperes_per_article_ampere * (
        armature.inductance * slope[:, 2:4] + armature.resistance * current)
        + armature.back_emf_constant * value[:, 6:8])
    hot = np.abs(current) > _HOT * drive.motor_1.motor.current_limit
    spent = np.gradient(time) @ hot
    return DriveLimits(
        math.degrees(_greatest(value[:, 0])), math.degrees(_greatest(slope[:, 0])),
        math.degrees(float(np.ptp(value[:, 1]))), _greatest(current), _greatest(voltage),
        ratio * _greatest(value[:, 4] + value[:, 5]), float(spent.max()))


def _greatest(values: FloatArray) -> float:
    # a run that diverged keeps no limit
    return float(np.nan_to_num(np.abs(values), nan=np.inf).max())
