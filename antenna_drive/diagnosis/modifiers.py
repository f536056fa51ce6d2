# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a parameter does: it modifies the run before it is simulated, or the readings after it.

Each entry of the catalogue, and each tolerance, declares its modifier where it stands.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
import math
from typing import Any

from antenna_drive.diagnosis.excitation import Bias
from antenna_drive.parameters.records import place_of
from antenna_drive.readings import AT, READINGS
import numpy as np
from simgap.machine.contract import FloatArray, Parameter

SCALE, ADD, SET = 'scale', 'add', 'set'
# Ends of the names of a wave's amplitudes in the record.
HARMONICS = ('', '_second', '_third')


@dataclass(frozen=True)
class WaveShape:
    """Where a wave is and which angle it follows."""

    stem: str  # what names of the amplitude, cycles and phases in the record begin with
    paths: tuple[str, ...]  # where these fields are
    angle: str  # 'motor_1', 'motor_2' or 'axis'
    order: float = 0.0  # cycles per revolution; 0 if not chosen yet

    def fields(self, parts: Sequence[float], turned: float = 0.0) -> dict[str, float]:
        """
        Return the wave as the record has it: amplitudes and phases, by the ends of their names.

        parts : sine and cosine, relative change of the order, sine and cosine of the second and of
            the third harmonic
        turned : angle from which the angle of the record counts [rad]
        """
        cycles = self.order * (1.0 + parts[2])
        phase = math.remainder(cycles * turned, math.tau)
        found = {'_cycles': cycles}
        for k, sine, cosine in _harmonics(parts):
            end = HARMONICS[k - 1]
            found[end] = math.hypot(sine, cosine)
            found[f'{end}_phase'] = math.atan2(cosine, sine) + k * phase
        return found

    def along(self, angle: FloatArray, parts: Sequence[float]) -> FloatArray:
        """Return the wave at angles of shape (n,); `parts` as in `fields`."""
        total = np.zeros_like(angle)
        for k, sine, cosine in _harmonics(parts):
            turned = k * self.order * (1.0 + parts[2]) * angle
            total += sine * np.sin(turned) + cosine * np.cos(turned)
        return total


def _harmonics(parts: Sequence[float]) -> Iterator[tuple[int, float, float]]:
    """Yield number, sine and cosine part of each harmonic."""
    sizes = (*parts[:2], *parts[3:])
    return zip(range(1, len(HARMONICS) + 1), sizes[::2], sizes[1::2], strict=True)


@dataclass
class RunSetup:
    """A run as parameters modify it."""

    numbers: FloatArray  # the drive's record as plain ones: numpy copies a record by field
    kind: np.dtype[Any]  # of the record
    bias: Bias  # source of the bias voltage, where the share circuit is not connected
    # by what and number: how much later a 'jump' of the command comes [s], how much higher its
    # 'mean' is in a hole [rad/s]
    unrecorded: dict[tuple[str, int], float] = field(default_factory=dict)
    waves: dict[WaveShape, list[float]] = field(default_factory=dict)  # parts of each
    start_angle: float = 0.0  # of the axis at the beginning [rad]; waves go on from there

    def change(self, path: str, how: str, value: float) -> None:
        """Scale a number of the record by 1 + value, add the value to it, or set it."""
        place = place_of(self.kind, path)
        if how == SCALE:
            self.numbers[place] *= 1.0 + value
        elif how == ADD:
            self.numbers[place] += value
        else:
            self.numbers[place] = value

    @property
    def delay(self) -> float:
        """Return the delay of the rate command [s]."""
        return float(self.numbers[place_of(self.kind, 'test_signal.delay')])

    def write_waves(self) -> None:
        """Write the waves into the record."""
        for shape, parts in self.waves.items():
            turned = self.start_angle
            if shape.angle != 'axis':
                turned *= float(self.numbers[place_of(self.kind, f'{shape.angle}.gear_ratio')])
            for path in shape.paths:
                for end, value in shape.fields(parts, turned).items():
                    self.change(f'{path}.{shape.stem}{end}', SET, value)


@dataclass
class SensorReadings:
    """What parameters do to the readings of a run."""

    # of every reading, shape (c,); the delay is by how much earlier it is read than its time
    # stamps say [s], the lag the time constant of a filter before [s]
    gain: FloatArray = field(default_factory=lambda: np.ones(len(READINGS)))
    zero: FloatArray = field(default_factory=lambda: np.zeros(len(READINGS)))
    delay: FloatArray = field(default_factory=lambda: np.zeros(len(READINGS)))
    lag: FloatArray = field(default_factory=lambda: np.zeros(len(READINGS)))
    clock: float = 0.0  # by how much later all readings are taken [s]
    clock_rate: float = 0.0  # share by which the recorder's clock is slow
    digit: float = 0.0  # of the encoder [rad]; 0 for none
    turn: float = 0.0  # share of a digit by which the encoder's rounding is off its middle
    waves: dict[WaveShape, list[float]] = field(default_factory=dict)  # parts of each, encoder's

    @property
    def late(self) -> FloatArray:
        """Return by how much earlier each reading is taken in all [s], shape (c,)."""
        return self.delay - self.clock


class Modifier(ABC):
    """What a parameter does."""

    fields: tuple[str, ...] = ()  # the numbers of the drive's configuration that it stands for
    how: str = ADD  # how it changes them


class RunModifier(Modifier):
    """Modifies a run before it is simulated."""

    @abstractmethod
    def apply(self, run: RunSetup, value: float) -> None:
        """Modify the run."""


class ReadingModifier(Modifier):
    """Modifies readings after a run."""

    @abstractmethod
    def apply_to_readings(self, readings: SensorReadings, value: float) -> None:
        """Modify the readings."""

    def write(self, run: RunSetup, value: float) -> bool:
        """Write the error into the drive's record; return False if it has no number for it."""
        for path in self.fields:
            run.change(path, self.how, value)
        return bool(self.fields)


@dataclass(frozen=True)
class FieldChange(RunModifier):
    """Changes numbers of the drive's record."""

    how: str
    fields: tuple[str, ...]

    def apply(self, run: RunSetup, value: float) -> None:
        for path in self.fields:
            run.change(path, self.how, value)


@dataclass(frozen=True)
class Tabled(RunModifier):
    """Adds to values of a learnt function, which reaches so far about its middle."""

    places: tuple[int, ...]  # of the values
    middle: float | None  # of an angle, which counts from where the run begins
    reach: float
    fields: tuple[str, ...]  # the functions

    def apply(self, run: RunSetup, value: float) -> None:
        for path in self.fields:
            for place in self.places:
                run.change(f'{path}.{place}', ADD, value)
            run.change(f'{path}_reach', SET, max(self.reach, 1e-9))  # 0: it stands still
            run.change(f'{path.rpartition(".")[0]}.learnt', SET, 1.0)
            if self.middle is not None:
                run.change(f'{path}_middle', SET, self.middle - run.start_angle)


@dataclass(frozen=True)
class SupplyGain(RunModifier):
    """Scales the voltages of the source of bias."""

    def apply(self, run: RunSetup, value: float) -> None:
        run.bias = replace(run.bias, before=run.bias.before * (1.0 + value),
                           after=run.bias.after * (1.0 + value))


@dataclass(frozen=True)
class RecorderError(ReadingModifier):
    """Adds to gain, zero, delay or lag of a reading, or to the recorder's clock or clock_rate."""

    kind: str
    reading: str = ''
    fields: tuple[str, ...] = ()

    def apply_to_readings(self, readings: SensorReadings, value: float) -> None:
        if self.reading:
            getattr(readings, self.kind)[AT[self.reading]] += value
        else:
            setattr(readings, self.kind, getattr(readings, self.kind) + value)


@dataclass(frozen=True)
class Unrecorded(RunModifier):
    """What no sample of a recorded command shows, such as when it jumped between two."""

    what: str  # see `RunSetup.unrecorded`
    number: int

    def apply(self, run: RunSetup, value: float) -> None:
        run.unrecorded[self.what, self.number] = value


@dataclass(frozen=True)
class Rounding(ReadingModifier):
    """Sets the `digit` of the encoder, or the `turn` by which its rounding is off."""

    what: str
    fields: tuple[str, ...] = ()
    how = SET

    def apply_to_readings(self, readings: SensorReadings, value: float) -> None:
        setattr(readings, self.what, value)


@dataclass(frozen=True)
class AntennaParameter(Parameter):
    """A parameter of the antenna, with what it does."""

    modifier: Modifier = Modifier()


def add(*fields: str) -> FieldChange:
    """Return the modifier that adds to numbers of the record."""
    return FieldChange(ADD, fields)


def scale(*fields: str) -> FieldChange:
    """Return the modifier that scales numbers of the record by 1 + value."""
    return FieldChange(SCALE, fields)


def set_to(*fields: str) -> FieldChange:
    """Return the modifier that sets numbers of the record."""
    return FieldChange(SET, fields)


class KnownModifiers:
    """What parameters do, by their names: a point is plain numbers."""

    def __init__(self) -> None:
        # each with the index of the one test that it acts on, or None
        self.of_runs: dict[str, tuple[RunModifier, int | None]] = {}
        self.of_readings: dict[str, tuple[ReadingModifier, int | None]] = {}

    def register(self, parameters: Iterable[Parameter]) -> None:
        """Take further parameters."""
        for item in parameters:
            assert isinstance(item, AntennaParameter)
            if isinstance(item.modifier, RunModifier):
                self.of_runs[item.name] = item.modifier, item.experiment
            elif isinstance(item.modifier, ReadingModifier):
                self.of_readings[item.name] = item.modifier, item.experiment

    def of(self, name: str) -> Modifier:
        """Return what a parameter does."""
        return (self.of_runs.get(name) or self.of_readings[name])[0]
