# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A position-controlled servo with a pendulum as a `Machine`: logs in, predicted readings out."""

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
import math

from lab.servo import catalogue
from lab.servo.log import CHANNELS, POSITION, ServoLog, UNITS
from lab.servo.physics import GRAVITY
import numpy as np
from simgap.machine.contract import (
    Effect, Experiment, FloatArray, Form, Machine, Motion, Parameter, Point, TimeScales,
)

# Where the model errs, neighbouring samples err alike. This many a second are judged.
JUDGED_HZ = 20.0


class ServoMachine(Machine):
    """
    A servo in the tests that were logged.

    The model's numbers are `values`, without any offset; those not named are absent. The `free`
    ones are fitted beside any effect. Effects in `without` are not considered. `noise` is the
    standard deviation of a perfect model's residuals in position [rad], speed [rad/s] and duty;
    None for the sensors' steps alone. `threads` is how many runs are simulated at once.
    """

    time_scales = TimeScales(start_s=1.5, scan_s=8.0, pulse_s=0.15, response_s=1.5, block_s=1.0)

    def __init__(self, logs: Sequence[ServoLog], values: Mapping[str, float],
                 free: Sequence[str], without: Iterable[str] = (),
                 noise: Sequence[float] | None = None, threads: int = 1) -> None:
        """Prepare the experiments and the catalogue of absent effects."""
        # a pool of one thread would only add waiting
        self._executor = ThreadPoolExecutor(threads) if threads > 1 else None
        self.logs = list(logs)
        self.values = dict(values)
        self._strides = [max(1, round(1.0 / JUDGED_HZ / float(np.median(np.diff(log.time)))))
                         for log in self.logs]
        super().__init__(
            [_experiment(log, stride, noise)
             for log, stride in zip(self.logs, self._strides, strict=True)],
            [self._offset(name) for name in free],
            [Effect(effect.id, effect.component, effect.cause, forms)
             for effect in catalogue.catalogue(without).values()
             if (forms := tuple(_absent(effect.forms, self.values)))])

    def _offset(self, name: str) -> Parameter:
        """Return a number of the model as an offset from its value or from its logarithm."""
        item, value = catalogue.number(name), self.values[name]
        if item.logarithmic:
            return Parameter(name, '1', math.log(item.low / value), math.log(item.high / value),
                             item.step)
        return Parameter(name, catalogue.unit(name), item.low - value, item.high - value,
                         item.step)

    def numbers(self, point: Point) -> dict[str, float]:
        """Return the servo's numbers at a point: offsets added, effects as they are."""
        values = dict(self.values)
        for name, value in point.items():
            if name not in self.values:
                values[name] = value
            elif catalogue.number(name).logarithmic:
                values[name] = self.values[name] * math.exp(value)
            else:
                values[name] = self.values[name] + value
        return values

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the readings of one log at its judged samples; see `Machine.predict`."""
        row = catalogue.vector(self.numbers(point))
        return self.logs[experiment].readings(row)[::self._strides[experiment]]

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """Return the readings of several variants, in threads; see `Machine.simulate`."""
        if self._executor is None:
            return super().simulate(points, only, until)
        rows = self._executor.map(
            lambda item: super(ServoMachine, self).simulate([item[0]], [item[1]], until)[0],
            zip(points, only or [None] * len(points), strict=True))
        return list(rows)

    def motion(self, experiment: int) -> Motion:
        """Return the motion as it was measured, at the judged samples."""
        log, time = self.logs[experiment], self.experiments[experiment].time
        position = log.measured[::self._strides[experiment], POSITION]
        return Motion(time, rate=np.gradient(position, time),
                      load=log.mass * GRAVITY * log.length * np.sin(position), angle=position)


def _experiment(log: ServoLog, stride: int, noise: Sequence[float] | None) -> Experiment:
    if noise is None:
        noise = (log.steps / math.sqrt(3.0)).tolist()
    measured = log.measured[::stride]
    return Experiment(log.name, log.time[::stride], CHANNELS, UNITS, measured,
                      np.broadcast_to(np.asarray(noise, float), measured.shape).copy())


def _absent(forms: Sequence[Form], present: Mapping[str, float]) -> Iterable[Form]:
    """Yield the forms that the model lacks in part, without the numbers that it has."""
    taken = {name for item in present for name in (item, *catalogue.TIED.get(item, ()))}
    waves = {catalogue.base_name(name) for name in present if catalogue.CYCLES_MARK in name}
    for form in forms:
        own = form.parameters
        if any(p.name in taken and not p.is_shape for p in own):
            continue
        # the physics has one wave of each kind
        if any(catalogue.base_name(p.name) in waves for p in own):
            continue
        if any(name in taken for p in own for name in catalogue.TIED.get(p.name, ())):
            continue
        yield Form(form.name, tuple(p for p in own if p.name not in taken))
