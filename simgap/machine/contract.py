# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The seam between the diagnosis and the machine: what a diagnosis asks of a machine.

A machine of your own needs two things: a simulation (`Machine.predict`) and the numbers that may
differ from your model (`nuisances` and `effects`). Everything else has a default that you may
override, for speed or because you know your machine better.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
import math
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from simgap.machine.diagram import Diagram

FloatArray = NDArray[np.float64]
Point = Mapping[str, float]
# An input over time: from times [s] to values, shape (n,) each.
Course = Callable[[FloatArray], FloatArray]

# Sizes that may be tried out before a fit: of a single number as shares of its bounds; of a wave
# the least amplitude in steps, the factor to the next one, and the phases [rad].
_SHARES = (-0.9, -0.6, -0.4, -0.25, -0.15, -0.08, 0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 0.9)
_LEAST_AMPLITUDE = 2.5
_GROWTH = 2.5
_PHASES = tuple(2.0 * math.pi * k / 6 for k in range(6))


@dataclass(frozen=True)
class Parameter:
    """
    A number in which the machine may differ from its model; zero is the model as configured.

    Attributes
    ----------
    name : unique in its machine
    unit : of the value
    low, high : hard bounds, with zero between them
    step : of the difference quotient, in the unit of the value
    prior_sigma : standard deviation of a Gaussian prior about zero; 0 for no prior
    experiment : index of the one experiment that it acts on; None for all
    start : where a fit begins
    is_shape : True for a shape parameter, which has no meaning while its effect is absent
    tolerance : size up to which the model's number may be off without being wrong
    label : key and value of the label of the tests that it acts on; None for all
    least_step : least step of a difference quotient, for a prediction that is a staircase in the
        value, such as a delay in samples; 0 for none

    """

    name: str
    unit: str
    low: float
    high: float
    step: float
    prior_sigma: float = 0.0
    experiment: int | None = None
    start: float = 0.0
    is_shape: bool = False
    tolerance: float = 0.0
    label: tuple[str, str] | None = field(default=None, kw_only=True)
    least_step: float = field(default=0.0, kw_only=True)


@dataclass(frozen=True)
class Form:
    """
    One mathematical form of an effect.

    Attributes
    ----------
    name : for people
    parameters : those that are no shape parameters are zero where the effect is absent
    scanned : True if the form was chosen by a scan of many, such as the orders of a ripple
    is_course : True for a course over time that is free at every moment, such as a gust
    is_wave : True if its two sizes are the sine and the cosine part of a wave

    """

    name: str
    parameters: tuple[Parameter, ...]
    scanned: bool = field(default=False, kw_only=True)
    is_course: bool = field(default=False, kw_only=True)
    is_wave: bool = field(default=False, kw_only=True)

    @property
    def sizes(self) -> list[Parameter]:
        """Return the parameters that vanish with the effect."""
        return [p for p in self.parameters if not p.is_shape]

    @property
    def start(self) -> dict[str, float]:
        """Return the point at which a fit of this form begins."""
        return {p.name: p.start for p in self.parameters}

    @property
    def trials(self) -> list[dict[str, float]]:
        """
        Return sizes, far from zero, that may be tried out before a fit.

        Of a single size these are shares of its bounds, denser near zero. Of a wave they are
        amplitudes that grow from a few steps to the bound, each in several phases. Other forms
        have none.
        """
        if self.is_wave and len(self.sizes) == 2:  # with labels there are more
            sine, cosine = self.sizes
            least = _LEAST_AMPLITUDE * sine.step
            amplitudes = [least * _GROWTH ** k for k in range(
                1 + int(math.log(max(sine.high / least, 1.0), _GROWTH)))]
            return [{sine.name: amplitude * math.sin(phase),
                     cosine.name: amplitude * math.cos(phase)}
                    for amplitude in amplitudes for phase in _PHASES]
        if len(self.sizes) != 1:
            return []
        [size] = self.sizes
        return [{size.name: share * (size.high if share > 0.0 else -size.low)}
                for share in _SHARES if share > 0.0 or size.low < 0.0]

    def implausibility(self, point: Point, deviations: Point) -> float:
        """
        Return how little these values look like the effect; above 1 is implausible.

        `deviations` has their standard deviations; it is empty where they are not known.
        """
        return 0.0


@dataclass(frozen=True)
class Effect:
    """
    Something that the model may lack.

    Attributes
    ----------
    id : 'component.effect'
    component : the part of the machine that it sits in
    cause : its physical cause, one sentence
    look : what it looks like in the signals, one sentence
    forms : alternatives; the best one counts
    parts : ids of the effects that act together in it, each in its own place
    simpler : ids of the effects that it becomes at an end of its range

    """

    id: str  # noqa: A003: the word of the verdict's format
    component: str
    cause: str
    look: str
    forms: tuple[Form, ...]
    parts: tuple[str, ...] = ()
    simpler: tuple[str, ...] = ()


@dataclass(frozen=True)
class DisturbanceInput:
    """
    A place where an unknown input may act on the machine.

    Attributes
    ----------
    name : unique in its machine, for people
    component : the part of the machine that it acts on

    """

    name: str
    component: str


@dataclass(frozen=True)
class Colour:
    """
    The colour of noise: a filter whose output is white, see `noise`.

    Attributes
    ----------
    pole : of the slow part, for one sample; 0 if there is none
    gain : share of an innovation that stays in the slow part
    level : standard deviation of the innovations, in units of the stated noise

    """

    pole: float = 0.0
    gain: float = 0.0
    level: float = 1.0


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
    noise : standard deviation of the residuals of a perfect model, shape (n, c)
    quantised : names of signals whose residual at rest is a fraction of a digit, not noise
    model_error : slow error that the model may have in each signal however right it is, shape
        (c,), in the signals' units; None for a usual share of the motion
    colours : of the noise, one for each signal, as a diagnosis finds it; empty for white noise
    labels : what was different in this test, such as load: A; see `interventions`

    """

    name: str
    time: FloatArray
    channels: tuple[str, ...]
    units: tuple[str, ...]
    measured: FloatArray
    noise: FloatArray
    quantised: tuple[str, ...] = ()
    model_error: FloatArray | None = None
    colours: tuple[Colour, ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)

    def model_error_of(self, channel: int, share: float) -> float:
        """Return the model's error in a signal; by default a share of the signal's spread."""
        if self.model_error is not None:
            return float(self.model_error[channel])
        values = self.measured[:, channel]
        return share * float(np.nanstd(values)) if np.isfinite(values).any() else 0.0


@dataclass(frozen=True)
class Regimes:
    """The regime of motion of each sample: `labels`, shape (n,), are indices into `names`."""

    names: tuple[str, ...]
    labels: NDArray[np.int64]


@dataclass(frozen=True)
class TimeScales:
    """
    How fast the machine is, which the search and the localisation need to know.

    Attributes
    ----------
    start_s : time within which the effect of the initial conditions shows [s]
    scan_s : length of the part of a test that a scan of parameter values looks at [s]
    pulse_s : rise time of the pulses of an unknown input [s]
    response_s : time after which the response to such a pulse has ended [s]
    block_s : time beyond which residuals are independent, for the bootstrap [s]

    """

    start_s: float
    scan_s: float
    pulse_s: float
    response_s: float
    block_s: float

    @classmethod
    def of_duration(cls, duration_s: float) -> TimeScales:
        """Return usual scales for tests of a duration [s]."""
        return cls(start_s=0.05 * duration_s, scan_s=0.27 * duration_s,
                   pulse_s=0.005 * duration_s, response_s=0.05 * duration_s,
                   block_s=0.03 * duration_s)


class Machine(ABC):
    """
    A machine that can be simulated, and the experiments that were made with it.

    Parameters
    ----------
    experiments
        what was measured
    nuisances
        numbers that are known only within a tolerance; they are fitted beside any effect
    effects
        the catalogue of what the model may lack

    Attributes
    ----------
    experiments, nuisances, effects : as given; the effects by id
    disturbance_inputs : where an unknown input may act; readings need not be listed
    notes : what the machine inferred or missed, for people
    diagram : picture of the machine for the page; None for a block for each component
    advice : tests that settle what is open: names of effects without their component (empty for
        any), and what to record
    planning : what the design of a further test must know of the tests, as plain data

    """

    experiments: Sequence[Experiment]
    nuisances: Sequence[Parameter]
    effects: Mapping[str, Effect]
    disturbance_inputs: Sequence[DisturbanceInput] = ()
    notes: Sequence[str] = ()
    diagram: Diagram | None = None
    advice: Sequence[tuple[Sequence[str], str]] = ()
    planning: Mapping[str, Any] = MappingProxyType({})

    def __init__(self, experiments: Iterable[Experiment], nuisances: Iterable[Parameter] = (),
                 effects: Iterable[Effect] = ()) -> None:
        """Keep what was measured and what may differ."""
        self.experiments = tuple(experiments)
        self.nuisances = tuple(nuisances)
        self.effects = {effect.id: effect for effect in effects}

    # -- what a machine must give --------------------------------------------------------------

    @abstractmethod
    def predict(self, point: Point, experiment: int) -> FloatArray:
        """
        Return the readings of one experiment, had the machine these parameter values.

        Parameters
        ----------
        point
            parameter values by name; a parameter that is not named is zero, a shape parameter
            that is not named has no effect
        experiment
            its index

        Returns
        -------
        array of shape (n, c), as `Experiment.measured`; NaN or infinite where the run diverged

        """

    # -- what it may override for speed --------------------------------------------------------

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """
        Return the readings of several variants.

        Parameters
        ----------
        points
            parameter values by name, one mapping for each variant
        only
            for each variant the index of the one experiment that is wanted, None for all
        until
            end of the simulation after an experiment's first sample [s]; later readings are NaN

        Returns
        -------
        for each variant and experiment an array of shape (n, c), or None where not wanted

        """
        results: list[list[FloatArray | None]] = []
        for point, one in zip(points, only or [None] * len(points), strict=True):
            row: list[FloatArray | None] = [None] * len(self.experiments)
            for k in range(len(row)) if one is None else (one,):
                readings = self.predict(point, k)
                if math.isfinite(until):
                    time = self.experiments[k].time
                    readings = np.where((time - time[0] > until)[:, np.newaxis], np.nan, readings)
                row[k] = readings
            results.append(row)
        return results

    def truncated(self) -> Machine:
        """Return the machine with as much of each test as a search needs."""
        return self

    def low_fidelity(self) -> Machine:
        """Return a faster machine with nearly the same readings, for derivatives."""
        return self

    # -- what it may know better ---------------------------------------------------------------

    @property
    def time_scales(self) -> TimeScales:
        """Return how fast the machine is; by default in proportion to the longest test."""
        return TimeScales.of_duration(max(
            float(e.time[-1] - e.time[0]) for e in self.experiments))

    def with_experiments(self, experiments: Sequence[Experiment]) -> Machine:
        """Return the machine with the same experiments, of which more is known."""
        other = copy(self)
        other.experiments = tuple(experiments)
        return other

    def without(self, effects: Collection[str]) -> Machine:
        """
        Return the machine with a catalogue that lacks some effects.

        It also lacks their parts, what they are parts of, and what becomes one of them at an end
        of its range.

        Raises
        ------
        KeyError : there is no effect of a name

        """
        gone = {name for effect in effects for name in (effect, *self.effects[effect].parts)}
        other, kept = copy(self), dict(self.effects)
        while gone.intersection(kept):
            kept = {name: effect for name, effect in kept.items() if name not in gone}
            gone |= {name for name, effect in kept.items()
                     if gone.intersection((*effect.parts, *effect.simpler))}
        other.effects = kept
        return other

    def with_noise_at(self, point: Point) -> Machine:
        """
        Return the machine with the noise that its sensors have where it moves as at `point`.

        A jitter of the time stamps makes a fast reading noisier than a slow one.
        """
        return self

    def initial_conditions(self, experiment: int) -> Sequence[Sequence[Point]]:
        """
        Return initial conditions that are tried out before a fit, for one experiment.

        Gradients do not lead from one side of a gap to the other. Groups are tried one after the
        other, each from the best of those before it: conditions that hardly depend on each other
        need not be tried in all combinations.
        """
        return ()

    def forms(self, effect: Effect, residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """
        Return the forms of an effect that are worth a fit.

        Parameters
        ----------
        effect
            of the catalogue
        residuals
            of each experiment, measured minus predicted without the effect, shape (n, c)

        """
        return effect.forms

    def typical_form(self, effect: Effect) -> Form:
        """Return the form of an effect by which planned tests are judged."""
        return effect.forms[0]

    def form_named(self, effect: Effect, name: str) -> Form:
        """
        Return the form of an effect by its name.

        Raises
        ------
        KeyError : the effect has no such form

        """
        for form in effect.forms:
            if form.name == name:
                return form
        raise KeyError(f'{effect.id}: {name}')

    def relatives(self, ident: str) -> Iterator[tuple[Effect, float]]:
        """Yield an effect in other places, with the factor of its size that does as much."""
        effect = self.effects[ident]
        for part in effect.parts:
            yield self.effects[part], float(len(effect.parts))
        for whole in self.effects.values():
            if effect.id in whole.parts:
                yield whole, 1.0 / len(whole.parts)
                yield from ((self.effects[part], 1.0) for part in whole.parts
                            if part != effect.id)

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        """Return the form of an effect's part that corresponds to a form of the effect."""
        return part.forms[effect.forms.index(form)]

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """
        Return the nuisances that take over what they can of an effect that is removed.

        Parameters
        ----------
        point
            the nuisances
        removed
            the values of the effect's parameters

        """
        return dict(point)

    def take_over(self, point: Point, forms: Sequence[Form]) -> tuple[dict[str, float], set[str]]:
        """
        Return a point at which effects alone stand for their numbers.

        A nuisance may stand for the very number that an effect changes. Both together are not
        determined, so the nuisance is held at zero, and the effect takes over its value. Of
        several nuisances it takes over what they have in common.

        Parameters
        ----------
        point
            nuisances and effects
        forms
            of the effects

        Returns
        -------
        the point, and the names of the nuisances that are held at zero; by default none are

        """
        return dict(point), set()

    def regimes(self, experiment: int) -> Regimes:
        """Return the regime of motion of each sample; by default there is one regime."""
        return Regimes(('whole test',),
                       np.zeros(self.experiments[experiment].time.size, np.int64))

    def covariates(self, experiment: int) -> Mapping[str, FloatArray]:
        """Return quantities that a residual may depend on, shape (n,) each; by default time."""
        return {'time': self.experiments[experiment].time}

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           course: Course) -> list[FloatArray]:
        """
        Return the readings with an unknown input.

        Parameters
        ----------
        point
            parameter values by name
        place
            where it acts, one of `disturbance_inputs`
        course
            the input over time, in a unit that moves the machine a little

        Returns
        -------
        for each experiment an array of shape (n, c)

        """
        raise NotImplementedError(f'{type(self).__name__} names disturbance_inputs '
                                  'and lacks simulate_disturbed')
