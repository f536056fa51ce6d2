# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The units of a wiring: their compiled physics behind the interface of `Unit`."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
import math
from typing import Any

from antenna_drive.emulator.kernels import of_unit
from antenna_drive.emulator.unit import check_changes, FloatArray, Unit
from antenna_drive.emulator.wiring import DRIVE, Wired, Wiring
from antenna_drive.parameters.loading import check_waveform
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed, Drive, values
from antenna_drive.parameters.waveforms import TestSignal
from antenna_drive.physics import signal_generator
from antenna_drive.physics.block import Block, Source
from antenna_drive.physics.integrator import work_space
import numpy as np
from simgap.inputs.schema import Entry, nearest, ParameterError, Value

# Within a longer macro-step the fastest states are still integrated in steps of this length [s].
INNER_STEP = 1e-3


def inner_steps(step_s: float) -> int:
    """Return how many inner steps a macro-step [s] takes."""
    return max(1, math.ceil(step_s / INNER_STEP - 1e-9))


class _DriveUnit(Unit):
    """What our units share: a parameter set, its record, and names for its settings."""

    def __init__(self, name: str, wired: Wired, parameters: Any) -> None:
        super().__init__(name)
        self.inputs = wired.sources  # type: ignore[misc]
        self.outputs = wired.interface.outputs  # type: ignore[misc]
        # The set whose parameters go by their bare names; others carry theirs: 'filter_1.gain'.
        self._bare = wired.interface.bare
        self.parameters = parameters  # in force
        self._record = record_of(parameters)
        self._step_s = 0.0

    def _path(self, name: str) -> str:
        """Return the dotted name of a setting in the parameter set."""
        head = name.partition('.')[0]
        return name if not self._bare or hasattr(self.parameters, head) else f'{self._bare}.{name}'

    def settings(self) -> Mapping[str, tuple[Entry, Value]]:
        """Return every parameter of this unit: its name, what may be said of it, its value."""
        prefix = f'{self._bare}.' if self._bare else ''
        return {name.removeprefix(prefix): (entry, value)
                for name, entry, value in values(self.parameters)}

    def tune(self, changes: Mapping[str, Value]) -> None:
        """Change tuning parameters, all or none; see `Unit.tune`."""
        self.parameters = self._changed(changes)
        self._record[:] = record_of(self.parameters)

    def check(self, changes: Mapping[str, Value]) -> None:
        """Raise ParameterError if `changes` cannot be applied; change nothing."""
        self._changed(changes)

    def _changed(self, changes: Mapping[str, Value]) -> Any:
        entries = {name: entry for name, (entry, _) in self.settings().items()}
        checked = check_changes(changes, entries)
        return changed(self.parameters, {
            self._path(name): value for name, value in checked.items()})


class BlockUnit(_DriveUnit):
    """A unit with states of its own, advanced by its compiled physics."""

    def __init__(self, name: str, wired: Wired, parameters: Any) -> None:
        """Take the unit's place in the wiring, and its parameter set."""
        super().__init__(name, wired, parameters)
        assert isinstance(wired.interface, Block)
        self.block = wired.interface
        kernels = of_unit(self.block)
        self._start, self._step = kernels.start.dispatcher, kernels.step.dispatcher
        states = self.block.count_states(self._record[0])
        self._x = np.zeros(states)
        self._mode = np.zeros(len(self.block.modes), np.int64)
        self._work = work_space(states)
        self._u = np.zeros((len(self.inputs), 2))
        self._y = np.zeros((len(self.outputs), 2))
        self._inner_steps = 1

    def memory(self) -> tuple[Any, ...]:
        """Return record, states, modes, inputs, work space and outputs, for a compiled loop."""
        return self._record, self._x, self._mode, self._u, self._work, self._y

    def start(self, step_s: float) -> FloatArray:
        """Return to the state at rest and give the outputs at t = 0; see `Unit.start`."""
        self._step_s = step_s
        self._inner_steps = inner_steps(step_s)
        self._start(self._record, self._x, self._mode, self._u, self._y)
        return self._y.copy()

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Advance from t_k to t_k+1 and give the outputs there; see `Unit.step`."""
        self._step(self._x, self._mode, inputs, self._record, self._step_s,
                   self._inner_steps, self._work, self._y)
        return self._y.copy()


class SourceUnit(_DriveUnit):
    """The test signals: the axis rate command, and a torque on the axis."""

    # A change of one of these goes on within the waveform; any other begins it anew.
    _SCALES = ('amplitude', 'offset', 'external')

    def __init__(self, name: str, wired: Wired, parameters: TestSignal) -> None:
        """Take the unit's place in the wiring, and its parameter set."""
        super().__init__(name, wired, parameters)
        self._bits = _bits_for(self.parameters)
        self._origins = np.zeros(2)
        self._next = 0

    def start(self, step_s: float) -> FloatArray:
        """Begin the waveforms and give their first values; see `Unit.start`."""
        self._step_s = step_s
        self._origins[:] = 0.0
        self._next = 1
        return self._sample(0, 1)[0]

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Give the test signals at t_k+1; there are no inputs."""
        self._next = k + 2
        return self._sample(k + 1, 1)[0]

    def tune(self, changes: Mapping[str, Value]) -> None:
        """
        Change tuning parameters, all or none; see `Unit.tune`.

        A new amplitude or offset scales the waveform where it is; any other change begins it
        anew at the step at which it takes effect.
        """
        super().tune(changes)
        self._bits = _bits_for(self.parameters)
        for name in changes:
            part, _, key = self._path(name).partition('.')
            if part in ('rate', 'torque') and key not in self._SCALES:
                self._origins[0 if part == 'rate' else 1] = self._next * self._step_s

    def memory(self) -> tuple[Any, ...]:
        """Return the waveforms' origins, record and bits, for a compiled loop."""
        return self._origins, self._record, self._bits

    def reached(self, k: int) -> None:
        """Note that a compiled loop has given the test signals up to t_k."""
        self._next = k + 1

    def ahead(self, k: int, count: int) -> FloatArray:
        """
        Give the test signals at t_k+1 and the macro-steps after it, as `step` would.

        Returns an array of shape (count, 2, 2): value and derivative of each output at each step.
        """
        self._next = k + count + 1
        return self._sample(k + 1, count)

    def _sample(self, first: int, count: int) -> FloatArray:
        y = np.zeros((count, len(self.outputs), 2))
        signal_generator.sample(first, count, self._step_s, self._origins, self._record,
                                self._bits, y)
        return y

    def _changed(self, changes: Mapping[str, Value]) -> Any:
        parameters = super()._changed(changes)
        check_waveform(parameters.rate, 'rate')
        check_waveform(parameters.torque, 'torque')
        _bits_for(parameters)  # in the thread that asks first, not in the one that steps
        return parameters


_NO_BITS = np.ones(1)
_prbs_bits = cache(signal_generator.prbs_bits)


def _bits_for(parameters: TestSignal) -> FloatArray:
    """Return the binary sequence if a waveform needs it: to make it imports half of scipy."""
    kinds = (parameters.rate.waveform, parameters.torque.waveform)
    return _prbs_bits() if 'prbs' in kinds else _NO_BITS


def home(parameter: str) -> tuple[str, str]:
    """
    Return the unit that a parameter of `Drive` belongs to, and its name there.

    'torque_share.circuit.bias_pot' is the setting bias_pot of the unit torque_share.

    Raises KeyError: there is no such unit.
    """
    name, _, rest = parameter.partition('.')
    bare = DRIVE.units[name].interface.bare
    return name, rest.removeprefix(f'{bare}.') if bare else rest


def overridden(drive: Drive, overrides: Mapping[str, Mapping[str, Value]]) -> Drive:
    """
    Return the drive with settings of its units changed, constants too.

    drive : the parameters of the whole drive
    overrides : values by unit and by the name that the unit's setting has

    Raises ParameterError: see `build`.
    """
    sets = {name: build(name, drive, given).parameters  # type: ignore[attr-defined]
            for name, given in overrides.items()}
    return replace(drive, **sets)


def build(name: str, drive: Drive, overrides: Mapping[str, Value] | None = None,
          wiring: Wiring = DRIVE) -> Unit:
    """
    Build one of the units of a wiring.

    name : one of wiring.units
    drive : the parameters of the whole drive, a `wiring.parameters`
    overrides : settings of the unit, constants too, that differ from the drive's
    wiring : the drive's own unless said otherwise

    Raises KeyError: there is no unit of that name.
    Raises ParameterError: an override is unknown or its value is not allowed; the wiring says what
    the unit looks like but not what it does.
    """
    wired = wiring.units[name]
    if isinstance(wired.interface, Block):
        kind: Any = BlockUnit
    elif isinstance(wired.interface, Source):
        kind = SourceUnit
    else:
        raise ParameterError(f'{name}: has no physics of its own, give a unit in its place')
    unit = kind(name, wired, getattr(drive, name))
    if overrides:
        settings = unit.settings()
        for key in overrides:
            if key not in settings:
                raise ParameterError(f'{key}: no such parameter{nearest(key, tuple(settings))}')
        unit = kind(name, wired, changed(unit.parameters, {
            unit._path(key): settings[key][0].check(key, value)
            for key, value in overrides.items()}))
        unit.check({})
    return unit
