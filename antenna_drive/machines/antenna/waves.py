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
"""Waves of an angle: ripples of torque and tachometer, errors of teeth and encoder, rail bumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

from antenna_drive.diagnosis import FloatArray, Form
from antenna_drive.machines.antenna.modifiers import (
    AntennaParameter, ReadingModifier, RunModifier, RunSetup, SensorReadings, SET,
)
import numpy as np


@dataclass(frozen=True)
class WaveShape:
    """
    Where a wave is and which angle it follows.

    Attributes
    ----------
    stem : what the names of the amplitude, cycles and phases in the record begin with
    paths : where these fields are
    angle : 'motor_1', 'motor_2' or 'axis'
    order : cycles per revolution; 0 if not chosen yet

    """

    stem: str
    paths: tuple[str, ...]
    angle: str
    order: float = 0.0

    def set_fields(self, run: RunSetup, parts: Sequence[float]) -> None:
        """
        Write the wave into the record.

        Parameters
        ----------
        run
            whose record is changed
        parts
            sine and cosine, relative change of the order, sine and cosine of the second and of
            the third harmonic

        """
        for path in self.paths:
            for end, value in self.fields(parts).items():
                run.change(f'{path}.{self.stem}{end}', SET, value)

    def fields(self, parts: Sequence[float]) -> dict[str, float]:
        """Return the wave as the record has it: amplitudes and phases, by the names' ends."""
        sine, cosine, change, second_sine, second_cosine, third_sine, third_cosine = parts
        return {'': math.hypot(sine, cosine), '_phase': math.atan2(cosine, sine),
                '_cycles': self.order * (1.0 + change),
                '_second': math.hypot(second_sine, second_cosine),
                '_second_phase': math.atan2(second_cosine, second_sine),
                '_third': math.hypot(third_sine, third_cosine),
                '_third_phase': math.atan2(third_cosine, third_sine)}

    def along(self, angle: FloatArray, parts: Sequence[float]) -> FloatArray:
        """Return the wave at angles of shape (n,); `parts` as in `set_fields`."""
        sine, cosine, change, *higher = parts
        total = np.zeros_like(angle)
        amplitudes = (sine, cosine, *higher)
        for k, (a, b) in enumerate(zip(amplitudes[::2], amplitudes[1::2], strict=True), start=1):
            turned = k * self.order * (1.0 + change) * angle
            total += a * np.sin(turned) + b * np.cos(turned)
        return total


_PARTS = ('sine', 'cosine', 'cycles_change', 'second_sine', 'second_cosine', 'third_sine',
          'third_cosine')


@dataclass(frozen=True)
class _WavePart(RunModifier):
    """One part of a wave of the drive."""

    shape: WaveShape
    index: int

    def apply(self, run: RunSetup, value: float) -> None:
        run.waves.setdefault(self.shape, [0.0] * len(_PARTS))[self.index] = value


@dataclass(frozen=True)
class _ReadingWavePart(ReadingModifier):
    """One part of a wave of the encoder's reading."""

    shape: WaveShape
    index: int

    def apply_to_readings(self, readings: SensorReadings, value: float) -> None:
        readings.waves.setdefault(self.shape, [0.0] * len(_PARTS))[self.index] = value


@dataclass(frozen=True)
class Wave(Form):
    """
    A wave of three harmonics by their sine and cosine parts.

    Attributes
    ----------
    shape : where it is
    orders : cycles per revolution to look for

    """

    shape: WaveShape = WaveShape('', (), '')
    orders: tuple[float, ...] = ()

    def at(self, order: float) -> Wave:
        """Return the form for one order, with parameters of its own."""
        shape = replace(self.shape, order=order)
        parameters = []
        for part in self.parameters:
            assert isinstance(part, AntennaParameter)
            assert isinstance(part.modifier, (_WavePart, _ReadingWavePart))
            parameters.append(replace(part, name=f'{part.name}@{order:g}',
                                      modifier=replace(part.modifier, shape=shape)))
        return replace(self, name=f'{order:g} cycles per revolution',
                       parameters=tuple(parameters), shape=shape, scanned=True)


def wave(unit: str, limit: float, step: float, shape: WaveShape, orders: tuple[float, ...],
         on_readings: bool = False) -> Wave:
    """
    Return the form of a wave whose order is not chosen yet.

    Parameters
    ----------
    unit, limit, step
        of each amplitude: unit, greatest size, step of the difference quotient
    shape
        where it is
    orders
        cycles per revolution to look for
    on_readings
        True if nothing feeds the wave back

    """
    made = _ReadingWavePart if on_readings else _WavePart

    def part(index: int) -> AntennaParameter:
        name = _PARTS[index]
        bound, unit_, step_ = ((0.05, '1', 2e-4) if name == 'cycles_change' else
                               (limit, unit, step))
        return AntennaParameter(name, unit_, -bound, bound, step_,
                                on_readings=on_readings, is_shape=index > 1,
                                modifier=made(shape, index))

    return Wave('', tuple(part(index) for index in range(len(_PARTS))), shape=shape,
                orders=orders)
