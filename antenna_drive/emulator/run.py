# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The drive in one process: the same units in the same lock-step as the nodes, bit for bit.

Every unit advances by one macro-step from what all of them put out at its start: value and time
derivative of each signal, which the receiver extrapolates (first-order hold). A run at a
macro-step of `FINE_STEP` is the converged reference that longer ones are measured against.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from antenna_drive.emulator.kernels import of_drive
from antenna_drive.emulator.unit import FloatArray, Unit
from antenna_drive.emulator.units import BlockUnit, build, inner_steps, SourceUnit
from antenna_drive.emulator.wiring import DRIVE, Wiring
from antenna_drive.parameters.sets import Drive
import numpy as np
from simgap.errors import one_line
from simgap.inputs.schema import ParameterError, Value

MACRO_STEP = 1e-3
FINE_STEP = 2.5e-5

# What takes effect when: the step at which a change first counts, the unit, names and values.
Changes = Mapping[int, Mapping[str, Mapping[str, Value]]]

# Steps between two reports of progress, and between two looks at the statistics.
_CHUNK = 4096


@dataclass(frozen=True)
class Run:
    """
    What a run gave: value and time derivative of every signal at every kept macro-step.

    step_s : macro-step [s]
    steps : numbers of the kept macro-steps, shape (n,)
    names : the signals, 'unit/signal', in the order of the columns
    samples : shape (n, len(names), 2), value and time derivative, SI units, article amperes
    changes : the live changes that took effect, by step
    """

    step_s: float
    steps: np.ndarray[Any, np.dtype[np.int64]]
    names: tuple[str, ...]
    samples: FloatArray
    changes: Changes = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return two lines instead of the arrays: how much there is, and the signals."""
        steps = self.steps
        span = f' from {steps[0] * self.step_s:g} to {steps[-1] * self.step_s:g} s' if len(
            steps) else ''
        live = f', live changes: {len(self.changes)}' if self.changes else ''
        return (f'Run: {len(self.names)} signals, {len(steps)} steps of {self.step_s:g} s kept'
                f'{span}{live}\n  {one_line(", ".join(self.names), 96)}')

    @property
    def time(self) -> FloatArray:
        """Return the time of each kept macro-step [s], shape (n,)."""
        return np.asarray(self.steps * self.step_s, np.float64)

    def __getitem__(self, name: str) -> FloatArray:
        """Return the values of a signal, shape (n,); KeyError if there is none of that name."""
        if name not in self.names:
            raise KeyError(name)
        return self.samples[:, self.names.index(name), 0]

    def derivative(self, name: str) -> FloatArray:
        """Return the time derivative of a signal, shape (n,); KeyError as above."""
        if name not in self.names:
            raise KeyError(name)
        return self.samples[:, self.names.index(name), 1]


class Emulator:
    """
    A drive that can be stepped, changed while it runs, and run again.

    drive : parameters of the whole drive, a `wiring.parameters`
    step_s : macro-step [s]
    replaced : units of your own, by the name of the unit that each replaces
    wiring : which units there are and what feeds them, the drive's own unless said otherwise

    Raises ParameterError: the macro-step is not a positive number, a replaced unit does not exist,
    lacks an output, or wants an input that nobody puts out.
    """

    def __init__(self, drive: Drive, step_s: float = MACRO_STEP,
                 replaced: Mapping[str, Unit] | None = None, wiring: Wiring = DRIVE) -> None:
        if not 0.0 < step_s < np.inf:
            raise ParameterError(f'step_s: {step_s!r} given, allowed is a number above 0 s')
        replaced = dict(replaced or {})
        for name in replaced:
            if name not in wiring.units:
                raise ParameterError(f'{name}: no such unit, allowed are '
                                     f'{", ".join(wiring.units)}')
        self.step_s = step_s
        self._wiring = wiring
        self.units: dict[str, Unit] = {
            name: replaced.get(name) or build(name, drive, wiring=wiring)
            for name in wiring.units}
        self.names = tuple(f'{name}/{signal.name}' for name, unit in self.units.items()
                           for signal in unit.outputs)
        self._columns = {name: column for column, name in enumerate(self.names)}
        self._check_wiring()
        self._inputs = {name: np.array([self._columns[source] for source in unit.inputs], np.intp)
                        for name, unit in self.units.items()}
        self._outputs = {}
        first = 0
        for name, unit in self.units.items():
            self._outputs[name] = slice(first, first + len(unit.outputs))
            first += len(unit.outputs)
        self.restart()

    def _check_wiring(self) -> None:
        for name, unit in self.units.items():
            lacking = ({f'{name}/{signal.name}' for signal in self._wiring.outputs[name]
                        if signal.exchanged} - set(self.names))
            if lacking:
                raise ParameterError(f'{name}: lacks the output {min(lacking)}')
            for source in unit.inputs:
                if source not in self._columns:
                    raise ParameterError(f'{name}: no unit puts out its input {source}')

    def restart(self) -> None:
        """Return every unit to its initial state, at step 0; live changes stay in force."""
        self.k = 0
        self.now = np.zeros((len(self.names), 2))
        for name, unit in self.units.items():
            self.now[self._outputs[name]] = unit.start(self.step_s)

    def tune(self, changes: Mapping[str, Mapping[str, Value]]) -> None:
        """
        Change tuning parameters of units: all of them or, if one is refused, none.

        The next `step` is the first that they count for, as with a live change of a node.

        Raises ParameterError: as `Unit.tune`, or there is no such unit.
        """
        for name, settings in changes.items():
            if name not in self.units:
                raise ParameterError(f'{name}: no such unit, allowed are '
                                     f'{", ".join(self.units)}')
            self.units[name].check(settings)
        for name, settings in changes.items():
            self.units[name].tune(settings)

    def step(self) -> FloatArray:
        """Advance every unit by one macro-step; return all samples, shape (len(names), 2)."""
        after = np.empty_like(self.now)
        for name, unit in self.units.items():
            after[self._outputs[name]] = unit.step(self.k, self.now[self._inputs[name]])
        self.now = after
        self.k += 1
        return after

    def advance(self, count: int, every: int = 1) -> tuple[Any, FloatArray]:
        """
        Advance by many macro-steps.

        count : macro-steps
        every : keep the samples of the steps that this number divides

        Returns numbers of the kept steps, shape (n,), and their samples, shape (n, len(names), 2).
        """
        blocks = [unit for unit in self.units.values() if isinstance(unit, BlockUnit)]
        sources = [unit for unit in self.units.values() if not unit.inputs]
        if (len(sources) == 1 and len(blocks) + 1 == len(self.units)
                and self.names == self._wiring.signals):
            return self._advance_compiled(sources[0], blocks, count, every)
        steps, samples = [], []
        for _ in range(count):
            after = self.step()
            if self.k % every == 0:
                steps.append(self.k)
                samples.append(after)
        return (np.array(steps, np.int64),
                np.array(samples).reshape(-1, len(self.names), 2))

    def _advance_compiled(self, source: Unit, blocks: Sequence[BlockUnit], count: int,
                          every: int) -> tuple[Any, FloatArray]:
        if isinstance(source, SourceUnit):
            commands = source.ahead(self.k, count)
        else:
            commands = np.array([source.step(self.k + i, np.zeros((0, 2))) for i in range(count)]
                                ).reshape(count, len(source.outputs), 2)
        numbers = np.arange(self.k + 1, self.k + count + 1)
        numbers = numbers[numbers % every == 0]
        kept = np.empty((numbers.size, *self.now.shape))
        of_drive(self._wiring).advance(
            self.k, self.step_s, inner_steps(self.step_s), every, commands,
            self.now, np.empty_like(self.now), kept, tuple(unit.memory() for unit in blocks))
        self.k += count
        return numbers, kept

    def chunks(self, duration: float, changes: Changes | None = None, every: int = 1,
               ) -> Iterator[tuple[Any, FloatArray]]:
        """
        Run from the start and yield what `advance` gives, piece by piece.

        Memory does not grow with the duration if the caller keeps only what it needs.

        duration : [s], rounded to macro-steps
        changes : live changes by the step at which each takes effect: a change at step k is in
            force when the units go from k to k + 1
        every : keep the samples of the steps that this number divides
        """
        self.restart()
        total = round(duration / self.step_s)
        changes = dict(changes or {})
        self.tune(changes.get(0, {}))
        yield np.zeros(1, np.int64), self.now[np.newaxis].copy()
        stops = sorted({*(k for k in changes if 0 < k < total), total})
        for stop in stops:
            while self.k < stop:
                yield self.advance(min(_CHUNK, stop - self.k), every)
            if stop < total:
                self.tune(changes[stop])

    def run(self, duration: float, changes: Changes | None = None, every: int = 1,
            progress: Callable[[float], None] | None = None) -> Run:
        """
        Run from the start for a duration [s] and keep the samples; see `chunks`.

        duration, changes, every : as in `chunks`
        progress : called with the share that is done, from 0 to 1
        """
        steps, samples = [], []
        for numbers, values in self.chunks(duration, changes, every):
            steps.append(numbers)
            samples.append(values)
            if progress and duration > 0.0:
                progress(min(1.0, self.k * self.step_s / duration))
        return Run(self.step_s, np.concatenate(steps), self.names, np.concatenate(samples),
                   dict(changes or {}))


def simulate(drive: Drive, duration: float, step_s: float = MACRO_STEP,
             changes: Changes | None = None, every: int = 1, wiring: Wiring = DRIVE) -> Run:
    """
    Run a drive from rest in one process; see `Emulator` and `Emulator.run`.

    drive : parameters of the whole drive
    duration : [s]
    step_s : macro-step [s]
    changes : live changes by the step at which each takes effect
    every : keep the samples of the steps that this number divides
    wiring : which units there are and what feeds them
    """
    return Emulator(drive, step_s, wiring=wiring).run(duration, changes, every)
