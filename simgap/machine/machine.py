# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The seam between the diagnosis and the machine: what a diagnosis asks of a machine.

Your machine needs a simulation (`Machine.predict`) and the numbers that may differ from your model
(`nuisances` and `effects`). You may override the other defaults, for speed or accuracy.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, KW_ONLY
import math
from types import MappingProxyType
from typing import Any

import numpy as np
from simgap.machine.arrays import Course, FloatArray, Point
from simgap.machine.catalogue import Catalogue
from simgap.machine.diagram import Diagram
from simgap.machine.effect import Effect, Parameter
from simgap.machine.experiment import Experiment
from simgap.machine.motion import Motion, TimeScales
from simgap.machine.nuisances import Nuisances

# From the numbers of an effect, as a verdict has them, to a clause and the next steps.
Words = Callable[[Mapping[str, Any]], tuple[str, Sequence[str]]]


@dataclass(frozen=True)
class DisturbanceInput:
    """A place where an unknown input may act on the machine."""

    name: str  # unique in its machine, for people
    component: str  # the part of the machine that it acts on
    _: KW_ONLY
    unit: str = ''  # of what enters
    size: float = 1.0  # of one unit of a course, which moves the machine a little
    everyday: float = 0.0  # rms of what acts there every day, in units of a course


@dataclass(frozen=True)
class Learnable:
    """A function that the machine's own equations have room for."""

    effect: Effect  # of one form, whose numbers are its values
    by: str  # the quantity that it depends on
    by_unit: str
    at: tuple[float, ...]  # values of the quantity


class Machine(ABC):
    """
    A machine that can be simulated, and the experiments that were made with it.

    nuisances : numbers known only within a tolerance, fitted beside any effect
    catalogue : the effects that the model may lack, by id
    disturbance_inputs : where an unknown input may act; readings need not be listed
    learnable : functions that its equations have room for, which no effect of the catalogue is
    notes : what the machine inferred or missed, for people
    diagram : picture of the machine for the page; None for a block for each component
    advice : tests that settle what is open: effects without their component (empty for any), and
        what to record
    words : what people say of effects, by id, see `Words`
    planning : what the design of a further test must know of the tests, as plain data
    """

    experiments: Sequence[Experiment]
    nuisances: Nuisances
    catalogue: Catalogue
    disturbance_inputs: Sequence[DisturbanceInput] = ()
    learnable: Sequence[Learnable] = ()
    notes: Sequence[str] = ()
    diagram: Diagram | None = None
    advice: Sequence[tuple[Sequence[str], str]] = ()
    words: Mapping[str, Words] = MappingProxyType({})
    planning: Mapping[str, Any] = MappingProxyType({})

    def __init__(self, experiments: Iterable[Experiment], nuisances: Iterable[Parameter] = (),
                 effects: Iterable[Effect] | Catalogue = ()) -> None:
        self.experiments = tuple(experiments)
        self.nuisances = nuisances if isinstance(nuisances, Nuisances) else Nuisances(nuisances)
        self.catalogue = effects if isinstance(effects, Catalogue) else Catalogue(effects)

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """
        Return the readings of an experiment, shape (n, c); not finite where the run diverged.

        `point` has values by name. Others are zero. A machine defines this method or `simulate`.
        """
        found = self.simulate([point], [experiment])[0][experiment]
        assert found is not None
        return found

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """
        Return the readings of variants by experiment, shape (n, c) each, or None if not wanted.

        only : for each variant the index of the one experiment that is wanted, None for all
        until : end of the simulation after the first sample [s]; later readings are NaN
        """
        results: list[list[FloatArray | None]] = []
        for point, one in zip(points, only or [None] * len(points), strict=True):
            row: list[FloatArray | None] = [None] * len(self.experiments)
            for k in range(len(row)) if one is None else (one,):
                row[k] = self.predict_until(point, k, until)
            results.append(row)
        return results

    def predict_until(self, point: Point, experiment: int, until: float) -> FloatArray:
        """Return the readings as `predict`, NaN later than `until` [s] after the first sample."""
        readings = self.predict(point, experiment)
        if math.isfinite(until):
            time = self.experiments[experiment].time
            readings = np.where((time - time[0] > until)[:, np.newaxis], np.nan, readings)
        return readings

    def truncated(self) -> Machine:
        """Return the machine with as much of each test as a search needs."""
        return self

    def low_fidelity(self) -> Machine:
        """Return a faster machine with nearly the same readings, for derivatives."""
        return self

    @property
    def time_scales(self) -> TimeScales:
        """Return how fast the machine is; by default in proportion to the longest test."""
        return TimeScales.of_duration(max(float(e.time[-1] - e.time[0]) for e in self.experiments))

    def motion(self, experiment: int) -> Motion:
        """Return how it moves in an experiment; by default nothing is known."""
        return Motion(self.experiments[experiment].time)

    def offered(self, experiment: int) -> Mapping[str, tuple[str, FloatArray]]:
        """Return what else an input may be a function of, as measured: unit and values, (n,)."""
        return {}

    def with_experiments(self, experiments: Sequence[Experiment]) -> Machine:
        """Return the machine with the same experiments, of which more is known."""
        other = copy(self)
        other.experiments = tuple(experiments)
        return other

    def without(self, effects: Collection[str]) -> Machine:
        """Return the machine without some effects, see `Catalogue.without`."""
        other = copy(self)
        other.catalogue = self.catalogue.without(effects)
        return other

    def with_noise_at(self, point: Point) -> Machine:
        """Return the machine with the noise of its sensors where it moves as at `point`."""
        # a jitter of the time stamps makes a fast reading noisier than a slow one
        return self

    def linearised_at(self, point: Point) -> Machine:
        """Return the machine with what it takes as linear, if anything, taken so at `point`."""
        return self

    def linear_response(self, name: str, experiment: int) -> FloatArray | None:
        """Return the derivative by what it takes as linear, shape (n, c); None for the rest."""
        return None

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        """
        Return the readings of each experiment, shape (n, c), with an unknown input.

        `place` is one of `disturbance_inputs`; `courses` are the input over time in each
        experiment, in a unit that moves the machine a little.
        """
        raise NotImplementedError(f'{type(self).__name__} names disturbance_inputs '
                                  'and lacks simulate_disturbed')


class Wrapped(Machine):
    """A machine around an inner one, which it passes on but for what it adds."""

    def __init__(self, inner: Machine, experiments: Iterable[Experiment], nuisances: Nuisances,
                 catalogue: Catalogue) -> None:
        super().__init__(experiments, nuisances, catalogue)
        self.inner = inner
        self.disturbance_inputs, self.learnable = inner.disturbance_inputs, inner.learnable
        self.diagram, self.advice, self.words = inner.diagram, inner.advice, inner.words
        self.notes, self.planning = inner.notes, inner.planning

    @abstractmethod
    def around(self, inner: Machine) -> Machine:
        """Return the same around another inner machine."""

    @property
    def time_scales(self) -> TimeScales:
        return self.inner.time_scales

    def motion(self, experiment: int) -> Motion:
        return self.inner.motion(experiment)

    def offered(self, experiment: int) -> Mapping[str, tuple[str, FloatArray]]:
        return self.inner.offered(experiment)

    def truncated(self) -> Machine:
        return self.around(self.inner.truncated())

    def low_fidelity(self) -> Machine:
        return self.around(self.inner.low_fidelity())

    def with_experiments(self, experiments: Sequence[Experiment]) -> Machine:
        return self.around(self.inner.with_experiments(experiments))

    def without(self, effects: Collection[str]) -> Machine:
        return self.around(self.inner.without(effects))

    def linear_response(self, name: str, experiment: int) -> FloatArray | None:
        return self.inner.linear_response(name, experiment)
