# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A machine whose effects may differ between labels of its tests, and its numbers from day to day.

A day and a specimen have deviations of their own from the machine's numbers, a repeat has none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math
from statistics import fmean

from simgap.machine.arrays import Course, FloatArray, Point
from simgap.machine.catalogue import Catalogue
from simgap.machine.effect import Effect, Form, Parameter
from simgap.machine.everyday import as_configured
from simgap.machine.experiment import Experiment
from simgap.machine.machine import DisturbanceInput, Machine, Wrapped
from simgap.machine.nuisances import Nuisances

# The values of a label by test; '' where a test lacks the label.
Groups = Mapping[str, tuple[str, ...]]

REPEAT, DAY, SPECIMEN = 'repeat', 'day', 'specimen'
# Standard deviations under the values of a label, as shares of that of a number's prior.
_SHARES = {DAY: 0.25, SPECIMEN: 1.0}


def groups_of(experiments: Sequence[Experiment]) -> dict[str, tuple[str, ...]]:
    """Return the value of each test by label; labels that divide the tests alike count once."""
    found: dict[str, tuple[str, ...]] = {}
    seen = set()
    for key in dict.fromkeys(key for e in experiments for key in e.labels if key != REPEAT):
        values = tuple(e.labels.get(key, '') for e in experiments)
        division = tuple(map(values.index, values))
        if len(set(values)) > 1 and division not in seen:
            seen.add(division)
            found[key] = values
    return found


def by_label(machine: Machine) -> Machine:
    """Return a machine whose effects may differ between labels; itself if there are none."""
    groups = groups_of(machine.experiments)
    return ByLabel(machine, Labels(groups, machine.nuisances)) if groups else machine


def without_labels(machine: Machine) -> Machine:
    """Return the machine as it was before `by_label`, and without everyday sizes."""
    return as_configured(machine.inner if isinstance(machine, ByLabel) else machine)


def spread_of(number: Parameter, key: str) -> float:
    """Return the standard deviation of a number under the values of a label; 0 for any other."""
    usual = _SHARES.get(key, 0.0) * number.prior_sigma
    return 0.0 if number.experiment is not None else (key == DAY and number.spread) or usual


def _split_name(name: str, key: str, value: str) -> str:
    return f'{name}[{key}={value}]'


def _deviation(of: Parameter, spread: float, label: tuple[str, str]) -> Parameter:
    room = min(4.0 * spread, 0.5 * (of.high - of.low))
    return replace(of, name=_split_name(of.name, *label), low=-room, high=room,
                   prior_sigma=spread, label=label, of=of.name)


class Labels:
    """Forms with a size under each label of `groups`, their names, and points that hold them."""

    def __init__(self, groups: Groups, nuisances: Sequence[Parameter]) -> None:
        self.groups = groups
        # the form that each split form comes from, and the label; grows as forms are split
        self._whole: dict[Form, tuple[Form, str]] = {}
        self._own = {p.name: p for p in nuisances}
        self.deviations = [
            _deviation(p, spread, (key, value))
            for key, values in groups.items() for p in nuisances if (spread := spread_of(p, key))
            for value in dict.fromkeys(values)]
        self._endings = {_split_name('', key, value): (key, value)
                         for key, values in groups.items() for value in values}

    def whole(self, form: Form) -> tuple[Form, str]:
        """Return the form that a split form comes from, and the label; '' for any other form."""
        return self._whole.get(form, (form, ''))

    def split(self, form: Form, key: str) -> Form:
        """Return a form with sizes of its own under each value of a label, and one shape."""
        sizes = [replace(p, name=_split_name(p.name, key, value), label=(key, value))
                 for value in dict.fromkeys(self.groups[key]) for p in form.sizes]
        found = replace(form, name=f'{form.name} by {key}'.strip(), parameters=(
            *sizes, *(p for p in form.parameters if p.is_shape)))
        self._whole[found] = (form, key)
        return found

    def parts(self, name: str) -> tuple[str, tuple[str, str] | None]:
        """Return the machine's own name of a number, and the label of its tests."""
        if name.endswith(']') and name not in self._own:
            for ending, label in self._endings.items():
                if name.endswith(ending):
                    return name.removesuffix(ending), label
        return name, None

    def are_in(self, point: Point) -> bool:
        """Return whether a point has sizes by label."""
        return any(self.parts(name)[1] is not None for name in point)

    def at(self, point: Point, labels: Mapping[str, str]) -> dict[str, float]:
        """Return a point as it is in a test with some labels, in the machine's own names."""
        found: dict[str, float] = {}
        for name, value in point.items():
            base, label = self.parts(name)
            if label is None or labels.get(label[0], '') == label[1]:
                found[base] = found.get(base, 0.0) + value
        for name in {p.of for p in self.deviations}.intersection(found):
            # a day may lead out of the tolerance, but mass and friction stay positive
            own = self._own[name]
            beyond = 0.45 * (own.high - own.low) if own.prior_sigma else 0.0
            found[name] = min(max(found[name], own.low - beyond), own.high + beyond)
        return found

    def in_test(self, point: Point, experiment: int) -> dict[str, float]:
        """Return a point as it is in one test, in the machine's own names."""
        return self.at(point, {key: values[experiment] for key, values in self.groups.items()})

    def mean(self, point: Point) -> dict[str, float]:
        """Return a point with one size for all tests, the mean of those by label."""
        parts: dict[str, dict[str, list[float]]] = {}
        for name, value in point.items():
            base, label = self.parts(name)
            parts.setdefault(base, {}).setdefault(label[0] if label else '', []).append(value)
        return {name: sum(map(fmean, own.values())) for name, own in parts.items()}


class _LabelledCatalogue(Catalogue):
    """A catalogue with a further form of each effect for each label."""

    def __init__(self, inner: Catalogue, labels: Labels) -> None:
        super().__init__(inner.values())
        self._inner, self._labels = inner, labels

    def forms(self, effect: Effect, experiments: Sequence[Experiment],
              residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return the forms that are worth a fit, with one size for all tests and split."""
        whole = self._inner.forms(effect, experiments, residuals)
        return [*whole, *(self._labels.split(form, key) for form in whole if can_be_split(form)
                          for key in self._labels.groups)]

    def whole(self, form: Form) -> Form:
        return self._labels.whole(form)[0]

    def typical_form(self, effect: Effect) -> Form:
        return self._inner.typical_form(effect)

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        base, key = self._labels.whole(form)
        found = self._inner.counterpart(base, effect, part)
        return self._labels.split(found, key) if key else found


class _LabelledNuisances(Nuisances):
    """Nuisances beside effects that may have a size under each label."""

    def __init__(self, inner: Nuisances, labels: Labels) -> None:
        super().__init__([*inner, *labels.deviations], inner.initial_conditions)
        self._inner, self._labels = inner, labels

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """Return the nuisances that take over what they can; sizes count with their mean."""
        return self._inner.absorb(point, self._labels.mean(removed))


class ByLabel(Wrapped):
    """A machine with a further form of each effect for each label of its tests."""

    def __init__(self, inner: Machine, labels: Labels) -> None:
        super().__init__(inner, inner.experiments, _LabelledNuisances(inner.nuisances, labels),
                         _LabelledCatalogue(inner.catalogue, labels))
        self.labels = labels

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        count = len(self.experiments)
        jobs: list[tuple[int, Point, int | None]] = []
        for i, (point, one) in enumerate(zip(points, only or [None] * len(points), strict=True)):
            if self.labels.are_in(point):
                jobs += [(i, self.labels.in_test(point, k), k)
                         for k in (range(count) if one is None else (one,))]
            else:
                jobs.append((i, point, one))
        found = self.inner.simulate([point for _, point, _ in jobs], [k for *_, k in jobs], until)
        rows: list[list[FloatArray | None]] = [[None] * count for _ in points]
        for (i, _, one), row in zip(jobs, found, strict=True):
            for k in range(count) if one is None else (one,):
                rows[i][k] = row[k]
        return rows

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        if not self.labels.are_in(point):
            return self.inner.simulate_disturbed(point, place, courses)
        return [self.inner.simulate_disturbed(self.labels.in_test(point, k), place, courses)[k]
                for k in range(len(self.experiments))]

    def around(self, inner: Machine) -> Machine:
        return self if inner is self.inner else ByLabel(inner, self.labels)

    def with_noise_at(self, point: Point) -> Machine:
        """Return the machine with the noise of a motion; sizes count with their mean."""
        return self.around(self.inner.with_noise_at(self.labels.mean(point)))

    def linearised_at(self, point: Point) -> Machine:
        return self.around(self.inner.linearised_at(self.labels.mean(point)))


def can_be_split(form: Form) -> bool:
    """Return whether a form may have a size under each value of a label."""
    return all(p.experiment is None for p in form.parameters)
