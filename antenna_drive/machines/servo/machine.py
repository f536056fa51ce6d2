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
"""A position-controlled servo with a pendulum as a `Model`: logs in, predicted readings out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
import math

from antenna_drive.diagnosis.machine import (
    Effect, Entry, Experiment, FloatArray, Form, Input, Motion, Parameter, Point,
)
from antenna_drive.errors import UserError
from antenna_drive.machines.servo import catalogue as servo_catalogue
from antenna_drive.machines.servo.physics import GRAVITY, swing
from antenna_drive.recording.recording import Recording
import numpy as np

CHANNELS = ('position', 'speed', 'duty')
UNITS = ('rad', 'rad/s', '1')
POSITION, SPEED, DUTY = range(3)
STEP_S = 2.8e-3
# Neighbouring samples err alike when it is the model that errs: so many a second are judged.
JUDGED_HZ = 20.0
# The servo reports the mean rate of the last so many seconds.
SPEED_WINDOW_S = 0.04


@dataclass(frozen=True)
class Firmware:
    """
    The drive law and the registers of a kind of servo.

    Attributes
    ----------
    error_gain : duty per position error and unit of the position gain [1/rad]
    duty_count : the load register at full duty
    position_step : of the encoder [rad]
    rate_step : of the speed register [rad/s]

    """

    error_gain: float
    duty_count: float
    position_step: float
    rate_step: float


_COUNTS = 4096 / (2.0 * math.pi)
FIRMWARE = {'xl330': Firmware(_COUNTS / (256.0 * 885.0), 885.0, 1.0 / _COUNTS,
                              0.229 * 2.0 * math.pi / 60.0)}


@dataclass(frozen=True)
class ServoTest:
    """
    One log of a servo with a pendulum.

    Attributes
    ----------
    name : for people
    kp : position gain, in the firmware's unit
    trajectory : the name of the goal's course
    mass, length : of the pendulum [kg], [m]
    gain : duty per position error [1/rad]
    supply : voltage [V]
    firmware : of the servo
    time : of the samples, shape (n,) [s]
    goal : shape (n,) [rad]
    enabled : 1 where the servo drives, shape (n,)
    temperature : shape (n,) [degC]
    measured : position [rad], speed [rad/s], duty; shape (n, 3)

    """

    name: str
    kp: float
    trajectory: str
    mass: float
    length: float
    gain: float
    supply: float
    firmware: Firmware
    time: FloatArray
    goal: FloatArray
    enabled: FloatArray
    temperature: FloatArray
    measured: FloatArray

    @classmethod
    def of(cls, name: str, recording: Recording) -> ServoTest:
        """
        Prepare a log that `recording.bam.read_bam` has read.

        Raises
        ------
        UserError : too short, or the drive law of this servo is not known

        """
        notes = recording.notes
        if notes['motor'] not in FIRMWARE:
            raise UserError(f'{name}: motor: {notes["motor"]!r} given, the drive law is known of '
                            f'{", ".join(FIRMWARE)}')
        for key in ('mass', 'length', 'kp', 'vin'):
            if not 0.0 < float(notes[key]) < math.inf:
                raise UserError(f'{name}: {key}: {notes[key]} given, allowed is more than 0')
        firmware = FIRMWARE[notes['motor']]
        time = np.asarray(recording['servo/position'].time_s, dtype=np.float64)
        if time.size < 50:
            raise UserError(f'{name}: {time.size} samples, at least 50 are needed')
        values = {key: np.array(recording[f'servo/{key}'].values, dtype=np.float64)
                  for key in ('position', 'speed', 'goal_position', 'torque_enable',
                              'temperature', 'load')}
        load = values['load']
        # the register has 16 bits in two's complement
        duty = np.where(load >= 2 ** 15, load - 2 ** 16, load) / firmware.duty_count
        return cls(name, float(notes['kp']), str(notes['trajectory']), float(notes['mass']),
                   float(notes['length']), float(notes['kp']) * firmware.error_gain,
                   float(notes['vin']), firmware, time, values['goal_position'],
                   values['torque_enable'], values['temperature'],
                   np.column_stack([values['position'], values['speed'], duty]))

    @property
    def steps(self) -> FloatArray:
        """Return the resolution of position, speed and duty, shape (3,)."""
        position = self.firmware.position_step
        return np.array([position, self.firmware.rate_step,
                         max(1.0 / self.firmware.duty_count, self.gain * position)])

    def simulate(self, values: FloatArray, step: float = STEP_S) -> FloatArray:
        """
        Return position, rate, duty and current that a servo with these numbers would have had.

        It runs free of the measured course, but that it starts where that starts, at rest.

        Parameters
        ----------
        values
            from `servo_catalogue.vector`
        step
            of integration, at most [s]

        Returns
        -------
        array of shape (n, 4) [rad, rad/s, 1, A]

        """
        out = np.empty((self.time.size, 4))
        swing(values, self.mass, self.length, self.gain, self.supply, self.time, self.goal,
              self.enabled, self.temperature, self.measured[0, POSITION], 0.0, step, out)
        return out

    def error(self, values: FloatArray, step: float = STEP_S) -> float:
        """Return the mean absolute error of the position over the whole run [rad]."""
        miss = np.abs(self.simulate(values, step)[:, 0] - self.measured[:, POSITION])
        return float(np.nan_to_num(miss, nan=10.0).mean())

    def readings(self, values: FloatArray, step: float = STEP_S) -> FloatArray:
        """Return what the servo would have reported, shape (n, 3) like `measured`."""
        run = self.simulate(values, step)
        past = np.interp(self.time - SPEED_WINDOW_S, self.time, run[:, 0])
        return np.column_stack([run[:, 0], (run[:, 0] - past) / SPEED_WINDOW_S, run[:, 2]])


class ServoModel:
    """
    A servo in the tests that were recorded.

    Parameters
    ----------
    tests
        the logs
    values
        what the model's numbers are without any offset; what is not named is absent
    free
        the numbers that are not known for sure and are fitted beside any effect
    without
        effects that are not considered
    noise
        standard deviation that is expected of a perfect model's residuals in position [rad],
        speed [rad/s] and duty; None for the sensors' steps alone
    threads
        how many runs at once

    """

    def __init__(self, tests: Sequence[ServoTest], values: Mapping[str, float],
                 free: Sequence[str], without: Iterable[str] = (),
                 noise: Sequence[float] | None = None, threads: int = 1) -> None:
        """Prepare the experiments and the catalogue of what is absent."""
        # one thread after another would only wait for each other
        self._executor = ThreadPoolExecutor(threads) if threads > 1 else None
        self.tests = list(tests)
        self.values = dict(values)
        self.notes: list[str] = []
        self.effects = {
            effect.id: Effect(effect.id, effect.component, effect.cause, effect.look, forms)
            for effect in servo_catalogue.catalogue(without).values()
            if (forms := tuple(_left(effect.forms, self.values)))}
        self.nuisances = tuple(self._offset(name) for name in free)
        self._strides = [max(1, round(1.0 / JUDGED_HZ / float(np.median(np.diff(t.time)))))
                         for t in self.tests]
        self.experiments = [self._experiment(test, stride, noise)
                            for test, stride in zip(self.tests, self._strides, strict=True)]

    def _offset(self, name: str) -> Parameter:
        """Return a number that is present as an offset from its value; logarithmic ones as log."""
        item, value = servo_catalogue.number(name), self.values[name]
        if item.logarithmic:
            return Parameter(name, '1', math.log(item.low / value), math.log(item.high / value),
                             item.step)
        return Parameter(name, servo_catalogue.unit(name), item.low - value, item.high - value,
                         item.step)

    @staticmethod
    def _experiment(test: ServoTest, stride: int, noise: Sequence[float] | None) -> Experiment:
        if noise is None:
            noise = (test.steps / math.sqrt(3.0)).tolist()
        measured = test.measured[::stride]
        return Experiment(test.name, test.time[::stride], CHANNELS, UNITS, measured,
                          np.broadcast_to(np.asarray(noise, float), measured.shape).copy())

    def numbers(self, point: Point) -> dict[str, float]:
        """Return the servo's numbers at a point: offsets added, effects as they are."""
        values = dict(self.values)
        for name, value in point.items():
            if name not in self.values:
                values[name] = value
            elif servo_catalogue.number(name).logarithmic:
                values[name] = self.values[name] * math.exp(value)
            else:
                values[name] = self.values[name] + value
        return values

    def brief(self) -> ServoModel:
        """Return the model itself: a servo's tests are short."""
        return self

    def rough(self) -> ServoModel:
        """Return the model itself: a servo's runs are short."""
        return self

    def heard_at(self, point: Point) -> ServoModel:
        """Return the model itself: a servo's readings are as noisy at any speed."""
        return self

    def forms(self, effect: Effect, residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return all forms: a servo's runs are short."""
        return effect.forms

    @property
    def entries(self) -> Sequence[Entry]:
        """Return none: a servo of one body has one place."""
        return ()

    def pushed(self, point: Point, entry: Entry, course: Input) -> list[FloatArray]:
        """Return nothing: there are no entries."""
        return []

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        """Return the form itself: no effect of a servo sits in several places."""
        return form

    def absorbed(self, point: Point, gone: Point) -> dict[str, float]:
        """Return the offsets unchanged: none of them is known to stand for an effect."""
        return dict(point)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """Return what the sensors would have shown; see `Model.simulate`."""
        plan, wanted = [], []
        for i, point in enumerate(points):
            values = servo_catalogue.vector(self.numbers(point))
            for k in range(len(self.tests)):
                if only is None or only[i] is None or only[i] == k:
                    plan.append((i, k))
                    wanted.append((k, values, until))
        results: list[list[FloatArray | None]] = [[None] * len(self.tests) for _ in points]
        runs = map if self._executor is None else self._executor.map
        for (i, k), found in zip(plan, runs(self._run, wanted), strict=True):
            results[i][k] = found
        return results

    def _run(self, job: tuple[int, FloatArray, float]) -> FloatArray:
        k, values, until = job
        readings = self.tests[k].readings(values)[::self._strides[k]]
        time = self.experiments[k].time
        readings[time - time[0] > until] = np.nan
        return readings

    def motion(self, experiment: int) -> Motion:
        """Return how the servo moved in a test, as it was measured, at the judged samples."""
        test, stride = self.tests[experiment], self._strides[experiment]
        position = test.measured[::stride, POSITION]
        load = test.mass * GRAVITY * test.length
        time = self.experiments[experiment].time
        return Motion(np.gradient(position, time), load * np.sin(position), position, load)


def _left(forms: Sequence[Form], present: Mapping[str, float]) -> Iterable[Form]:
    """Yield the forms whose numbers are not all there, without those that are."""
    taken = {name for item in present for name in (item, *servo_catalogue.TIED.get(item, ()))}
    waves = {servo_catalogue.base_name(name) for name in present
             if servo_catalogue.CYCLES_MARK in name}
    for form in forms:
        own = form.parameters
        if any(p.name in taken and not p.shape for p in own):
            continue
        # the physics has one wave of each kind
        if any(servo_catalogue.base_name(p.name) in waves for p in own):
            continue
        if any(name in taken for p in own for name in servo_catalogue.TIED.get(p.name, ())):
            continue
        yield Form(form.name, tuple(p for p in own if p.name not in taken))
