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
"""The five units of the drive: the compiled physics behind the interface of `Unit`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
import math
from typing import Any, ClassVar

from antenna_drive.emulator import steps, wiring
from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.parameters.loading import check_waveform
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.schema import (
    check_changes, Entry, nearest, ParameterError, Value,
)
from antenna_drive.parameters.sets import changed, Drive, TestSignal, values
from antenna_drive.physics import motor_drive, structure, test_signal, torque_share
from antenna_drive.physics.integrator import work_space
import numpy as np

# Within a longer macro-step the fastest states are still integrated in steps of this length [s].
INNER_STEP = 1e-3


def inner_steps(step_s: float) -> int:
    """Return how many inner steps a macro-step [s] takes."""
    return max(1, math.ceil(step_s / INNER_STEP - 1e-9))


class _DriveUnit(Unit):
    """What our units share: a parameter set, its record, and names for its settings."""

    # The set whose parameters go by their bare names; others carry theirs: 'filter_1.gain'.
    _own: ClassVar[str] = ''

    def __init__(self, name: str, parameters: Any) -> None:
        super().__init__(name)
        self._set = parameters
        self._record = record_of(parameters)
        self._step_s = 0.0

    @property
    def parameters(self) -> Any:
        """Return the parameter set in force."""
        return self._set

    def _path(self, name: str) -> str:
        """Return the dotted name of a setting in the parameter set."""
        head = name.partition('.')[0]
        return name if not self._own or hasattr(self._set, head) else f'{self._own}.{name}'

    def settings(self) -> Mapping[str, tuple[Entry, Value]]:
        """Return every parameter of this unit: its name, what may be said of it, its value."""
        prefix = f'{self._own}.' if self._own else ''
        return {name.removeprefix(prefix): (entry, value)
                for name, entry, value in values(self._set)}

    def tune(self, changes: Mapping[str, Value]) -> None:
        """Change tuning parameters, all or none; see `Unit.tune`."""
        self._set = self._changed(changes)
        self._record[:] = record_of(self._set)

    def check(self, changes: Mapping[str, Value]) -> None:
        """Raise ParameterError if `changes` cannot be applied; change nothing."""
        self._changed(changes)

    def _changed(self, changes: Mapping[str, Value]) -> Any:
        entries = {name: entry for name, (entry, _) in self.settings().items()}
        checked = check_changes(changes, entries)
        return changed(self._set, {self._path(name): value for name, value in checked.items()})


class _SteppedUnit(_DriveUnit):
    """A unit with states of its own, advanced by its compiled physics."""

    _physics: ClassVar[Any]
    _advance: ClassVar[Any]

    def __init__(self, name: str, parameters: Any, states: int) -> None:
        super().__init__(name, parameters)
        self._x = np.zeros(states)
        self._mode = np.zeros(self._physics.MODES, np.int64)
        self._work = work_space(states)
        self._u = np.zeros((len(self.inputs), 2))
        self._y = np.zeros((len(self.outputs), 2))
        self._inner_steps = 1

    def memory(self) -> tuple[Any, ...]:
        """Return record, states, mode, inputs, work space and outputs, for a compiled loop."""
        return self._record, self._x, self._mode, self._u, self._work, self._y

    def start(self, step_s: float) -> FloatArray:
        """Return to the state at rest and give the outputs at t = 0; see `Unit.start`."""
        self._step_s = step_s
        self._inner_steps = inner_steps(step_s)
        self._physics.start(self._record[0], self._x, self._mode, self._y)
        return self._y.copy()

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Advance from t_k to t_k+1 and give the outputs there; see `Unit.step`."""
        self._advance(self._x, self._mode, inputs, self._record, self._step_s,
                      self._inner_steps, self._work, self._y)
        return self._y.copy()


class MotorDriveUnit(_SteppedUnit):
    """One motor with its amplifiers and its gearbox: G_o of Fig. 6."""

    inputs: ClassVar[tuple[str, ...]] = wiring.MOTOR_INPUTS
    outputs: ClassVar[tuple[Signal, ...]] = wiring.MOTOR_OUTPUTS
    _physics: ClassVar[Any] = motor_drive
    _advance: ClassVar[Any] = staticmethod(steps.motor_step)

    def __init__(self, name: str, drive: Drive) -> None:
        """Take motor_1's or motor_2's parameters, whichever `name` says."""
        super().__init__(name, getattr(drive, name), motor_drive.STATES)


class TorqueShareUnit(_SteppedUnit):
    """The torque-share circuit of Fig. 14 with Filter 1 behind it."""

    inputs: ClassVar[tuple[str, ...]] = wiring.INPUTS[wiring.TORQUE_SHARE]
    outputs: ClassVar[tuple[Signal, ...]] = wiring.TORQUE_SHARE_OUTPUTS
    _physics: ClassVar[Any] = torque_share
    _advance: ClassVar[Any] = staticmethod(steps.share_step)
    _own = 'circuit'

    def __init__(self, name: str, drive: Drive) -> None:
        """Take the torque share's parameters from the drive's."""
        super().__init__(name, drive.torque_share, torque_share.STATES)


class PlantUnit(_SteppedUnit):
    """The rate-loop plant: hub, flexible modes, axis friction, encoder; Fig. 4."""

    inputs: ClassVar[tuple[str, ...]] = wiring.INPUTS[wiring.PLANT]
    outputs: ClassVar[tuple[Signal, ...]] = wiring.PLANT_OUTPUTS
    _physics: ClassVar[Any] = structure
    _advance: ClassVar[Any] = staticmethod(steps.plant_step)
    _own = 'axis'

    def __init__(self, name: str, drive: Drive) -> None:
        """Take the plant's parameters from the drive's."""
        super().__init__(name, drive.plant,
                         structure.states(len(drive.plant.axis.mode_inertias)))


class TestSignalUnit(_DriveUnit):
    """The test signals: the axis rate command, and a torque on the axis."""

    __test__ = False  # not a test case, whatever its name suggests to pytest

    outputs: ClassVar[tuple[Signal, ...]] = wiring.TEST_SIGNAL_OUTPUTS
    _own = 'rate'
    # A change of one of these goes on within the waveform; any other begins it anew.
    _SCALES = ('amplitude', 'offset', 'external')

    def __init__(self, name: str, drive: Drive) -> None:
        """Take the test signal's parameters from the drive's."""
        super().__init__(name, drive.test_signal)
        self._bits = _bits_for(self._set)
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
        self._bits = _bits_for(self._set)
        for name in changes:
            part, _, key = self._path(name).partition('.')
            if part in ('rate', 'torque') and key not in self._SCALES:
                self._origins[0 if part == 'rate' else 1] = self._next * self._step_s

    def ahead(self, k: int, count: int) -> FloatArray:
        """
        Give the test signals at t_k+1 and the macro-steps after it, as `step` would.

        Returns
        -------
        array of shape (count, 2, 2): value and derivative of each output at each step

        """
        self._next = k + count + 1
        return self._sample(k + 1, count)

    def _sample(self, first: int, count: int) -> FloatArray:
        y = np.zeros((count, len(self.outputs), 2))
        steps.sample_signals(first, count, self._step_s, self._origins, self._record,
                             self._bits, y)
        return y

    def _changed(self, changes: Mapping[str, Value]) -> Any:
        parameters = super()._changed(changes)
        check_waveform(parameters.rate, 'rate')
        check_waveform(parameters.torque, 'torque')
        _bits_for(parameters)  # in the thread that asks first, not in the one that steps
        return parameters


_NO_BITS = np.ones(1)
_prbs_bits = cache(test_signal.prbs_bits)


def _bits_for(parameters: TestSignal) -> FloatArray:
    """Return the binary sequence if a waveform needs it: to make it imports half of scipy."""
    kinds = (parameters.rate.waveform, parameters.torque.waveform)
    return _prbs_bits() if 'prbs' in kinds else _NO_BITS


_UNITS: dict[str, type[Any]] = {
    wiring.TEST_SIGNAL: TestSignalUnit,
    **dict.fromkeys(wiring.MOTORS, MotorDriveUnit),
    wiring.TORQUE_SHARE: TorqueShareUnit,
    wiring.PLANT: PlantUnit,
}


def home(parameter: str) -> tuple[str, str]:
    """
    Return the unit that a parameter of `Drive` belongs to, and its name there.

    'torque_share.circuit.bias_pot' is the setting bias_pot of the unit torque_share.

    Raises
    ------
    KeyError : there is no such unit

    """
    name, _, rest = parameter.partition('.')
    own = _UNITS[name]._own
    return name, rest.removeprefix(f'{own}.') if own else rest


def overridden(drive: Drive, overrides: Mapping[str, Mapping[str, Value]]) -> Drive:
    """
    Return the drive with settings of its units changed, constants too.

    Parameters
    ----------
    drive
        the parameters of the whole drive
    overrides
        values by unit and by the name that the unit's setting has

    Raises
    ------
    ParameterError : see `build`

    """
    sets = {name: build(name, drive, given).parameters  # type: ignore[attr-defined]
            for name, given in overrides.items()}
    return replace(drive, **sets)


def build(name: str, drive: Drive, overrides: Mapping[str, Value] | None = None) -> Unit:
    """
    Build one of the drive's units.

    Parameters
    ----------
    name
        one of wiring.UNITS
    drive
        the parameters of the whole drive
    overrides
        settings of the unit, constants too, that differ from the drive's

    Raises
    ------
    KeyError : there is no unit of that name
    ParameterError : an override is unknown or its value is not allowed

    """
    unit = _UNITS[name](name, drive)
    if overrides:
        settings = unit.settings()
        for key in overrides:
            if key not in settings:
                raise ParameterError(f'{key}: no such parameter{nearest(key, tuple(settings))}')
        # the drive calls each unit's set by the unit's name
        unit = _UNITS[name](name, changed(drive, {
            f'{name}.{unit._path(key)}': settings[key][0].check(key, value)
            for key, value in overrides.items()}))
        unit.check({})
    result: Unit = unit
    return result
