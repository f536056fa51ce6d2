# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The tests that the drive may run, as the design of the next test asks for them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from antenna_drive.diagnosis.drive_limits import CHANNELS, DriveLimits
from antenna_drive.diagnosis.excitation import SheetCommand
from antenna_drive.diagnosis.field_recording import SAMPLE_RATE
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import planned
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.sheet import (
    Chirp, CircuitBias, dump_sheet, FixedBias, Knots, Multisine, sheet_tree, Square, TestSheet,
    Triangle, Waveform,
)
import numpy as np
from simgap.machine.contract import FloatArray, Machine, Point
from simgap.next_test.space import TestSpace

# Everything stands still for this long at the beginning [s].
_REST_S = 1.0
_LEAST_SHARE, _SLOWEST_HZ, _FASTEST_HZ = 0.01, 0.05, 8.0
# Voltages of a bias source, as shares of the circuit's greatest; rates of a torque test, as shares
# of the greatest; elevations [deg].
_BIAS, _CREEP, _ELEVATIONS = (0.2, 0.9), (0.002, 0.05), (15.0, 75.0)
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


class _Draw:
    """Numbers of a test, drawn at random."""

    def __init__(self, limits: DriveLimits, duration: float, random: np.random.Generator) -> None:
        self.limits, self.duration, self.random = limits, duration, random

    def between(self, low: float, high: float) -> float:
        """Return a number whose logarithm is spread evenly, rounded as people write it."""
        return _rounded(float(np.exp(self.random.uniform(np.log(low), np.log(high)))))

    @property
    def amplitude(self) -> float:
        """Return an amplitude of the rate [deg/s]."""
        return self.between(_LEAST_SHARE * self.limits.rate_deg_s, self.limits.rate_deg_s)

    @property
    def period(self) -> float:
        """Return a period of which the test holds three [s]."""
        return self.between(0.7, self.duration / 3.0)


def _rounded(value: float) -> float:
    """Return a number with four digits, as a sheet is to be read by people."""
    return float(f'{value:.4g}')


def _chirp(draw: _Draw) -> Waveform:
    first = draw.between(_SLOWEST_HZ, 1.0)
    return Chirp(draw.amplitude, first, draw.between(2.0 * first, _FASTEST_HZ),
                 draw.duration - 2.0 * _REST_S, _REST_S)


def _multisine(draw: _Draw) -> Waveform:
    count = int(draw.random.integers(4, 13))
    frequencies = np.geomspace(draw.between(_SLOWEST_HZ, 0.5), draw.between(1.0, _FASTEST_HZ),
                               count)
    tilt = draw.random.uniform(0.0, 1.0)
    weights = (frequencies / frequencies[0]) ** -tilt
    # the greatest value of sines with random phases is about twice their rms
    weights /= np.sqrt(2.0 * np.sum(weights ** 2))
    phases = draw.random.uniform(0.0, 2.0 * np.pi, count)
    return Multisine(draw.amplitude, _numbers(frequencies), _numbers(weights), _numbers(phases),
                     _REST_S)


def _numbers(values: FloatArray) -> tuple[float, ...]:
    return tuple(map(_rounded, values.tolist()))


def _levels(draw: _Draw, times: FloatArray, levels: FloatArray) -> Knots:
    """Return a command that jumps to each level at its time, and ends at zero."""
    times = np.r_[times, draw.duration - _REST_S]
    return Knots(_numbers(np.repeat(times, 2)[1:-1]), _numbers(np.repeat(levels, 2)))


def _random_levels(draw: _Draw, hold: float, shares: Sequence[float]) -> Knots:
    """Return levels that are held for some time each [s]: shares of an amplitude."""
    times = np.arange(_REST_S, draw.duration - _REST_S - 0.5 * hold, hold)[:30]
    greatest, chosen = draw.amplitude, draw.random.choice(shares, times.size)
    # a test that begins with a long rest wastes time
    chosen[0] = chosen[0] or 1.0
    return _levels(draw, times, greatest * chosen)


def _slews(draw: _Draw) -> Waveform:
    """Return trapezoids: to one side and back, with slopes and pauses between."""
    rate, ramp = draw.amplitude, draw.between(0.2, 2.0)
    hold = draw.between(0.5, draw.duration / 6.0)
    times, rates, sign = [_REST_S], [0.0], 1.0
    while (at := times[-1]) + 2.0 * ramp + 2.0 * hold < draw.duration - _REST_S and (
            len(times) < 56):
        times += [at + ramp, at + ramp + hold, at + 2.0 * ramp + hold, at + 2.0 * (ramp + hold)]
        rates += [sign * rate, sign * rate, 0.0, 0.0]
        sign = -sign
    return Knots(_numbers(np.array(times)), _numbers(np.array(rates)))


def _torque(draw: _Draw) -> Waveform:
    """Return a creep to both sides: the torque of the bias source is what moves the drive."""
    rate = draw.limits.rate_deg_s * draw.between(*_CREEP)
    times = np.linspace(_REST_S, draw.duration, 5)[:4]
    return _levels(draw, times, rate * np.array([1.0, 0.0, -1.0, 0.0]))


FAMILIES: Mapping[str, Callable[[_Draw], Waveform]] = {
    'square': lambda draw: Square(draw.amplitude, draw.period, 0.25),
    'triangle': lambda draw: Triangle(draw.amplitude, draw.period, 0.0),
    'chirp': _chirp, 'multisine': _multisine,
    'steps': lambda draw: _random_levels(
        draw, draw.between(1.0, draw.duration / 5.0),
        (-1.0, -0.5, -0.2, -0.05, 0.0, 0.05, 0.2, 0.5, 1.0)),
    'prbs': lambda draw: _random_levels(
        draw, draw.between(draw.duration / 30.0, draw.duration / 10.0), (-1.0, 1.0)),
    'slews': _slews, 'torque': _torque}


class AntennaTests(TestSpace):
    """
    The tests of a `duration` [s] that the drive may run.

    `base` is what a further test shares with those that were made.
    """

    families = tuple(FAMILIES)

    def __init__(self, base: TestSheet, drive: Drive, limits: DriveLimits,
                 duration: float = 30.0) -> None:
        # the waveform is what is looked for; a proposal is a test from rest
        self._base = replace(base, waveform=None, start='rest')
        self._drive, self._limits, self._duration = drive, limits, duration
        self.limits = asdict(limits)

    def draw(self, family: str, random: np.random.Generator) -> TestSheet:
        draw, base = _Draw(self._limits, self._duration, random), self._base
        sheet = replace(base, waveform=FAMILIES[family](draw))
        if random.uniform() < 0.5:
            sheet = replace(sheet, elevation_deg=round(float(random.uniform(*_ELEVATIONS)), 1))
        if family == 'torque':
            # the source steps when the test begins
            return replace(sheet, bias=FixedBias(_rounded(
                self._drive.torque_share.circuit.saturation_high * draw.between(*_BIAS))))
        if isinstance(base.bias, CircuitBias) and base.bias.bias_pot is not None:
            return _with_pot(sheet, float(random.choice([0.4, 0.7, 1.0, 1.2])))
        return sheet

    def machine(self, test: Any) -> AntennaMachine:
        return AntennaMachine({'next': planned(test, self._duration, SAMPLE_RATE)}, self._drive,
                              threads=1)

    def use(self, machine: Machine, points: Sequence[Point]) -> Mapping[str, float]:
        assert isinstance(machine, AntennaMachine)
        shares = [self._limits.use(*machine.outputs(point, 0, CHANNELS), self._drive)
                  for point in points]
        return {name: max(share[name] for share in shares) for name in shares[0]}

    def command(self, test: Any) -> tuple[FloatArray, FloatArray, str]:
        command = SheetCommand(test.waveform)
        time = np.linspace(0.0, self._duration, int(self._duration * _DRAWN_HZ) + 1)
        return time, np.degrees(command(time)), 'deg/s'

    def as_data(self, test: Any) -> dict[str, Any]:
        return sheet_tree(test)

    def files(self, test: Any, path: Path) -> Mapping[Path, str]:
        return {path: dump_sheet(test)}

    def unread(self, machine: Machine, one: Point, other: Point) -> Mapping[str, float]:
        assert isinstance(machine, AntennaMachine)
        first, second = (machine.outputs(point, 0, tuple(_UNREAD))[1][:, :, 0]
                         for point in (one, other))
        size = np.sqrt(np.mean((first - first.mean(axis=0)) ** 2, axis=0))
        off = np.sqrt(np.mean((second - first) ** 2, axis=0)) / np.maximum(size, 1e-12)
        return dict(zip(_UNREAD.values(), off.tolist(), strict=True))


def _with_pot(sheet: TestSheet, scale: float) -> TestSheet:
    """Return a test whose bias pot is set to some times as much."""
    bias = sheet.bias
    assert isinstance(bias, CircuitBias) and bias.bias_pot is not None
    return replace(sheet, bias=replace(bias, bias_pot=_rounded(min(bias.bias_pot * scale, 1.0))))
