# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A machine with a little of each effect, as every machine has it.

No size is exactly zero. Up to the tolerance of its catalogue an effect is no fault, but it shows,
and what shows and has no name would be taken for another effect. So each has a nuisance of its own
within the tolerance, whose prior is its everyday size. What so little does is linear in the size:
its derivative is taken once, at the model as configured and again at the best answer, and such a
nuisance costs no run. Inputs that are there every day, such as wind, are noise of the process.
"""

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from simgap.machine.arrays import Course, FloatArray, Point
from simgap.machine.catalogue import Catalogue
from simgap.machine.effect import Effect, Form, Parameter
from simgap.machine.experiment import Experiment
from simgap.machine.machine import DisturbanceInput, Machine, Wrapped
from simgap.machine.process import acting, calm, process
from simgap.machine.responses import ProcessResponses

# The standard deviation of an everyday size, as a share of the tolerance.
EVERYDAY = 0.5
_PREFIX = 'everyday:'


def with_everyday(machine: Machine) -> Machine:
    """Return a machine with everyday sizes; itself if no effect has one that is not a nuisance."""
    neutral = machine.simulate([{}])[0]
    residuals = [e.measured - predicted for e, predicted in zip(
        machine.experiments, neutral, strict=True) if predicted is not None]
    sizes: dict[str, _Size] = {}
    # what acts in several places acts in each of them
    for effect in (item for item in machine.catalogue.values() if not item.parts):
        for form in machine.catalogue.forms(effect, machine.experiments, residuals):
            for p in _sizes(machine, form):
                # of forms that are alike near zero the first one stands for all
                sizes.setdefault(p.name, _Size(p, form, effect))
    found = tuple(sizes.values())
    if not found and not any(place.everyday for place in machine.disturbance_inputs):
        return machine
    return _Everyday(machine, found, _responses(machine, found, {}), process(machine, {}))


@dataclass(frozen=True)
class _Size:
    """A size of an effect that everyday machines have."""

    parameter: Parameter
    form: Form
    effect: Effect

    def besides(self, point: Point, catalogue: Catalogue) -> Point:
        """Return a point without the effect's other forms, which exclude this one."""
        own = self.form.start
        others = tuple(f'{effect.id}.' for effect in catalogue.values()
                       if self.effect.id in (effect.id, *effect.parts))
        return {name: value for name, value in point.items()
                if name in own or not name.startswith(others)}


def _responses(machine: Machine, sizes: Sequence[_Size],
               point: Point) -> list[NDArray[np.floating[Any]]]:
    """Return the derivatives by sizes, with the shapes of their forms, at a point."""
    bases = [size.besides(point, machine.catalogue) for size in sizes]
    unlike = {frozenset(base): base for base in bases}
    steps, stepped = [], []
    for size, base in zip(sizes, bases, strict=True):
        p, at = size.parameter, base.get(size.parameter.name, 0.0)
        steps.append(p.step if at + p.step <= p.high else -p.step)
        stepped.append({**size.form.start, **base, p.name: at + steps[-1]})
    rows: Any = machine.low_fidelity().simulate([*unlike.values(), *stepped])
    before = dict(zip(unlike, rows, strict=False))
    return [np.reshape([
        np.nan_to_num((row[k] - before[frozenset(base)][k]) / step)
        for step, base, row in zip(steps, bases, rows[len(unlike):], strict=True)],
        (len(sizes), e.measured.size)).T for k, e in enumerate(machine.experiments)]


def everyday_of(name: str) -> str:
    """Return the size, by the name of its nuisance; empty for another nuisance."""
    return name.removeprefix(_PREFIX) if name.startswith(_PREFIX) else ''


def taken_over(catalogue: Catalogue, effect: str, form: Form, point: Point) -> dict[str, float]:
    """Return a point in which the sizes of an effect begin at what its everyday sizes had."""
    # the two do the same, and a fit does not find from one to the other
    found = dict(point)
    for p, names in alike(catalogue, effect, form):
        had = [found.get(name, 0.0) for name in names]
        if any(had) and not p.is_shape:
            found.update(dict.fromkeys(names, 0.0))
            found[p.name] = min(max(sum(had) / len(had), p.low), p.high)
    return found


def alike(catalogue: Catalogue, effect: str, form: Form) -> Iterator[tuple[Parameter, list[str]]]:
    """Yield the numbers of an effect, each with the names of everyday sizes that do the same."""
    whole = catalogue[effect]
    forms = [catalogue.counterpart(form, whole, catalogue[part]) for part in whole.parts] or [form]
    for p, *own in zip(form.parameters, *(own.parameters for own in forms), strict=True):
        yield p, [_PREFIX + item.name for item in own]


def as_configured(machine: Machine) -> Machine:
    """Return the machine without everyday sizes."""
    return machine.inner if isinstance(machine, _Everyday) else machine


def _sizes(machine: Machine, form: Form) -> list[Parameter]:
    """Return the sizes of a form that have an everyday size which no nuisance stands for."""
    nuisances = machine.nuisances
    neutral = {p.name: 0.0 for p in nuisances}
    return [p for p in form.sizes
            if p.tolerance > 0.0 and nuisances.absorb(neutral, {p.name: p.step}) == neutral]


class _Everyday(Wrapped):
    """
    A machine with everyday sizes.

    sizes : those of the inner machine, m of them
    responses : derivatives of the readings by them in each experiment, shape (n c, m)
    process : of each experiment, see `Experiment.process`
    """

    def __init__(self, inner: Machine, sizes: tuple[_Size, ...],
                 responses: Sequence[NDArray[np.floating[Any]]],
                 process: Sequence[ProcessResponses | None]) -> None:
        numbers = [Parameter(_PREFIX + p.name, p.unit, -p.tolerance, p.tolerance, p.step,
                             EVERYDAY * p.tolerance) for p in (size.parameter for size in sizes)]
        self._place = {p.name: j for j, p in enumerate(numbers)}
        nuisances = copy(inner.nuisances)
        nuisances.extend(numbers)
        super().__init__(inner, [
            acting(e, part) for e, part in zip(inner.experiments, process, strict=True)],
            nuisances, inner.catalogue)
        self._sizes = sizes
        # single precision: they are read at every run
        self._responses: list[NDArray[np.floating[Any]]] = [
            np.ascontiguousarray(item, np.float32) for item in responses]
        self._last: dict[int, tuple[bytes, FloatArray]] = {}

    def _parted(self, point: Point) -> tuple[dict[str, float], FloatArray]:
        """Return a point in the inner machine's names, and the everyday sizes, shape (m,)."""
        return ({name: value for name, value in point.items() if name not in self._place},
                np.array([point.get(name, 0.0) for name in self._place]))

    def _with(self, readings: FloatArray, experiment: int, sizes: FloatArray) -> FloatArray:
        """Return readings with what the everyday sizes add."""
        if not sizes.any():
            return readings
        # most runs differ in other numbers
        known, added = self._last.get(experiment, (b'', readings))
        if known != (same := sizes.tobytes()):
            added = np.asarray(self._responses[experiment] @ sizes.astype(np.float32),
                               np.float64).reshape(readings.shape)
            self._last[experiment] = same, added
        return np.asarray(readings + added)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        parted = [self._parted(point) for point in points]
        rows = self.inner.simulate([inner for inner, _ in parted], only, until)
        return [[None if values is None else self._with(values, k, sizes)
                 for k, values in enumerate(row)]
                for (_, sizes), row in zip(parted, rows, strict=True)]

    def linear_response(self, name: str, experiment: int) -> FloatArray | None:
        if (place := self._place.get(name)) is None:
            return None
        return np.asarray(self._responses[experiment][:, place], np.float64).reshape(
            self.experiments[experiment].measured.shape)

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        inner, sizes = self._parted(point)
        return [self._with(values, k, sizes) for k, values in enumerate(
            self.inner.simulate_disturbed(inner, place, courses))]

    def around(self, inner: Machine) -> Machine:
        return self if inner is self.inner else self._around(
            inner, [e.process for e in self.experiments])

    def _around(self, inner: Machine, process: Sequence[ProcessResponses | None]) -> Machine:
        # a truncated machine has the first part of each test
        return _Everyday(inner, self._sizes, [
            response[:e.measured.size] for e, response in zip(
                inner.experiments, self._responses, strict=True)], process)

    def with_experiments(self, experiments: Sequence[Experiment]) -> Machine:
        return self._around(self.inner.with_experiments(list(map(calm, experiments))),
                            [e.process for e in experiments])

    def with_noise_at(self, point: Point) -> Machine:
        return self.around(self.inner.with_noise_at(self._parted(point)[0]))

    def linearised_at(self, point: Point) -> Machine:
        here = self._parted(point)[0]
        return _Everyday(self.inner, self._sizes, _responses(self.inner, self._sizes, here),
                         process(self.inner, here))
