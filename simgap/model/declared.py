# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a user has declared of a machine, as records; `declaration` has the words for it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, KW_ONLY
from typing import Any

import numpy as np
from simgap.errors import UserError
from simgap.inputs.schema import nearest
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
    value: float  # as configured
    low: float  # bound; the value for a known number
    high: float  # bound; the value for a known number
    unit: str = '1'  # of the value
    # of the difference quotient, which then never steps over less; 0: one is chosen
    step: float = 0.0
    sigma: float = 0.0  # standard deviation about the value; 0: unknown but for the bounds
    is_shape: bool = False  # means nothing while its effect is absent
    tolerance: float = 0.0  # size up to which an effect's number is usual and not worth a name
    spread: float = 0.0  # standard deviation from day to day; 0: a quarter of sigma

    @property
    def is_known(self) -> bool:
        return self.low == self.high

    @property
    def quotient_step(self) -> float:
        return self.step or _STEP_SHARE * (self.high - self.low)


@dataclass(frozen=True)
class Reading:
    """A reading of a sensor, which the simulation predicts."""

    unit: str  # of the reading
    noise: float  # standard deviation of white noise; at least that of the digit
    model_error: float | None = None  # slow error of a right model; None for 0.3 percent of motion
    digit: float = 0.0  # smallest step of the sensor; 0 for none
    column: str = ''  # of the logs; empty for the reading's own name
    zero: float = 0.0  # how far the sensor's zero may be off, in each test
    gain: float = 0.0  # share by which its scale may be off

    @property
    def sigma(self) -> float:
        """Return the standard deviation of what a perfect model leaves."""
        return float(np.hypot(self.noise, self.digit / np.sqrt(12.0)))


@dataclass(frozen=True)
class Push:
    """A place where something unknown may enter, such as a force on a carriage."""

    component: str  # part of the machine
    label: str  # for people
    unit: str  # of what enters
    size: float  # what moves the machine a little, well above noise and below limits
    everyday: float = 0.0  # rms of what acts there every day, such as a wind


@dataclass(frozen=True)
class OwnForm:
    """One mathematical form of an effect: its numbers by name."""

    name: str
    numbers: Mapping[str, Number]


@dataclass(frozen=True)
class Ripple:
    """A wave by an angle, whose order is given or found."""

    stem: str  # of stem_cosine, stem_sine, stem_order; harmonics have stem_cosine_k, stem_sine_k
    amplitude: Number  # bounds of each amplitude
    angle: Angle  # that it follows
    orders: tuple[float, ...]  # cycles per revolution that are tried; empty to find them
    harmonics: int = 1  # how many the wave has, its fundamental counted

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
    """Something that the model may lack."""

    name: str  # 'component.effect'
    cause: str  # its physical cause, one sentence; '' for what its name says
    forms: tuple[OwnForm, ...] = ()  # alternatives; the best one counts
    ripple: Ripple | None = None  # in the place of forms
    simpler: str = ''  # what it becomes at an end of its range

    @property
    def component(self) -> str:
        return self.name.partition('.')[0]


@dataclass(frozen=True)
class Model:
    """
    A simulation, and what may differ from it; with the logs of its tests it becomes a machine.

    simulate : f(numbers, test) -> {reading: shape (n,)}. `numbers.name` is a number; `test.time`
        [s], `test['column']` and `test.push['name']`, what enters there, have shape (n,). A test
        may be shorter than its log, because a search looks at its beginning first
    base : numbers of the model by name: `known`, `within` or `free`
    readings, push : by name: `reading`, and places where something unknown may enter: `push`
    effects : what the model may lack: `effect` or `ripple`
    per_test : numbers that each test has of its own, such as where it starts
    settles_s : time to settle after a push [s]; None for 5 percent of the longest test
    judged_hz : samples per second that are compared; None for at most 3000 samples of a test
    along : units of further columns of the logs, by name, of which something unknown may be a
        function; for an angle in rad, its place within a turn is tried as well
    blocks : the components in the order in which the signal passes them, for the picture
    advice : tests that settle what is open, a sentence each
    parallel : True if `simulate` may run in several threads at once, as compiled functions may
    log : makes of a log as it was read the one that the simulation wants
    tests : by kind: f(duration_s, random) -> a log with commands and without readings; `random` is
        a numpy Generator
    limits : greatest size that a reading may have in such a test, by reading

    Raises ModelError if a name is there twice, or an entry is not what it should be.
    """

    simulate: Simulation
    base: Mapping[str, Number]
    readings: Mapping[str, Reading]
    effects: Sequence[OwnEffect] = ()
    _: KW_ONLY
    per_test: Mapping[str, Number] = field(default_factory=dict)
    push: Mapping[str, Push] = field(default_factory=dict)
    settles_s: float | None = None
    judged_hz: float | None = None
    along: Mapping[str, str] = field(default_factory=dict)
    blocks: Sequence[str] = ()
    advice: Sequence[str] = ()
    parallel: bool = False
    log: Callable[[Log], Log] | None = None
    tests: Mapping[str, DrawTest] = field(default_factory=dict)
    limits: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not callable(self.simulate):
            raise ModelError('simulate: no function given')
        if not self.readings:
            raise ModelError('readings: none is given')
        for name, sensor in self.readings.items():
            if not isinstance(sensor, Reading):
                raise ModelError(f'readings: {name}: give reading(unit, noise)')
            if not sensor.sigma > 0.0:
                raise ModelError(f'readings: {name}: noise: {sensor.noise:g} given, allowed is a '
                                 'number above 0, in the unit of the reading, or a digit')
        taken: dict[str, str] = {}
        for where, numbers in (('base', self.base), ('per_test', self.per_test)):
            for name, number in numbers.items():
                _check_number(f'{where}: {name}', number)
                if not number.low <= number.value <= number.high:
                    raise ModelError(f'{where}: {name}: {number.value:g} given, allowed is '
                                     f'{number.low:g} to {number.high:g}')
                _take(taken, name, where)
        for item in self.effects:
            if not isinstance(item, OwnEffect):
                raise ModelError(f'effects: {item!r} given, allowed is effect() or ripple()')
            _check_effect(item, taken)
        names = [item.name for item in self.effects]
        for name in names:
            if names.count(name) > 1:
                raise ModelError(f'effect {name}: the name is there twice')
        for item in self.effects:
            others = [name for name in names if name != item.name]
            if item.simpler and item.simpler not in others:
                raise ModelError(f'effect {item.name}: simpler: {item.simpler}: no such other '
                                 f'effect{nearest(item.simpler, others)}')
        for name, draw in self.tests.items():
            if not callable(draw):
                raise ModelError(f'tests: {name}: give a function f(duration_s, random) -> Log')
        for name, limit in self.limits.items():
            if name not in self.readings:
                raise ModelError(f'limits: {name}: no such reading{nearest(name, self.readings)}')
            if not limit > 0.0:
                raise ModelError(f'limits: {name}: {limit!r} given, allowed is a number above 0')
        for name, place in self.push.items():
            if not isinstance(place, Push) or not place.size > 0.0:
                raise ModelError(f'push: {name}: give push(component, label, unit, size) with a '
                                 'size above 0')


def _check_effect(item: OwnEffect, taken: dict[str, str]) -> None:
    where = f'effect {item.name}'
    if '.' not in item.name:
        raise ModelError(f'{where}: allowed is a name such as gearbox.backlash: component, dot, '
                         'effect')
    if item.ripple is not None:
        _check_size(f'{where}: amplitude', item.ripple.amplitude)
        if not isinstance(item.ripple.harmonics, int) or item.ripple.harmonics < 1:
            raise ModelError(f'{where}: harmonics: {item.ripple.harmonics!r} given, allowed is '
                             'a whole number from 1')
        for name in (*item.ripple.fundamental, *item.ripple.higher, f'{item.ripple.stem}_order'):
            _take(taken, name, where)
    for one in item.forms:
        for name, number in one.numbers.items():
            _check_size(f'{where}: {name}', number)
            if taken.get(name) != where:  # forms of one effect may share a number
                _take(taken, name, where)


def _check_size(where: str, number: object) -> None:
    _check_number(where, number)
    assert isinstance(number, Number)
    if not number.is_shape and (number.value != 0.0 or number.sigma):
        raise ModelError(f'{where}: give size() or shape(): the number of an effect is 0 where '
                         'the effect is absent')
    if not number.low <= number.value <= number.high:
        neutral = f'its start {number.value:g}' if number.is_shape else 'the neutral value 0'
        raise ModelError(f'{where}: bounds {number.low:g} to {number.high:g} without {neutral}')
    if not number.low < number.high:
        raise ModelError(f'{where}: bounds {number.low:g} to {number.high:g} leave no room')


def _check_number(where: str, number: object) -> None:
    if not isinstance(number, Number):
        raise ModelError(f'{where}: {number!r} given, allowed is known(), within() or free()')
    if not (np.isfinite([number.value, number.low, number.high]).all()
            and number.low <= number.high):
        raise ModelError(f'{where}: bounds {number.low:g} to {number.high:g} given, allowed are '
                         'finite ones, the smaller first')


def _take(taken: dict[str, str], name: str, where: str) -> None:
    if not name.isidentifier():
        raise ModelError(f'{where}: {name!r}: a name is made of letters, digits and underscores')
    if name in taken:
        raise ModelError(f'{where}: {name}: the name is there twice, in {taken[name]} too')
    taken[name] = where


class Numbers(Mapping[str, float]):
    """Numbers of a simulation as attributes; `asked_for` has those it has read."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self._values = values
        self.asked_for: set[str] = set()

    def __getattr__(self, name: str) -> float:
        """Return a number. Raises ModelError if no entry of the model declares it."""
        if name.startswith('__'):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, name: str) -> float:
        self.asked_for.add(name)
        try:
            return self._values[name]
        except KeyError:
            raise ModelError(f'numbers.{name}: no entry of the model declares it'
                             f'{nearest(name, self._values)}') from None

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)
