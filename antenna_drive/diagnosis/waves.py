# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Waves of an angle: ripples of torque and tachometer, errors of teeth and encoder, rail bumps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from antenna_drive.diagnosis.modifiers import (
    AntennaParameter, HARMONICS, ReadingModifier, RunModifier, RunSetup, SensorReadings, WaveShape,
)
import numpy as np
from simgap.machine.contract import Form

_PARTS = ('sine', 'cosine', 'cycles_change', 'second_sine', 'second_cosine', 'third_sine',
          'third_cosine')
_CYCLES = ' cycles per revolution'
# The waves of the drive that follow a motor's angle: unit, part and name.
_OF_MOTORS = tuple((motor, part, stem) for motor in ('motor_1', 'motor_2') for part, stem in (
    ('motor', 'torque_ripple'), ('gearbox', 'transmission_error'), ('tachometer', 'ripple')))


def is_there(numbers: np.ndarray[Any, np.dtype[Any]], stem: str) -> bool:
    """Return whether the record of a part, shape (1,), has a wave whose names begin so."""
    return any(numbers[stem + end][0] != 0.0 for end in HARMONICS)


def fastest_wave(record: np.ndarray[Any, np.dtype[Any]]) -> float:
    """Return the cycles per turn of the axis of the fastest wave in a drive's record; 0: none."""
    return max((float(record[motor][part][f'{stem}_cycles'][0])
                * float(record[motor]['gear_ratio'][0]) for motor, part, stem in _OF_MOTORS
                if is_there(record[motor][part], stem)), default=0.0)


@dataclass(frozen=True)
class _Part:
    """One part of a wave."""

    shape: WaveShape
    index: int

    def put(self, into: RunSetup | SensorReadings, value: float) -> None:
        into.waves.setdefault(self.shape, [0.0] * len(_PARTS))[self.index] = value


class _WavePart(_Part, RunModifier):
    """Of the drive."""

    def apply(self, run: RunSetup, value: float) -> None:
        self.put(run, value)


class _ReadingWavePart(_Part, ReadingModifier):
    """Of the encoder's reading."""

    def apply_to_readings(self, readings: SensorReadings, value: float) -> None:
        self.put(readings, value)

    def write(self, run: RunSetup, value: float) -> bool:
        self.put(run, value)
        return True


@dataclass(frozen=True)
class Wave(Form):
    """A wave of three harmonics by their sine and cosine parts."""

    shape: WaveShape = WaveShape('', (), '')
    orders: tuple[float, ...] = ()  # cycles per revolution to look for

    def order_of(self, name: str) -> float:
        """Return the order in the name of a form that `at` has made; KeyError if there is none."""
        try:
            return float(name.removesuffix(_CYCLES))
        except ValueError:
            raise KeyError(name) from None

    def at(self, order: float) -> Wave:
        """Return the form for one order, with parameters of its own."""
        shape = replace(self.shape, order=order)

        def of_order(part: Any) -> AntennaParameter:
            return replace(part, name=f'{part.name}@{order:g}',
                           modifier=replace(part.modifier, shape=shape))

        return replace(self, name=f'{order:g}{_CYCLES}', shape=shape, scanned=True,
                       parameters=tuple(map(of_order, self.parameters)))


def wave(unit: str, limit: float, step: float, shape: WaveShape, orders: tuple[float, ...],
         on_readings: bool = False, healthy: float = 0.0) -> Wave:
    """
    Return the form of a wave whose order is not chosen yet, see `Wave`.

    unit, limit, step : of each amplitude: unit, greatest size, step of the difference quotient
    on_readings : True if nothing feeds the wave back
    healthy : amplitude of each part that a machine in good order may have
    """
    made = _ReadingWavePart if on_readings else _WavePart

    def part(index: int, name: str) -> AntennaParameter:
        range_ = ('1', -0.05, 0.05, 2e-4) if index == 2 else (unit, -limit, limit, step)
        return AntennaParameter(name, *range_, is_shape=index > 1, modifier=made(shape, index),
                                tolerance=healthy if index < 2 else 0.0)

    return Wave('', tuple(part(*item) for item in enumerate(_PARTS)), is_wave=True,
                shape=shape, orders=orders)
