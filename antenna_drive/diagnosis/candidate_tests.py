# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tests that may be proposed: waveforms of several families, with their amplitudes and periods."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from antenna_drive.diagnosis.drive_limits import DriveLimits
from antenna_drive.recording.sheet import (
    Chirp, CircuitBias, FixedBias, Knots, Multisine, Square, TestSheet, Triangle, Waveform,
)
import numpy as np
from simgap.machine.contract import FloatArray

# Everything stands still for this long at the beginning [s].
_REST_S = 1.0
_LEAST_SHARE, _SLOWEST_HZ, _FASTEST_HZ = 0.01, 0.05, 8.0
# Voltages of a bias source, as shares of the circuit's greatest; rates of a torque test, as shares
# of the greatest; elevations [deg].
_BIAS, _CREEP, _ELEVATIONS = (0.2, 0.9), (0.002, 0.05), (15.0, 75.0)
_ROUNDED = 4
_Make = Callable[['_Draw'], Waveform]


class _Draw:
    """Numbers of a test, drawn at random."""

    def __init__(self, limits: DriveLimits, duration: float, random: np.random.Generator) -> None:
        self.limits, self.duration, self.random = limits, duration, random

    def between(self, low: float, high: float) -> float:
        """Return a number whose logarithm is spread evenly, rounded as people write it."""
        return rounded(float(np.exp(self.random.uniform(np.log(low), np.log(high)))))

    @property
    def amplitude(self) -> float:
        """Return an amplitude of the rate [deg/s]."""
        return self.between(_LEAST_SHARE * self.limits.rate_deg_s, self.limits.rate_deg_s)

    @property
    def period(self) -> float:
        """Return a period of which the test holds three [s]."""
        return self.between(0.7, self.duration / 3.0)


def rounded(value: float) -> float:
    """Return a number with four digits, as a sheet is to be read by people."""
    return float(f'{value:.{_ROUNDED}g}')


def _square(draw: _Draw) -> Waveform:
    return Square(draw.amplitude, draw.period, 0.25)


def _triangle(draw: _Draw) -> Waveform:
    return Triangle(draw.amplitude, draw.period, 0.0)


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
    return tuple(map(rounded, values.tolist()))


def _levels(draw: _Draw, times: FloatArray, levels: FloatArray) -> Knots:
    """Return a command that jumps to each level at its time, and ends at zero."""
    times = np.r_[times, draw.duration - _REST_S]
    return Knots(_numbers(np.repeat(times, 2)[1:-1]), _numbers(np.repeat(levels, 2)))


def _steps(draw: _Draw) -> Waveform:
    hold = draw.between(1.0, draw.duration / 5.0)
    times = np.arange(_REST_S, draw.duration - _REST_S - 0.5 * hold, hold)[:30]
    greatest = draw.amplitude
    shares = draw.random.choice([-1.0, -0.5, -0.2, -0.05, 0.0, 0.05, 0.2, 0.5, 1.0], times.size)
    # a test that begins with a long rest wastes time
    shares[0] = shares[0] or 1.0
    return _levels(draw, times, greatest * shares)


def _prbs(draw: _Draw) -> Waveform:
    bit = draw.between(draw.duration / 30.0, draw.duration / 10.0)
    times = np.arange(_REST_S, draw.duration - _REST_S - 0.5 * bit, bit)[:30]
    return _levels(draw, times, draw.amplitude * draw.random.choice([-1.0, 1.0], times.size))


def _slews(draw: _Draw) -> Waveform:
    """Return trapezoids: to one side and back, with slopes and pauses between."""
    rate, ramp = draw.amplitude, draw.between(0.2, 2.0)
    hold = draw.between(0.5, draw.duration / 6.0)
    times, rates, at, sign = [_REST_S], [0.0], _REST_S, 1.0
    while at + 2.0 * ramp + 2.0 * hold < draw.duration - _REST_S and len(times) < 56:
        times += [at + ramp, at + ramp + hold, at + 2.0 * ramp + hold]
        rates += [sign * rate, sign * rate, 0.0]
        at += 2.0 * (ramp + hold)
        times.append(at)
        rates.append(0.0)
        sign = -sign
    return Knots(_numbers(np.array(times)), _numbers(np.array(rates)))


def _torque(draw: _Draw) -> Waveform:
    """Return a creep to both sides: the torque of the bias source is what moves the drive."""
    rate = draw.limits.rate_deg_s * draw.between(*_CREEP)
    times = np.linspace(_REST_S, draw.duration, 5)[:4]
    return _levels(draw, times, rate * np.array([1.0, 0.0, -1.0, 0.0]))


FAMILIES: Mapping[str, _Make] = {
    'square': _square, 'triangle': _triangle, 'chirp': _chirp, 'multisine': _multisine,
    'steps': _steps, 'prbs': _prbs, 'slews': _slews, 'torque': _torque}


def drawn(family: str, base: TestSheet, limits: DriveLimits, full_bias: float, duration: float,
          random: np.random.Generator) -> TestSheet:
    """
    Draw a test of a family.

    family : one of `FAMILIES`
    base : what a further test shares with those that were made
    limits : of the drive
    full_bias : greatest bias voltage that the torque-share circuit gives [V]
    duration : of the test [s]
    random : source of randomness
    """
    draw = _Draw(limits, duration, random)
    sheet = replace(base, waveform=FAMILIES[family](draw))
    if random.uniform() < 0.5:
        sheet = replace(sheet, elevation_deg=round(float(random.uniform(*_ELEVATIONS)), 1))
    if family == 'torque':
        # the source steps when the test begins
        return replace(sheet, bias=FixedBias(rounded(full_bias * draw.between(*_BIAS))))
    if isinstance(base.bias, CircuitBias) and base.bias.bias_pot is not None:
        pot = base.bias.bias_pot * float(random.choice([0.4, 0.7, 1.0, 1.2]))
        sheet = replace(sheet, bias=replace(base.bias, bias_pot=rounded(min(pot, 1.0))))
    return sheet


def nearby(sheet: TestSheet, random: np.random.Generator) -> TestSheet:
    """Return a test like another one: its amplitude, its times or its bias a little different."""
    waveform, scale = sheet.waveform, float(np.exp(random.normal(0.0, 0.25)))
    which = random.integers(3)
    if which == 0 and isinstance(sheet.bias, CircuitBias) and sheet.bias.bias_pot:
        return replace(sheet, bias=replace(
            sheet.bias, bias_pot=rounded(min(sheet.bias.bias_pot * scale, 1.0))))
    if isinstance(waveform, Knots):
        assert waveform.times_s is not None and waveform.rates_deg_s is not None
        return replace(sheet, waveform=replace(waveform, rates_deg_s=tuple(
            rounded(scale * rate) for rate in waveform.rates_deg_s)))
    assert waveform is not None and waveform.amplitude_deg_s is not None
    if which == 1 and isinstance(waveform, (Square, Triangle)) and waveform.period_s:
        return replace(sheet, waveform=replace(
            waveform, period_s=rounded(scale * waveform.period_s)))
    return replace(sheet, waveform=replace(
        waveform, amplitude_deg_s=rounded(scale * waveform.amplitude_deg_s)))
