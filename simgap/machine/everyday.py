# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A machine with a little of each effect, as every machine has it.

No size is exactly zero. Up to the tolerance of its catalogue an effect is no fault, but it shows,
and what shows and has no name would be taken for another effect. So each has a nuisance of its own
within the tolerance, whose prior is its everyday size. What so little does is linear in the size:
its derivative is taken once, at the model as configured and again at the best answer, and such a
nuisance costs no run. So it is with nuisances that the machine declares as linear.
"""

from collections.abc import Collection, Iterator, Sequence
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
from simgap.machine.machine import DisturbanceInput, Machine
from simgap.machine.motion import Motion, TimeScales

# The standard deviation of an everyday size, as a share of the tolerance.
EVERYDAY = 0.5
_PREFIX = 'everyday:'


def with_everyday(machine: Machine) -> Machine:
    """Return a machine with everyday sizes; itself if it has none, and nothing that is linear."""
    neutral = machine.simulate([{}])[0]
    residuals = [e.measured - predicted for e, predicted in zip(
        machine.experiments, neutral, strict=True) if predicted is not None]
    linear = {p.name: _Linear(p, p.name) for p in machine.nuisances if p.is_linear}
    # what acts in several places acts in each of them
    for effect in (item for item in machine.catalogue.values() if not item.parts):
        for form in machine.catalogue.forms(effect, machine.experiments, residuals):
            for p in _sizes(machine, form):
                # of forms that are alike near zero the first one stands for all
                linear.setdefault(p.name, _Linear(Parameter(
                    _PREFIX + p.name, p.unit, -p.tolerance, p.tolerance, p.step,
                    EVERYDAY * p.tolerance), p.name, form, effect))
    if not linear:
        return machine
    found = tuple(linear.values())
    return _Everyday(machine, found, _responses(machine, found, {}))


@dataclass(frozen=True)
class _Linear:
    """A nuisance in which the machine counts as linear."""

    parameter: Parameter
    name: str  # in the machine
    form: Form | None = None  # of the effect of which it is an everyday size
    effect: Effect | None = None

    def besides(self, point: Point, catalogue: Catalogue) -> Point:
        """Return a point without the effect's other forms, which exclude this one."""
        if self.form is None or self.effect is None:
            return point
        own = self.form.start
        others = tuple(f'{effect.id}.' for effect in catalogue.values()
                       if self.effect.id in (effect.id, *effect.parts))
        return {name: value for name, value in point.items()
                if name in own or not name.startswith(others)}


def _responses(machine: Machine, linear: Sequence[_Linear],
               point: Point) -> list[NDArray[np.floating[Any]]]:
    """Return the derivatives by what acts in each experiment, shape (n c, m), at a point."""
    bases = [item.besides(point, machine.catalogue) for item in linear]
    unlike = {frozenset(base): base for base in bases}
    steps, stepped = [], []
    for item, base in zip(linear, bases, strict=True):
        p, at = item.parameter, base.get(item.name, 0.0)
        steps.append(p.step if at + p.step <= p.high else -p.step)
        stepped.append({**(item.form.start if item.form else {}), **base,
                        item.name: at + steps[-1]})
    rows: Any = machine.low_fidelity().simulate(
        [*unlike.values(), *stepped],
        [*[None] * len(unlike), *(item.parameter.experiment for item in linear)])
    before = dict(zip(unlike, rows, strict=False))
    return [np.stack([
        np.nan_to_num((row[k] - before[frozenset(base)][k]) / step).ravel()
        for step, base, row in zip(steps, bases, rows[len(unlike):], strict=True)
        if row[k] is not None], axis=-1) for k in range(len(machine.experiments))]


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


class _Everyday(Machine):
    """
    A machine with nuisances in which it counts as linear, everyday sizes among them.

    linear : the nuisances
    responses : derivatives of the readings by those that act in each experiment, shape (n c, m)
    """

    def __init__(self, inner: Machine, linear: tuple[_Linear, ...],
                 responses: Sequence[NDArray[np.floating[Any]]]) -> None:
        names = {item.name for item in linear}
        nuisances = copy(inner.nuisances)
        nuisances[:] = [*(p for p in inner.nuisances if p.name not in names),
                        *(item.parameter for item in linear)]
        super().__init__(inner.experiments, nuisances, inner.catalogue)
        self.inner, self._linear = inner, linear
        # by experiment: the column of each nuisance that acts in it
        self._columns = [{name: j for j, name in enumerate(
            item.parameter.name for item in linear if item.parameter.experiment in (None, k))}
            for k in range(len(inner.experiments))]
        self._own = {item.parameter.name for item in linear}
        # single precision: they are read at every run
        self._responses: list[NDArray[np.floating[Any]]] = [
            np.ascontiguousarray(item, np.float32) for item in responses]
        self._last: dict[int, tuple[bytes, FloatArray]] = {}
        self.disturbance_inputs, self.notes = inner.disturbance_inputs, inner.notes
        self.diagram, self.advice, self.words = inner.diagram, inner.advice, inner.words
        self.planning = inner.planning

    def _inner_point(self, point: Point) -> dict[str, float]:
        return {name: value for name, value in point.items() if name not in self._own}

    def _with(self, readings: FloatArray, experiment: int, point: Point) -> FloatArray:
        """Return readings with what the linear nuisances add."""
        sizes = np.array([point.get(name, 0.0) for name in self._columns[experiment]], np.float32)
        if not sizes.any():
            return readings
        # most runs differ in other numbers
        known, added = self._last.get(experiment, (b'', readings))
        if known != (same := sizes.tobytes()):
            added = np.asarray(self._responses[experiment] @ sizes,
                               np.float64).reshape(readings.shape)
            self._last[experiment] = same, added
        return np.asarray(readings + added)

    def predict(self, point: Point, experiment: int) -> FloatArray:
        return self._with(self.inner.predict(self._inner_point(point), experiment), experiment,
                          point)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        rows = self.inner.simulate(list(map(self._inner_point, points)), only, until)
        return [[None if values is None else self._with(values, k, point)
                 for k, values in enumerate(row)]
                for point, row in zip(points, rows, strict=True)]

    def linear_response(self, name: str, experiment: int) -> FloatArray | None:
        if name not in self._own:
            return None
        shape = self.experiments[experiment].measured.shape
        place = self._columns[experiment].get(name)
        return np.zeros(shape) if place is None else np.asarray(
            self._responses[experiment][:, place], np.float64).reshape(shape)

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           course: Course) -> list[FloatArray]:
        return [self._with(values, k, point) for k, values in enumerate(
            self.inner.simulate_disturbed(self._inner_point(point), place, course))]

    @property
    def time_scales(self) -> TimeScales:
        return self.inner.time_scales

    def motion(self, experiment: int) -> Motion:
        return self.inner.motion(experiment)

    def _around(self, inner: Machine) -> Machine:
        if inner is self.inner:
            return self
        # a truncated machine has the first part of each test
        return _Everyday(inner, self._linear, [
            response[:e.measured.size] for e, response in zip(
                inner.experiments, self._responses, strict=True)])

    def truncated(self) -> Machine:
        return self._around(self.inner.truncated())

    def low_fidelity(self) -> Machine:
        return self._around(self.inner.low_fidelity())

    def with_experiments(self, experiments: Sequence[Experiment]) -> Machine:
        return self._around(self.inner.with_experiments(experiments))

    def without(self, effects: Collection[str]) -> Machine:
        return self._around(self.inner.without(effects))

    def with_noise_at(self, point: Point) -> Machine:
        return self._around(self.inner.with_noise_at(self._inner_point(point)))

    def linearised_at(self, point: Point) -> Machine:
        return _Everyday(self.inner, self._linear, _responses(
            self.inner, self._linear, self._inner_point(point)))
