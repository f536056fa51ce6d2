# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The emulator behind the variables of an FMU.

Inputs are added to what the test signal commands, and have a slope until the next step. Parameters
are parameters.UNIT.SETTING, as `--set` has them, and effects.COMPONENT.EFFECT.NUMBER, as the
catalogue has them. Outputs are UNIT.SIGNAL.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

from antenna_drive.emulator.run import Emulator
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.units import build, overridden
from antenna_drive.emulator.wiring import DRIVE, TEST_SIGNAL
from antenna_drive.fmu.effects import numbers, with_effects
from antenna_drive.parameters.sets import Drive
import numpy as np
from simgap.inputs.schema import Entry, ParameterError, Value

INPUT, OUTPUT, PARAMETER = 'input', 'output', 'parameter'
_SETTING, _EFFECT = 'parameters.', 'effects.'
# What is commanded: the first signals of all.
_COMMANDS = DRIVE.outputs[TEST_SIGNAL]
_ROWS = slice(len(_COMMANDS))
# Times are rounded: a step may differ from whole macro-steps by this share of one.
_ROUNDED = 1e-3


class Variable(NamedTuple):
    """A variable of the FMU: its causality, what may be said of it, and where it starts."""

    causality: str
    entry: Entry
    start: Value = 0.0


def _variables(drive: Drive) -> Iterator[tuple[str, Variable]]:
    for signal in _COMMANDS:
        yield signal.name, Variable(INPUT, Entry(
            signal.unit, description=f'{signal.description}, added to the test signal'))
        yield f'{signal.name}_slope', Variable(INPUT, Entry(
            signal.rate_unit, description=f'slope of {signal.name} until the next step'))
    for unit, signals in DRIVE.outputs.items():
        for signal in signals:
            yield f'{unit}.{signal.name}', Variable(OUTPUT, Entry(
                signal.unit, description=signal.description))
        for name, (entry, value) in build(unit, drive).settings().items():
            if entry.unit == 'SI':
                entry = replace(entry, unit=_COMMANDS[name.startswith('torque.')].unit)
            parts = {name: value} if not isinstance(value, tuple) else {
                f'{name}[{i}]': item for i, item in enumerate(value, 1)}
            for part, item in parts.items():
                yield f'{_SETTING}{unit}.{part}', Variable(
                    PARAMETER, replace(entry, lengths=None), item)
    for name, (entry, start) in numbers().items():
        yield f'{_EFFECT}{name}', Variable(PARAMETER, entry, start)


class SteppedDrive:
    """
    A drive that is set, stepped and read by the names of its variables.

    drive : as configured; its numbers are where the parameters start
    step_s : macro-step [s]
    """

    def __init__(self, drive: Drive, step_s: float) -> None:
        self.variables = dict(_variables(drive))
        self._values = {name: item.start for name, item in self.variables.items()}
        self._rows = {name.replace('/', '.'): row for row, name in enumerate(DRIVE.signals)}
        self._drive, self._step_s = drive, step_s
        self._begun = self._changed = False
        self._own: FloatArray  # what the test signal itself puts out
        self._begin(drive)
        # inputs by the macro-step from which on they count, as far back as the command is late
        self._given: deque[tuple[int, FloatArray]] = deque()

    def get(self, name: str) -> Value:
        """Return the value of a variable; ParameterError if the parameters do not fit."""
        if name in self._rows:
            return float(self._current().now[self._rows[name], 0])
        return self._values[name]

    def set(self, name: str, value: Value) -> None:  # noqa: A003
        """Set an input or a parameter for the next step; ParameterError if it is not allowed."""
        causality, entry, _ = self.variables[name]
        checked = entry.check(name, value)
        if causality == PARAMETER and checked != self._values[name]:
            if self._begun and not entry.live:
                raise ParameterError(f'{name}: fixed while the drive runs, set it before')
            self._changed = True
        self._values[name] = checked

    def step(self, step_s: float) -> None:
        """
        Go on by a communication step [s].

        Raises ParameterError: it is no multiple of the macro-step, or the parameters do not fit.
        """
        count = round(step_s / self._step_s)
        if count < 1 or abs(step_s / self._step_s - count) > _ROUNDED:
            raise ParameterError(f'communication step: {step_s!r} s given, allowed are whole '
                                 f'multiples of the macro-step, {self._step_s:g} s')
        emulator = self._current()
        self._begun = True
        self._given.append((emulator.k, np.array([
            [self._values[signal.name], self._values[f'{signal.name}_slope']]
            for signal in _COMMANDS])))
        for _ in range(count):
            emulator.now[_ROWS] = self._own + self._commanded()
            self._own = emulator.step()[_ROWS].copy()
        emulator.now[_ROWS] += self._commanded()

    def _commanded(self) -> FloatArray:
        """Return value and slope of the inputs now, as late as the command is."""
        late = self._emulator.k - self._delay_s / self._step_s
        while len(self._given) > 1 and self._given[1][0] <= late + _ROUNDED:
            self._given.popleft()
        since, given = self._given[0]
        if since > late + _ROUNDED:
            return np.zeros_like(given)
        return given + np.outer(given[:, 1], [self._step_s * (late - since), 0.0])

    def _current(self) -> Emulator:
        """Return the emulator with the parameters as they were set."""
        if self._changed:
            drive = with_effects(overridden(self._drive, self._settings()), {
                name.removeprefix(_EFFECT): value for name, value in self._values.items()
                if name.startswith(_EFFECT) and isinstance(value, float)})
            if not self._begun:
                self._begin(drive)
            for name, unit in self._emulator.units.items():
                before = unit.settings()
                unit.tune({key: value for key, (_, value) in build(name, drive).settings().items()
                           if value != before[key][1]})
            self._changed = False
        return self._emulator

    def _begin(self, drive: Drive) -> None:
        self._emulator = Emulator(drive, self._step_s)
        self._own = self._emulator.now[_ROWS].copy()
        self._delay_s = drive.test_signal.delay

    def _settings(self) -> dict[str, dict[str, Any]]:
        """Return the settings by unit and name; the items of a list stand in their order."""
        found: dict[str, dict[str, Any]] = {}
        for name, value in self._values.items():
            if name.startswith(_SETTING):
                unit, _, key = name.removeprefix(_SETTING).partition('.')
                key, item, _ = key.partition('[')
                settings = found.setdefault(unit, {})
                settings[key] = (*settings.get(key, ()), value) if item else value
        return found
