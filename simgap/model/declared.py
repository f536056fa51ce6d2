# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a user has declared of a machine, as records; `declaration` has the words for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from simgap.errors import UserError
from simgap.logs.log import Log
from simgap.machine.contract import FloatArray

# From numbers and a test to readings by name, shape (n,) each.
Simulation = Callable[[Any, Any], Mapping[str, Any]]
# The angle that a wave follows at each sample of a log [rad], shape (n,).
Angle = Callable[[Log], FloatArray]

# Draws a test: from its length [s] and a source of randomness to a log with its commands.
DrawTest = Callable[[float, np.random.Generator], Log]

# A difference quotient steps over this share of a number's bounds.
_STEP_SHARE = 1e-3


class ModelError(UserError):
    """A model of one's own is wrong; the message names the entry and the remedy."""


@dataclass(frozen=True)
class Number:
    """
    A number of the simulation.

    Attributes
    ----------
    value : as configured
    low, high : bounds; equal to the value for a known number
    unit : of the value
    step : of the difference quotient, which then never steps over less; 0 for one that is chosen
    sigma : standard deviation about the value; 0 if nothing is known but the bounds
    is_shape : True for a number of an effect that means nothing while the effect is absent
    tolerance : size up to which an effect's number is usual and not worth a name

    """

    value: float
    low: float
    high: float
    unit: str = '1'
    step: float = 0.0
    sigma: float = 0.0
    is_shape: bool = False
    tolerance: float = 0.0

    @property
    def is_known(self) -> bool:
        """Return whether the number is never fitted."""
        return self.low == self.high

    @property
    def quotient_step(self) -> float:
        """Return the step of the difference quotient."""
        return self.step or _STEP_SHARE * (self.high - self.low)


@dataclass(frozen=True)
class Reading:
    """
    A reading of a sensor, which the simulation predicts.

    Attributes
    ----------
    unit : of the reading
    noise : standard deviation of the sensor's white noise; at least that of its digit
    model_error : slow error that a right model may have; None for 0.3 percent of the motion
    digit : smallest step of the sensor; 0 for none
    column : of the logs; empty for the reading's own name
    zero : how far the sensor's zero may be off, in each test
    gain : share by which its scale may be off

    """

    unit: str
    noise: float
    model_error: float | None = None
    digit: float = 0.0
    column: str = ''
    zero: float = 0.0
    gain: float = 0.0

    @property
    def sigma(self) -> float:
        """Return the standard deviation of what a perfect model leaves."""
        return float(np.hypot(self.noise, self.digit / np.sqrt(12.0)))


@dataclass(frozen=True)
class Push:
    """
    A place where something unknown may enter, such as a force on a carriage.

    Attributes
    ----------
    component : part of the machine
    label : for people
    unit : of what enters
    size : what moves the machine a little, well above the noise and far from any limit

    """

    component: str
    label: str
    unit: str
    size: float


@dataclass(frozen=True)
class OwnForm:
    """One mathematical form of an effect: its numbers by name."""

    name: str
    numbers: Mapping[str, Number]


@dataclass(frozen=True)
class Ripple:
    """
    A wave by an angle, whose order is given or found.

    Attributes
    ----------
    stem : its numbers are stem_cosine, stem_sine and stem_order, and of harmonic k stem_cosine_k
        and stem_sine_k
    amplitude : bounds of each amplitude
    angle : that it follows
    orders : cycles per revolution that are tried; empty to find them
    harmonics : how many the wave has, its fundamental counted

    """

    stem: str
    amplitude: Number
    angle: Angle
    orders: tuple[float, ...]
    harmonics: int = 1

    @property
    def fundamental(self) -> tuple[str, str]:
        """Return the names of the two amplitudes that vanish with the wave."""
        return f'{self.stem}_cosine', f'{self.stem}_sine'

    @property
    def higher(self) -> tuple[str, ...]:
        """Return the names of the amplitudes of its other harmonics."""
        return tuple(f'{name}_{k}' for k in range(2, self.harmonics + 1)
                     for name in self.fundamental)


@dataclass(frozen=True)
class OwnEffect:
    """
    Something that the model may lack.

    Attributes
    ----------
    name : 'component.effect'
    cause : its physical cause, one sentence
    look : what it looks like in the readings, one sentence
    forms : alternatives; the best one counts
    ripple : set in the place of forms for a wave by an angle
    simpler : name of the effect that it becomes at an end of its range; empty if there is none

    """

    name: str
    cause: str
    look: str
    forms: tuple[OwnForm, ...] = ()
    ripple: Ripple | None = None
    simpler: str = ''

    @property
    def component(self) -> str:
        """Return the part of the machine."""
        return self.name.partition('.')[0]


@dataclass(frozen=True)
class Model:
    """
    A simulation, and what may differ from it; `machine` describes the entries.

    A model becomes a machine of the diagnosis with the logs of its tests.
    """

    simulate: Simulation
    base: Mapping[str, Number]
    readings: Mapping[str, Reading]
    effects: Sequence[OwnEffect] = ()
    per_test: Mapping[str, Number] = field(default_factory=dict)
    push: Mapping[str, Push] = field(default_factory=dict)
    settles_s: float | None = None
    judged_hz: float | None = None
    blocks: Sequence[str] = ()
    advice: Sequence[str] = ()
    parallel: bool = False
    log: Callable[[Log], Log] | None = None
    tests: Mapping[str, DrawTest] = field(default_factory=dict)
    limits: Mapping[str, float] = field(default_factory=dict)
