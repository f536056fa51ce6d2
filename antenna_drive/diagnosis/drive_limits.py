# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Limits of the drive that a test must keep, and how near a simulated test comes to them.

A limit that the user does not give follows from the configuration. The drive limits currents and
voltages by itself, in tests as in service: a test may reach these limits, and may go beyond them
only by what `BEYOND` says. What it may not do is stay there, see `hot_s`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
import math
from pathlib import Path
from typing import Any

from antenna_drive.emulator.wiring import MOTORS
from antenna_drive.parameters.sets import Drive
import numpy as np
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, ParameterError
from simgap.machine.contract import FloatArray

# What must be known of a simulated test.
CHANNELS = ('plant/axis_rate', 'plant/axis_angle', *(
    f'{motor}/{signal}' for signal in ('current', 'gear_torque', 'tach_rate') for motor in MOTORS))
# The drive's own limiters, and the tolerance and the margin beyond them.
BEYOND = 1.2
# Shares of the greatest rate and current that a test keeps, the time above that current, and the
# travel of a test of half a minute. None of them is in the article.
_RATE, _HOT, _HOT_S, _TRAVEL_DEG = 0.9, 0.8, 10.0, 10.0


def _limit(unit: str, description: str) -> Any:
    return field(metadata={'entry': Entry(unit, 1e-6, 1e12, description)})


@dataclass(frozen=True)
class DriveLimits:
    """What a test must not exceed; a motor may spend `hot_s` in all above `hot_current_A`."""

    rate_deg_s: float = _limit('deg/s', 'rate of the axis')
    acceleration_deg_s2: float = _limit('deg/s^2', 'acceleration of the axis')
    travel_deg: float = _limit('deg', 'from the lowest to the highest elevation of a test')
    current_A: float = _limit('article A', 'current of each motor, article amperes')
    voltage_V: float = _limit('V', 'voltage of each armature')
    axis_torque_N_m: float = _limit('N m', 'torque of both gearboxes at the axis')
    hot_current_A: float = _limit('article A', 'current above which the time is limited')
    hot_s: float = _limit('s', 'time of each motor above hot_current_A')

    @classmethod
    def of_drive(cls, drive: Drive) -> DriveLimits:
        """Return the limits that follow from a configuration."""
        armature, motor = drive.motor_1.armature, drive.motor_1.motor
        torque = 2.0 * motor.current_limit * motor.torque_constant * drive.motor_1.gear_ratio
        return cls(
            rate_deg_s=_RATE * math.degrees(drive.greatest_rate),
            # the modes follow the hub later
            acceleration_deg_s2=BEYOND * math.degrees(torque / drive.plant.axis.inertia_hub),
            travel_deg=_TRAVEL_DEG, current_A=BEYOND * motor.current_limit,
            voltage_V=BEYOND * armature.voltage_limit, axis_torque_N_m=BEYOND * torque,
            hot_current_A=_HOT * motor.current_limit, hot_s=_HOT_S)

    def use(self, time: FloatArray, out: FloatArray, drive: Drive) -> dict[str, float]:
        """
        Return the share of each limit that a simulated test uses, 1 at the limit.

        time : shape (n,) [s]
        out : values and slopes of `CHANNELS`, shape (n, 8, 2)
        """
        armature = drive.motor_1.armature
        (rate, angle), (acceleration, _) = out[:, :2, 0].T, out[:, :2, 1].T
        current, torque, tach = np.split(out[:, 2:], 3, axis=1)
        voltage = (armature.physical_amperes_per_article_ampere * (
            armature.inductance * current[:, :, 1] + armature.resistance * current[:, :, 0])
            + armature.back_emf_constant * tach[:, :, 0])
        hot = np.gradient(time) @ (np.abs(current[:, :, 0]) > self.hot_current_A)
        reached = {
            'rate_deg_s': math.degrees(_greatest(rate)),
            'acceleration_deg_s2': math.degrees(_greatest(acceleration)),
            'travel_deg': math.degrees(_greatest(angle - angle.min())),
            'current_A': _greatest(current[:, :, 0]), 'voltage_V': _greatest(voltage),
            'axis_torque_N_m': drive.motor_1.gear_ratio * _greatest(torque[:, :, 0].sum(axis=1)),
            'hot_s': _greatest(hot)}
        return {name: amount / getattr(self, name) for name, amount in reached.items()}


def read_limits(path: Path, drive: Drive) -> DriveLimits:
    """Read limits, what a file lacks follows from the configuration; ParameterError if wrong."""
    tree = read_yaml(path)
    known = {item.name: item.metadata['entry'] for item in fields(DriveLimits)}
    try:
        given = mapping_of('', {} if tree is None else tree, known)
        return replace(DriveLimits.of_drive(drive), **{
            name: known[name].check(name, value) for name, value in given.items()})
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None


def _greatest(values: FloatArray) -> float:
    # a run that diverged keeps no limit
    return float(np.nan_to_num(np.abs(values), nan=np.inf).max())
