# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Waves of an angle: ripples of torque and tachometer, errors of teeth and encoder, rail bumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from antenna_drive.diagnosis.modifiers import (
    AntennaParameter, HARMONICS, ReadingModifier, RunModifier, RunSetup, SensorReadings, WaveShape,
)
from antenna_drive.readings import AT
import numpy as np
from scipy.ndimage import median_filter
from simgap.machine.contract import Experiment, FloatArray, Form

_PARTS = ('sine', 'cosine', 'cycles_change', 'second_sine', 'second_cosine', 'third_sine',
          'third_cosine')
_CYCLES = ' cycles per revolution'
# The waves of the drive that follow a motor's angle: unit, part and name.
_OF_MOTORS = tuple((motor, part, stem) for motor in ('motor_1', 'motor_2') for part, stem in (
    ('motor', 'torque_ripple'), ('gearbox', 'transmission_error'), ('tachometer', 'ripple')))
# Time within which the integral of a tachometer does not drift [s].
_WINDOW_S = 1.5
# Number of orders about one that say what is usual there.
_NEIGHBOURS = 9
# Candidate orders of the axis are this share apart, and a fit may move an order as far.
_APART = 0.15


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
        range_ = ('1', -_APART, _APART, 2e-4) if index == 2 else (unit, -limit, limit, step)
        return AntennaParameter(name, *range_, is_shape=index > 1, modifier=made(shape, index),
                                tolerance=healthy if index < 2 else 0.0)

    return Wave('', tuple(part(*item) for item in enumerate(_PARTS)), is_wave=True,
                shape=shape, orders=orders)


def likely_orders(form: Wave, experiments: Sequence[Experiment],
                  residuals: Sequence[FloatArray], count: int) -> list[float]:
    """
    Return so many orders that stand out most in residuals, shape (n, c) for each test.

    The first stands out most from its neighbours, which a misfit without a period does not do.
    The second holds most of the energy. The others follow in turn.
    """
    orders = np.array(form.orders)
    energy = np.zeros(orders.size)
    peak = np.zeros(orders.size)
    for experiment, residual in zip(experiments, residuals, strict=True):
        scores = _scores(form, experiment, residual, orders)
        usual = median_filter(scores, _NEIGHBOURS, mode='nearest') + 1e-9
        energy += scores
        # a score is a sum of squares, whose scatter is its square root
        peak += np.maximum(scores - usual, 0.0) / np.sqrt(usual * max(1.0, float(usual.mean())))
    found: list[float] = []
    ranks = [list(np.argsort(by)[::-1]) for by in (peak, energy)]
    while len(found) < count and any(ranks):
        rank = ranks[len(found) % 2] or ranks[0]
        order = float(orders[rank.pop(0)])
        near = form.shape.angle == 'axis' and any(abs(np.log(order / f)) < _APART for f in found)
        if order not in found and not near:
            found.append(order)
    return found


def _scores(form: Wave, experiment: Experiment, residual: FloatArray,
            orders: FloatArray) -> FloatArray:
    """Return the power of a residual at each order, shape (m,)."""
    clean = np.nan_to_num(residual / experiment.noise)
    time = experiment.time
    score = np.zeros(orders.size)
    if form.shape.angle == 'axis':
        angle = np.nan_to_num(experiment.measured[:, AT['encoder']])
        if form.shape.stem == 'cyclic_error':
            return _power(clean[:, AT['encoder']], angle, orders)
        rate = np.gradient(angle, time)
        moving = np.abs(rate) > 0.1 * np.abs(rate).max()
        load = clean[:, AT['current_1']] + clean[:, AT['current_2']]
        return _power(load * np.sign(rate) * moving, angle, orders)
    windows = (time / _WINDOW_S).astype(int)
    for path in form.shape.paths:
        m = path.partition('.')[0][-1]
        rate = np.nan_to_num(experiment.measured[:, AT[f'tach_{m}']])
        angle = np.r_[0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))]
        for channel in (AT[f'current_{m}'], AT[f'tach_{m}']):
            for w in range(windows[-1] + 1):
                inside = windows == w
                if np.count_nonzero(inside) >= 10:
                    score += _power(clean[inside, channel], angle[inside], orders)
    return score


def _power(signal: FloatArray, angle: FloatArray, orders: FloatArray) -> FloatArray:
    """Return the power of a signal in waves of an angle, without their means, shape (m,)."""
    wave = np.exp(-1j * np.outer(orders, angle))
    wave -= wave.mean(axis=1, keepdims=True)
    power = np.sum(np.abs(wave) ** 2, axis=1) + 1e-3
    return np.asarray(np.abs(wave @ (signal - signal.mean())) ** 2 / power)
