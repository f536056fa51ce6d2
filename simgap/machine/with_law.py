# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A law: an input that is a function of something that the machine does, as one effect more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
import math

import numpy as np
from simgap.machine.arrays import Course, FloatArray, Point
from simgap.machine.effect import Effect, Form, Parameter
from simgap.machine.machine import DisturbanceInput, Machine, Wrapped

# No value of a law is farther off than so many times what it was thought to be.
FARTHEST = 30.0


@dataclass(frozen=True)
class Quantity:
    """Something that a machine does: its unit, and its values in each test."""

    unit: str
    values: list[FloatArray]
    period: float = 0.0  # after which all begins anew; 0 for never


Quantities = Mapping[str, Quantity]


@dataclass(frozen=True)
class Law:
    """An input as a function of one quantity, the same in all tests."""

    by: str  # the quantity
    times: str  # what it is in proportion to; empty for nothing
    evidence: float  # natural logarithm of how much likelier it makes the gap
    at: tuple[float, ...]  # values of the quantity
    values: tuple[float, ...]  # of the input there, over the factor
    deviations: tuple[float, ...]  # standard deviations of these values
    by_unit: str  # of the quantity
    unit: str  # of the values
    width: float  # of the hats that the function is made of, in by_unit
    spread: float  # standard deviation that the values were thought to have
    # share of what is left of each test that it takes, fitted to the others; None for one test
    withheld: float | None = None
    orders: tuple[int, ...] = ()  # the waves of a turn that it is a sum of; empty for any function
    walks: bool = False  # whether its numbers are steps from place to place, see `walk`

    def __str__(self) -> str:
        return self.by + (f', in proportion to {self.times}' if self.times else '')

    @property
    def shapes(self) -> FloatArray:
        """Return what its m numbers do at its k places, shape (k, m): hats, steps, or waves."""
        if not self.orders:
            return walk(len(self.at)) if self.walks else np.eye(len(self.at))
        turn = np.outer(np.array(self.at) * 2.0 * math.pi / self.at[-1], self.orders)
        return np.hstack([np.cos(turn), np.sin(turn)])

    def waves(self) -> list[tuple[int, float]]:
        """Return its orders with their amplitudes, the greatest first; empty for any function."""
        sizes = np.hypot(*np.split(self._numbers(), 2)).tolist() if self.orders else []
        return sorted(zip(self.orders, sizes, strict=True), key=lambda wave: -wave[1])

    def _numbers(self) -> FloatArray:
        values = np.array(self.values)
        return np.linalg.lstsq(self.shapes, values, rcond=None)[0] if self.orders else values

    def as_effect(self, place: DisturbanceInput) -> Effect:
        """Return the effect that it is at a place, whose sizes are its values."""
        return Effect(f'{place.component}.law', place.component,
                      f'{place.name} as a function of {self}',
                      (self.as_form(f'{place.component}.law.'),))

    def as_form(self, prefix: str = '') -> Form:
        """Return its numbers as the sizes of a form."""
        most = FARTHEST * max(self.spread, *map(abs, self.values))
        names = [f'{wave} {order}' for wave in ('cos', 'sin') for order in self.orders] or [
            f'at {at:.6g}' for at in self.at]
        return Form(str(self), tuple(Parameter(
            f'{prefix}{name}', self.unit, -most, most, 0.1 * self.spread, self.spread,
            start=start) for name, start in zip(names, self._numbers().tolist(), strict=True)),
            scanned=True)

    def in_units(self, size: float, unit: str) -> Law:
        """Return the law of an input, one of which is of a size in a unit."""
        per = f'{unit}/({self.unit})' if self.unit else unit
        return replace(self, values=tuple(size * value for value in self.values), unit=per,
                       deviations=tuple(size * value for value in self.deviations),
                       spread=size * self.spread)

    def weights(self, quantities: Quantities) -> list[FloatArray]:
        """Return what one unit of each of m numbers adds over time in each test, (n, m)."""
        at = np.array(self.at)
        factors = quantities[self.times].values if self.times else [
            np.ones_like(values) for values in quantities[self.by].values]
        hats = [factor[:, np.newaxis] * np.maximum(0.0, 1.0 - np.abs(np.clip(
            values, at.min(), at.max())[:, np.newaxis] - at) / self.width)
            for factor, values in zip(factors, quantities[self.by].values, strict=True)]
        return [own @ self.shapes for own in hats] if self.orders else hats


def walk(places: int) -> FloatArray:
    """Return what a level in the middle and steps outwards do at each place, shape (n, n)."""
    # so that a place which no data tell of is as the nearest one of which they do
    middle, index = places // 2, np.arange(places)
    at, step = index[:, np.newaxis], index
    return np.where(step >= middle, at >= step, at <= step) * 1.0 + (
        (step == middle) & (at < middle))


class WithLaw(Wrapped):
    """
    A machine and a law of an input.

    law : an effect of one form, whose m sizes are the values of the function
    place : where it enters, an input of the machine or one of its readings
    weights : what one unit of each size adds there over time in each test, shape (n, m), in units
        of a course
    """

    def __init__(self, inner: Machine, law: Effect, place: DisturbanceInput,
                 weights: Sequence[FloatArray]) -> None:
        catalogue = copy(inner.catalogue)
        catalogue[law.id] = law
        super().__init__(inner, inner.experiments, inner.nuisances, catalogue)
        self._law, self._place = law, place
        self._weights = [own[:e.time.size] for own, e in zip(
            weights, inner.experiments, strict=True)]
        self._names = [p.name for p in law.forms[0].parameters]
        # the input itself, where it enters a reading
        self._reading = None if place in inner.disturbance_inputs else (
            inner.experiments[0].channels.index(place.component))

    @property
    def reached(self) -> FloatArray:
        """Return how much each size acts at most, shape (m,)."""
        return np.asarray(np.max([np.abs(own).max(axis=0) for own in self._weights], axis=0))

    def around(self, inner: Machine) -> Machine:
        return self if inner is self.inner else WithLaw(
            inner, self._law, self._place, self._weights)

    def _parted(self, point: Point) -> tuple[dict[str, float], FloatArray]:
        """Return a point in the inner machine's names, and the sizes of the law, shape (m,)."""
        return ({name: value for name, value in point.items() if name not in self._names},
                np.array([point.get(name, 0.0) for name in self._names]))

    def _course(self, experiment: int, sizes: FloatArray) -> Course:
        values = self._weights[experiment] @ sizes
        return lambda time: np.interp(time, self.experiments[experiment].time, values)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        wanted = only or [None] * len(points)
        parted = [self._parted(point) for point in points]
        bare = [i for i, (_, sizes) in enumerate(parted)
                if self._reading is not None or not sizes.any()]
        found: list[list[FloatArray | None]] = [[] for _ in points]
        for i, row in zip(bare, self.inner.simulate(
                [parted[i][0] for i in bare], [wanted[i] for i in bare], until), strict=True):
            found[i] = [own if own is None or not parted[i][1].any() else self._added(
                own, k, parted[i][1]) for k, own in enumerate(row)]
        for i, (inner, sizes) in enumerate(parted):
            if not found[i]:
                rows = self.inner.simulate_disturbed(inner, self._place, [
                    self._course(k, sizes) for k in range(len(self.experiments))])
                found[i] = [self._until(own, k, until) if wanted[i] in (None, k) else None
                            for k, own in enumerate(rows)]
        return found

    def _added(self, readings: FloatArray, experiment: int, sizes: FloatArray) -> FloatArray:
        """Return readings with the law in one of them."""
        found = readings.copy()
        found[:, self._reading] += self._place.size * (self._weights[experiment] @ sizes)
        return found

    def _until(self, readings: FloatArray, experiment: int, until: float) -> FloatArray:
        time = self.experiments[experiment].time
        return np.where((time - time[0] > until)[:, np.newaxis], np.nan, readings)

    def linear_response(self, name: str, experiment: int) -> FloatArray | None:
        if name not in self._names or self._reading is None:
            return self.inner.linear_response(name, experiment)
        found = np.zeros(self.experiments[experiment].measured.shape)
        found[:, self._reading] = (
            self._place.size * self._weights[experiment][:, self._names.index(name)])
        return found

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        return self.inner.simulate_disturbed(self._parted(point)[0], place, courses)

    def with_noise_at(self, point: Point) -> Machine:
        return self.around(self.inner.with_noise_at(self._parted(point)[0]))

    def linearised_at(self, point: Point) -> Machine:
        return self.around(self.inner.linearised_at(self._parted(point)[0]))
