# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A model of one's own and the logs of its tests, as a `Machine` of the diagnosis."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
import math
from threading import RLock
import traceback
from typing import Any

import numpy as np
from simgap.errors import UserError
from simgap.inputs.schema import nearest
from simgap.logs.log import beginning, Log, LogError, OneTest
from simgap.machine.contract import (
    Course, DisturbanceInput, Experiment, FloatArray, Machine, Motion, Parameter, Point,
    TimeScales,
)
from simgap.machine.diagram import Diagram
from simgap.model.declared import Angle, Model, ModelError, Number, Numbers, Reading
from simgap.model.effects import absent, ORDER_MARK, OwnCatalogue

# Samples of a test that are compared unless the model says how many per second.
_SAMPLES = 3000
_MOST_PULSES = 1000  # of a push in the longest test: memory grows with their square
# Units of positions; with '/s' they are those of rates.
_POSITIONS = ('rad', 'mrad', 'deg', 'turn', 'rev', 'm', 'mm', 'um')


class OwnMachine(Machine):
    """A model, see `declaration.machine`, in its logs; LogError if one lacks a reading."""

    def __init__(self, model: Model, logs: Sequence[Log]) -> None:
        self.model = model
        self.logs = [model.log(log) if model.log else log for log in logs]
        self._strides = [_stride(log, model.judged_hz) for log in self.logs]
        self._lock: AbstractContextManager[Any] = nullcontext() if model.parallel else RLock()
        self._values = {
            **{name: item.value for name, item in (*model.base.items(), *model.per_test.items())},
            **{name: value for effect in model.effects for name, value in absent(effect)}}
        super().__init__([self._experiment(log, stride) for log, stride
                          in zip(self.logs, self._strides, strict=True)],
                         self._nuisances(), OwnCatalogue(model.effects, self._angles))
        # which number, and of which test, each parameter stands for
        self._places: dict[str, tuple[str, int | None]] = {
            **{name: (name, None) for name in model.base},
            **{f'{name}[{log.name}]': (name, k) for name in model.per_test
               for k, log in enumerate(self.logs)},
            **{f'{item.name}.{name}': (name, None) for item in model.effects
               for name, _ in absent(item)}}
        self.disturbance_inputs = tuple(
            DisturbanceInput(item.label, item.component, unit=item.unit, size=item.size,
                             everyday=item.everyday / item.size)
            for item in model.push.values())
        self.advice = tuple(((), text) for text in model.advice)
        self.diagram = _diagram(model)

    def numbers(self, point: Point, experiment: int) -> Numbers:
        """Return the numbers of the simulation in one test at a point of the diagnosis."""
        values = dict(self._values)
        for full, change in point.items():
            name, _, order = full.partition(ORDER_MARK)
            number, test = self._places.get(full) or self._places.get(name) or ('', None)
            if not number or test not in (None, experiment):
                continue  # an error of a reading, or of another test
            values[number] = change
            if number in self.model.base or number in self.model.per_test:
                values[number] += self._values[number]
            if order:
                values[number.rpartition('_')[0] + '_order'] = float(order)
        return Numbers(values)

    def number_of(self, parameter: str) -> str:
        """Return which number of the simulation a parameter is or changes; '' for none."""
        name = parameter.partition(ORDER_MARK)[0]
        return (self._places.get(parameter) or self._places.get(name) or ('', None))[0]

    def _nuisances(self) -> list[Parameter]:
        found = [_offset(name, item) for name, item in self.model.base.items()
                 if not item.is_known]
        for k, log in enumerate(self.logs):
            found += [_offset(f'{name}[{log.name}]', item, k)
                      for name, item in self.model.per_test.items() if not item.is_known]
        for name, item in self.model.readings.items():
            if item.gain > 0.0:
                found.append(_error_of_reading(f'gain of {name}', '1', item.gain, None))
            if item.zero > 0.0:
                found += [_error_of_reading(f'zero of {name}[{log.name}]', item.unit, item.zero,
                                            k) for k, log in enumerate(self.logs)]
        return found

    def predict(self, point: Point, experiment: int) -> FloatArray:
        return self.pushed(point, experiment, {})

    def predict_until(self, point: Point, experiment: int, until: float) -> FloatArray:
        return self.pushed(point, experiment, {}, until)

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        name = self.push_at(place.name)
        return [self.pushed(point, k, {name: self.model.push[name].size * course(log.time)})
                for k, (log, course) in enumerate(zip(self.logs, courses, strict=True))]

    def push_at(self, label: str) -> str:
        """Return the name of the place with a label."""
        return next(name for name, item in self.model.push.items() if item.label == label)

    def pushed(self, point: Point, experiment: int, push: Mapping[str, FloatArray],
               until: float = math.inf) -> FloatArray:
        """Return a test's readings with pushes by place and sample, NaN later than `until` [s]."""
        log = self.logs[experiment]
        part = beginning(log, until) if math.isfinite(until) else log
        count = part.time.size
        still = np.zeros(count)
        test = OneTest(part, {name: push.get(name, still)[:count] for name in self.model.push})
        readings = self.simulated(self.numbers(point, experiment), test)
        columns = []
        for name, item in self.model.readings.items():
            values = np.full(log.time.size, np.nan)
            values[:count] = readings[name]
            if item.gain > 0.0:
                values *= 1.0 + point.get(f'gain of {name}', 0.0)
            if item.zero > 0.0:
                values += point.get(f'zero of {name}[{log.name}]', 0.0)
            columns.append(values[::self._strides[experiment]])
        return np.column_stack(columns)

    def simulated(self, numbers: Numbers, test: OneTest) -> dict[str, FloatArray]:
        """Return the model's checked readings, shape (n,) each; ModelError if it failed."""
        try:
            with self._lock:
                found = self.model.simulate(numbers, test)
        except UserError:
            raise
        except Exception as error:
            raise ModelError(f'simulate({test.name}): {_place(error)}{type(error).__name__}: '
                             f'{error}') from error
        return _checked(found, self.model.readings, test)

    @property
    def time_scales(self) -> TimeScales:
        longest = max(float(e.time[-1] - e.time[0]) for e in self.experiments)
        settles = self.model.settles_s
        if settles is None:
            return TimeScales.of_duration(longest)
        return TimeScales(start_s=settles, scan_s=min(longest, max(20.0 * settles,
                                                                   0.27 * longest)),
                          pulse_s=max(0.1 * settles, longest / _MOST_PULSES),
                          response_s=settles, block_s=settles)

    def offered(self, experiment: int) -> Mapping[str, tuple[str, FloatArray]]:
        log, stride = self.logs[experiment], self._strides[experiment]
        return {name: (unit, log[name][::stride]) for name, unit in self.model.along.items()}

    def _angles(self, angle: Angle) -> list[FloatArray]:
        """Return an angle in each test at its judged samples [rad]."""
        return [angle(log)[::stride] for log, stride in zip(self.logs, self._strides, strict=True)]

    def motion(self, experiment: int) -> Motion:
        """Return the motion by the first reading whose unit is that of a position or a rate."""
        time, measured = self.experiments[experiment].time, self.experiments[experiment].measured
        angle, rate, units = None, None, {}
        for item, column in zip(self.model.readings.values(), measured.T, strict=True):
            unit, per_second, _ = item.unit.partition('/s')
            if unit in _POSITIONS:
                rate = column
                units = {'rate': f'{unit}/s', 'angle': unit}
                if not per_second:
                    angle, rate = rate, np.gradient(rate, time)
                break
        return Motion(time, rate=rate, angle=angle, units=units,
                      reversal_s=min(0.4, 2.0 * self.time_scales.start_s))

    def _experiment(self, log: Log, stride: int) -> Experiment:
        columns = []
        for name, item in self.model.readings.items():
            column = item.column or name
            if column not in log.columns:
                raise LogError(f'{log.name}: no column {column} for the reading {name}'
                               f'{nearest(column, log.columns)}; there are '
                               f'{", ".join(log.columns)}')
            columns.append(log.columns[column][::stride])
        measured = np.column_stack(columns)
        readings = self.model.readings.values()
        errors = [np.nan if item.model_error is None else item.model_error for item in readings]
        usual = 3e-3 * np.nanstd(measured, axis=0)
        return Experiment(
            log.name, log.time[::stride], tuple(self.model.readings),
            tuple(item.unit for item in readings), measured,
            np.tile([item.sigma for item in readings], (len(measured), 1)),
            model_error=np.where(np.isnan(errors), usual, errors), labels=log.labels)


def _stride(log: Log, judged_hz: float | None) -> int:
    """Return every how many samples of a log one is compared."""
    if judged_hz is None:
        return max(1, math.ceil(log.time.size / _SAMPLES))
    return max(1, round(1.0 / judged_hz / float(np.median(np.diff(log.time)))))


def _offset(name: str, item: Number, experiment: int | None = None) -> Parameter:
    return Parameter(name, item.unit, item.low - item.value, item.high - item.value,
                     item.quotient_step, item.sigma, experiment, least_step=item.step,
                     spread=item.spread, configured=item.value)


def _error_of_reading(name: str, unit: str, by: float, experiment: int | None) -> Parameter:
    return Parameter(name, unit, -by, by, 0.01 * by, 0.5 * by, experiment)


def _diagram(model: Model) -> Diagram:
    """Return the blocks in the order of the signal, each with a line to the next."""
    found = Diagram.of([*model.blocks, *(effect.component for effect in model.effects),
                        *(item.component for item in model.push.values())] or model.readings)
    chain = found.blocks[:len(dict.fromkeys(model.blocks))]
    middle = 0.5 * Diagram.height
    lines = []
    for one, other in zip(chain, chain[1:], strict=False):
        if other.y == one.y:
            lines.append((one.x + one.width, one.y + middle, other.x, other.y + middle))
        else:
            lines.append((one.x + 0.5 * one.width, one.y + Diagram.height,
                          other.x + 0.5 * other.width, other.y))
    return Diagram(found.blocks, tuple(lines))


def _checked(found: object, readings: Mapping[str, Reading],
             test: OneTest) -> dict[str, FloatArray]:
    """Return what a simulation gave as arrays of shape (n,)."""
    if not isinstance(found, Mapping):
        raise ModelError(f'simulate({test.name}): {type(found).__name__} returned, allowed is a '
                         f'mapping from {", ".join(readings)} to arrays')
    if set(found) != set(readings):
        missing = [name for name in readings if name not in found]
        further = [str(name) for name in found if name not in readings]
        raise ModelError(f'simulate({test.name}): '
                         + ' and '.join([f'{name} is missing' for name in missing]
                                        + [f'{name} is not in readings' for name in further]))
    arrays = {}
    for name in readings:
        values = np.asarray(found[name], float)
        if values.shape != test.time.shape:
            raise ModelError(f'simulate({test.name}): {name}: shape {values.shape} returned, '
                             f'allowed is {test.time.shape}, one value for each of test.time')
        arrays[name] = values
    return arrays


def _place(error: Exception) -> str:
    """Return the line of the user's file that an error came from."""
    inner = [frame for frame in traceback.extract_tb(error.__traceback__)
             if frame.filename != __file__]
    return f'line {inner[0].lineno}: ' if inner else ''
