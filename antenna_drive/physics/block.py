# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a block of the drive declares, once, beside its equations.

The lock-step of a node, the compiled run in one process and the continuous run of the diagnosis
are all made from this declaration and the wiring (`emulator.wiring`).
"""

from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.integrator import located_runge_kutta
from simgap.laws.compiling import inner, shared


@dataclass(frozen=True)
class Signal:
    """
    One quantity that a unit puts out at every macro-step.

    `exchanged` signals feed other units; the rest are readings, for people and recordings.
    """

    name: str
    unit: str
    description: str
    exchanged: bool = True

    @property
    def rate_unit(self) -> str:
        """Return the unit of the signal's time derivative."""
        if self.unit.endswith('/s'):
            return f'{self.unit}^2'
        return f'{self.unit}/s'


def rows(*names: str) -> Any:
    """Return a named tuple of whole numbers, from 0 on: constants for compiled code."""
    return namedtuple('Rows', names)(*range(len(names)))  # type: ignore[misc]


def output_rows(signals: tuple[Signal, ...]) -> Any:
    """Return numbers for the names of signals, from 0 on; see `rows`."""
    return rows(*(signal.name for signal in signals))


@inner
def held(u: FloatArray, row: int, t: float) -> float:
    """Return an input at t [s] after the start of the macro-step: the first-order hold."""
    return u[row, 0] + u[row, 1] * t


@inner
def put(y: FloatArray, row: int, value: float, slope: float) -> None:
    """Write an output and its time derivative."""
    y[row, 0] = value
    y[row, 1] = slope


class Equation(NamedTuple):
    """
    How a continuous run computes an output, or its slope, that is none of the states.

    function : compiled (t, x, mode, u, p) -> float
    feedthrough : the inputs that the function reads
    rate_of : a state whose time derivative is just this, '' if there is none; where the
        derivatives are known anyway, the function is not called
    """

    function: Any
    feedthrough: tuple[str, ...] = ()
    rate_of: str = ''


@dataclass(frozen=True, kw_only=True, eq=False)
class Interface:
    """
    What others see of a unit, whatever is within.

    kind : the type of its parameter set
    inputs : names of what it reads, from `rows`
    outputs : the signals that it puts out
    bare : the set within `kind` whose parameters go by their bare names, '' for none
    """

    kind: type
    inputs: Any = rows()
    outputs: tuple[Signal, ...]
    bare: str = ''


@dataclass(frozen=True, kw_only=True, eq=False)
class Source(Interface):
    """A unit without inputs that puts out test signals; `emulator.units.SourceUnit` runs it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Block(Interface):
    """
    A unit with states of its own, as compiled functions.

    In these, x are the states and mode the modes (whole numbers) of a shape that `states` and
    `modes` tell, u the inputs and y the outputs, value and time derivative in each row, p the
    record of `kind`, and t the time since the start of the macro-step [s]. An output with the
    name of a state is that state.

    states, modes : their names, from `rows`
    more_states : gives the number of further states, from p; None if there are never any
    start : (p, x, mode) writes what differs from zero at t = 0
    rates : (t, x, mode, u, p, dx) writes the time derivatives for frozen modes into dx
    switch : (t, x, mode, u, p, commit) -> bool tells whether the modes no longer hold; if commit
        is true it also writes the new ones and resets states. None if there are no modes
    read : (x, mode, u, t, p, y) writes the outputs
    begin, end : (x, mode, u, p, h, y) act before and after a macro-step of h [s], when y still
        holds the outputs at its start, and when it holds those at its end; None for nothing
    values : equations of outputs that are no states; None for an output that has no meaning in a
        continuous run, and is zero there
    slopes : equations of the slopes of outputs, where another unit's rates or modes use them
    slopes_used : the inputs whose slopes its rates or modes use other than to extrapolate
    """

    states: Any
    modes: Any = rows()
    more_states: Callable[[Any], int] | None = None
    start: Any = None
    rates: Any
    switch: Any = None
    read: Any
    begin: Any = None
    end: Any = None
    values: Mapping[str, Equation | None] = field(default_factory=dict)
    slopes: Mapping[str, Equation] = field(default_factory=dict)
    slopes_used: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        """Return the folder whose sources this block is made from."""
        return Path(self.rates.function.__code__.co_filename).resolve().parent

    def count_states(self, p: Any) -> int:
        """Return the number of states with these parameters, a record of `kind`."""
        return len(self.states) + (int(self.more_states(p)) if self.more_states else 0)

    @cached_property
    def step(self) -> Any:
        """Return compiled (x, mode, u, p, h, steps, work, y): one macro-step in inner steps."""
        integrate = located_runge_kutta(
            self.rates, self.switch or _never, 0 if self.more_states else len(self.states))
        begin, read, end = self.begin or _nothing, self.read, self.end or _nothing

        @shared
        def step(x: FloatArray, mode: IntArray, u: FloatArray, p: Any, h: float, steps: int,
                 work: FloatArray, y: FloatArray) -> None:
            begin(x, mode, u, p, h, y)
            integrate(x, mode, u, p, h, steps, work)
            read(x, mode, u, h, p, y)
            end(x, mode, u, p, h, y)

        return step


@inner
def rest(p: Any, x: FloatArray, mode: IntArray) -> None:
    """Start with every state and mode at zero."""


@inner
def _never(t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Any, commit: bool) -> bool:
    return False


@inner
def _nothing(x: FloatArray, mode: IntArray, u: FloatArray, p: Any, h: float, y: FloatArray,
             ) -> None:
    pass
