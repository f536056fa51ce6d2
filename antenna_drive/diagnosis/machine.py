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
"""
What a diagnosis needs of a machine: parameters, a simulation, and effects it may lack.

The fitting, the ranking and the verdict know nothing of antennas. They ask a `Model` what its
machine would have shown, had its parameters been other ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Point = Mapping[str, float]
# An input over time: from times [s] to values, shape (n,) each.
Input = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Parameter:
    """
    One number that may be other than the configuration says.

    Attributes
    ----------
    name : unique in its model
    unit : of the value
    low, high : hard bounds; between them lies the neutral value, zero
    step : change for difference quotients, in the unit of the value
    spread : standard deviation expected beforehand, 0 if nothing is
    experiment : the one experiment that it acts on, None for all
    reading : True if it acts on readings alone, so that nothing need be simulated anew
    start : where a fit begins
    shape : True for a number that means nothing while its effect is absent
    tolerance : by how much the configuration may be off in this very number without being wrong

    """

    name: str
    unit: str
    low: float
    high: float
    step: float
    spread: float = 0.0
    experiment: int | None = None
    reading: bool = False
    start: float = 0.0
    shape: bool = False
    tolerance: float = 0.0


@dataclass(frozen=True)
class Form:
    """
    One mathematical form of an effect; its first parameters vanish with the effect.

    Attributes
    ----------
    name : for people
    parameters : of the form
    sought : True if the form itself was looked for among many

    """

    name: str
    parameters: tuple[Parameter, ...]
    sought: bool = field(default=False, kw_only=True)

    def strangeness(self, point: Point) -> float:
        """Return how far these values are from what the form stands for; above 1 is strange."""
        return 0.0


@dataclass(frozen=True)
class Effect:
    """
    Something that a model may lack.

    Attributes
    ----------
    id : 'component.effect'
    component : the part of the machine that it sits in
    cause : its physical cause, one sentence
    look : what it looks like in the signals, one sentence
    forms : alternatives, of which the best counts
    parts : ids of the effects that do the same together, each in its own place and of its own size

    """

    id: str  # noqa: A003: the word of the verdict's format
    component: str
    cause: str
    look: str
    forms: tuple[Form, ...]
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Entry:
    """
    A place where something unknown may enter the machine.

    Attributes
    ----------
    name : unique in its model, for people
    component : the part of the machine that it enters by

    """

    name: str
    component: str


@dataclass(frozen=True)
class Experiment:
    """
    What was measured in one test.

    Attributes
    ----------
    name : for people
    time : shape (n,) [s]
    channels : names of the c signals
    units : of the signals
    measured : shape (n, c); NaN where there is no sample
    noise : standard deviation expected of a perfect model's residuals, shape (n, c)
    coarse : names of signals whose residual at rest is a fraction of one step, and no noise

    """

    name: str
    time: FloatArray
    channels: tuple[str, ...]
    units: tuple[str, ...]
    measured: FloatArray
    noise: FloatArray
    coarse: tuple[str, ...] = ()


@dataclass(frozen=True)
class Motion:
    """How the machine moves in an experiment: arrays of shape (n,), from any source."""

    rate: FloatArray
    load: FloatArray
    angle: FloatArray
    limit: float


class Model(Protocol):
    """A machine that can be simulated; see `Parameter`, `Effect` and `Experiment`."""

    @property
    def experiments(self) -> Sequence[Experiment]:
        """Return the tests."""

    @property
    def nuisances(self) -> Sequence[Parameter]:
        """Return what is known only within a tolerance and must be fitted beside any effect."""

    @property
    def effects(self) -> Mapping[str, Effect]:
        """Return the catalogue, by id."""

    def brief(self) -> Model:
        """Return the model with as much of its tests as a search needs, or the model itself."""

    def rough(self) -> Model:
        """
        Return the model as it is simulated for derivatives, or the model itself.

        It takes the same points and gives nearly the same readings for less.
        """

    def heard_at(self, point: Point) -> Model:
        """
        Return the model with the noise that its sensors have at a point, or the model itself.

        A time stamp that is off makes a fast reading noisier than a slow one.
        """

    def forms(self, effect: Effect, residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """
        Return the forms of an effect that are worth a trial.

        Parameters
        ----------
        effect
            of the catalogue
        residuals
            of each experiment: measured less predicted without the effect, shape (n, c)

        """

    @property
    def entries(self) -> Sequence[Entry]:
        """Return where something unknown may enter, apart from the readings themselves."""

    def pushed(self, point: Point, entry: Entry, course: Input) -> list[FloatArray]:
        """
        Return what the sensors would have shown, had an input of any course entered.

        Parameters
        ----------
        point
            parameter values by name
        entry
            where it enters
        course
            the input over time, in a unit that moves the machine a little

        Returns
        -------
        for each experiment an array of shape (n, c)

        """

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        """Return the form of an effect's part that is like a form of the effect."""

    def motion(self, experiment: int) -> Motion:
        """Return how the machine moved in an experiment: it says when a gap shows."""

    def absorbed(self, point: Point, gone: Point) -> dict[str, float]:
        """
        Return the offsets that do as much as they can of what an effect did.

        Parameters
        ----------
        point
            the offsets
        gone
            values of the effect's parameters

        """

    def simulate(self, points: Sequence[Point],
                 only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """
        Return what the sensors would have shown.

        Parameters
        ----------
        points
            parameter values by name, one mapping for each variant; the rest is neutral
        only
            for each variant the one experiment that is wanted, None for all
        until
            end of the simulation after an experiment's first sample [s]; what would come later is
            NaN

        Returns
        -------
        for each variant and experiment an array of shape (n, c), or None where not wanted

        """
