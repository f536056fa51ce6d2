# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The tests that the drive may run, as the design of the next test asks for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from antenna_drive.diagnosis.candidate_tests import drawn, FAMILIES, nearby
from antenna_drive.diagnosis.drive_limits import CHANNELS, DriveLimits
from antenna_drive.diagnosis.excitation import SheetCommand
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import planned
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.sheet import dump_sheet, sheet_tree, TestSheet
import numpy as np
from simgap.machine.contract import FloatArray, Machine, Point
from simgap.next_test.space import TestSpace

# Of the curve of a command [Hz].
_DRAWN_HZ = 200.0
# Signals that no sensor of a test reads, and the sensor that would.
_UNREAD = {
    'motor_1/gear_torque': 'torque sensor between motor 1 and its gearbox',
    'motor_2/gear_torque': 'torque sensor between motor 2 and its gearbox',
    'plant/axis_rate': 'rate gyroscope on the axis',
    'plant/pointing_error_elevation': 'pointing on a source, in elevation',
    'torque_share/counter_torque': 'voltmeter at the output of Filter 1',
}


class AntennaTests(TestSpace):
    """
    The tests that the drive may run.

    base : what a further test shares with those that were made; its waveform and start do not
        count
    drive : the configuration
    limits : of the drive
    duration : of a test [s]
    rate : at which it is simulated, samples per second [Hz]
    """

    families = tuple(FAMILIES)

    def __init__(self, base: TestSheet, drive: Drive, limits: DriveLimits,
                 duration: float = 30.0, rate: float = 70.0) -> None:
        """Take what all the tests have in common."""
        # the waveform is what is looked for; a proposal is a test from rest
        self._base = replace(base, waveform=None, start='rest')
        self._drive, self._limits = drive, limits
        self._duration, self._rate = duration, rate
        self.limits = limits.as_data()

    def draw(self, family: str, random: np.random.Generator) -> TestSheet:
        """Return the sheet of a test of a family."""
        return drawn(family, self._base, self._limits,
                     self._drive.torque_share.circuit.saturation_high, self._duration, random)

    def nearby(self, family: str, test: Any, random: np.random.Generator) -> TestSheet:
        """Return the sheet of a test like another one."""
        return nearby(test, random)

    def machine(self, test: Any) -> AntennaMachine:
        """Return the drive in one test."""
        return AntennaMachine({'next': planned(test, self._duration, self._rate)}, self._drive,
                              threads=1)

    def use(self, machine: Machine, points: Sequence[Point]) -> Mapping[str, float]:
        """Return the share of each limit that a test uses, the worst of some variants."""
        shares = [self._limits.use(*_outputs(machine, point, CHANNELS), self._drive)
                  for point in points]
        return {name: max(share[name] for share in shares) for name in shares[0]}

    def command(self, test: Any) -> tuple[FloatArray, FloatArray, str]:
        """Return times, rates and unit of the command of a test."""
        command = SheetCommand(test.waveform)
        time = np.linspace(0.0, self._duration, int(self._duration * _DRAWN_HZ) + 1)
        return time, np.degrees(command(time)), 'deg/s'

    def as_data(self, test: Any) -> dict[str, Any]:
        """Return a test sheet as plain data."""
        return sheet_tree(test)

    def files(self, test: Any, path: Path) -> Mapping[Path, str]:
        """Return a test sheet as YAML."""
        return {path: dump_sheet(test)}

    def unread(self, machine: Machine, one: Point, other: Point) -> Mapping[str, float]:
        """Return by how much two variants differ in what no sensor reads, see `TestSpace`."""
        first, second = (_outputs(machine, point, tuple(_UNREAD))[1][:, :, 0]
                         for point in (one, other))
        size = np.sqrt(np.mean((first - first.mean(axis=0)) ** 2, axis=0))
        off = np.sqrt(np.mean((second - first) ** 2, axis=0)) / np.maximum(size, 1e-12)
        return dict(zip(_UNREAD.values(), off.tolist(), strict=True))


def _outputs(machine: Machine, point: Point,
             channels: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    assert isinstance(machine, AntennaMachine)
    return machine.outputs(point, 0, channels)
