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
"""The antenna drive of a configuration, in the tests that were recorded, for a diagnosis."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
import copy
from dataclasses import dataclass, replace
import math
from threading import Lock
from typing import Any

from antenna_drive.diagnosis.machine import (
    Effect, Entry, Experiment, FloatArray, Form, Input, Motion, Parameter, Point,
)
from antenna_drive.emulator import batch
from antenna_drive.machines.antenna import catalogue
from antenna_drive.machines.antenna.catalogue import ADD, DriveEntry, DriveParameter, SCALE, Wave
from antenna_drive.machines.antenna.excitation import (
    Bias, Longest, schedule, with_bias, with_torque,
)
from antenna_drive.machines.antenna.field_test import (
    BIAS, CHANNELS, CURRENT_1, CURRENT_2, ENCODER, FieldTest, prepared, TACH_1, TACH_2, UNITS,
)
from antenna_drive.machines.antenna.sensors import digit_of
from antenna_drive.machines.antenna.tolerances import CLOCK, offsets, SUPPLY, ZERO
from antenna_drive.machines.antenna.wave_orders import likely_orders
from antenna_drive.parameters.records import place_of
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.recording import Recording
import numpy as np
from scipy.interpolate import CubicSpline

LONGEST_STEP = 2.5e-3
# A search looks at so much of a test [s]; it and derivatives take longer steps, whose error is a
# tenth of the noise.
BRIEF_S = 15.0
ROUGH_STEP = 5.3e-3
# A wave of the motors' angle turns by no more than this in a step [rad], however short [s].
WAVE_STEP = 0.9
SHORTEST_STEP = 7e-4
# An encoder's digit is another than the sheet's if it is so many times as large.
COARSER = 1.3
# How many cycles per revolution are tried of each wave.
_WAVES = 3
# Hysteresis runs in faster than long steps can follow.
_STIFF = ('hysteresis', 'hysteresis_share')
# The mode that the record has room for and the configuration has not.
_EXTRA = 3
_CACHE = 120
# How many tables of steps are kept: a test has one for each bias voltage and each wave.
_PLANS = 24
# A gust's torque is smooth; within so much time it may be a straight line [s].
_GUST_S = 0.02


@dataclass(frozen=True)
class _Job:
    """A run that is wanted: what acts on it, by name and value, and its end [s]."""

    experiment: int
    items: tuple[tuple[str, float], ...]
    until: float


class DriveModel:
    """
    The antenna drive of a configuration, in the tests that were recorded.

    Parameters
    ----------
    recordings
        of one machine, by name
    drive
        the configuration
    threads
        how many runs at once
    tolerance
        of the parameters, where no sheet gives it

    Raises
    ------
    UserError : a recording lacks its rate command or has no reading to compare

    """

    def __init__(self, recordings: Mapping[str, Recording], drive: Drive, threads: int = 2,
                 tolerance: float = 0.02) -> None:
        """Prepare the tests and find the sensors' noise from a first run."""
        self._executor = ThreadPoolExecutor(threads)
        self._cache: OrderedDict[_Job, FloatArray] = OrderedDict()
        self._lock = Lock()
        self._longest_step = LONGEST_STEP
        self._rougher: DriveModel | None = None
        self.notes: list[str] = []
        self.runs = 0
        self._tests = [prepared(name, recording, drive, self.notes.append)
                       for name, recording in recordings.items()]
        self._plans: OrderedDict[tuple[int, Longest, Bias], batch.Schedule] = OrderedDict()
        for test in self._tests:
            test.record['plant']['axis']['mode_frequencies'][0, _EXTRA] = 1.0
        given = [recording.sheet.parameter_tolerance for recording in recordings.values()
                 if recording.sheet.parameter_tolerance is not None]
        if not given:
            self.notes.append(f'no sheet gives parameter_tolerance: {tolerance:g} assumed')
        self.tolerance = max(given, default=tolerance)
        self.effects: dict[str, Effect] = catalogue.catalogue()
        gust = self.effects[catalogue.GUST]
        self.effects[gust.id] = replace(gust, forms=(catalogue.gust_form(
            [float(test.time[-1]) for test in self._tests]),))
        self._digit = _coarser_digit(self._tests)
        if self._digit:
            coarse = self.effects[catalogue.QUANTISATION]
            self.effects[coarse.id] = replace(
                coarse, forms=(catalogue.quantisation_form(self._digit),))
        self.nuisances = offsets(self._tests, self.tolerance)
        self.effects = {key: _tolerated(effect, self.nuisances)
                        for key, effect in self.effects.items()}
        self._by_name: dict[str, DriveParameter] = {}
        self._waves: dict[str, tuple[Wave, int]] = {}
        for item in (*self.nuisances, *(p for effect in self.effects.values()
                                        for form in effect.forms for p in form.parameters)):
            assert isinstance(item, DriveParameter)
            self._by_name[item.name] = item
        kind = self._tests[0].record.dtype
        # where in the record those act that change numbers of it and nothing else
        self._places = {name: tuple(place_of(kind, path) for path in item.fields)
                        for name, item in self._by_name.items()
                        if item.fields and not item.reading
                        and not name.startswith(catalogue.GUST)}
        self.experiments = self._experiments({})

    def _experiments(self, point: Point) -> tuple[Experiment, ...]:
        """Return the tests, with the noise of readings that move as at a point."""
        found = []
        for k, test in enumerate(self._tests):
            out = self._run(self._job(k, point, math.inf))
            # what the model lacks may be steeper than anything in it: the readings tell
            slope = np.fmax(np.abs(out[:, :, 1]), np.abs(test.slope))
            noise = test.sensors.noise(out[:, :, 0], slope, test.jitter)
            found.append(Experiment(test.name, test.time, tuple(CHANNELS.values()), UNITS,
                                    test.measured, noise, coarse=('encoder',)))
        return tuple(found)

    def heard_at(self, point: Point) -> DriveModel:
        """Return the model with the noise of readings that move as at a point."""
        other = copy.copy(self)
        other.experiments = self._experiments(point)
        return other

    def _in_rough_steps(self) -> DriveModel:
        """Return the model with longer steps, and so with runs and tables of steps of its own."""
        other = copy.copy(self)
        other._cache = OrderedDict()
        other._plans = OrderedDict()
        other._longest_step = ROUGH_STEP
        return other

    def brief(self) -> DriveModel:
        """Return the model with as much of each test as a search needs; a chirp stays whole."""
        other = self._in_rough_steps()
        other._tests = [test.until(BRIEF_S if test.repeats else math.inf)
                        for test in self._tests]
        sizes = [test.time.size for test in other._tests]
        other.experiments = tuple(
            replace(e, time=e.time[:n], measured=e.measured[:n], noise=e.noise[:n])
            for n, e in zip(sizes, self.experiments, strict=True))
        return other

    def rough(self) -> DriveModel:
        """Return the model with the longer steps that do for derivatives."""
        if self._longest_step >= ROUGH_STEP:
            return self
        if self._rougher is None:
            self._rougher = self._in_rough_steps()
        return self._rougher

    def motion(self, experiment: int) -> Motion:
        """Return how the machine moved in an experiment: as measured, else as simulated."""
        measured_there = self.experiments[experiment].measured
        predicted = self.simulate([{}], [experiment])[0][experiment]
        assert predicted is not None

        def signal(c: int) -> FloatArray:
            measured = measured_there[:, c]
            return np.where(np.isfinite(measured), measured, predicted[:, c])

        test = self._tests[experiment]
        return Motion(rate=0.5 * (signal(TACH_1) + signal(TACH_2)),
                      load=signal(CURRENT_1) + signal(CURRENT_2), angle=signal(ENCODER),
                      limit=float(test.record['motor_1']['motor']['current_limit'][0]))

    # -- effects -------------------------------------------------------------------------------

    def forms(self, effect: Effect, residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return an effect's forms; those of a wave with the likeliest cycles per revolution."""
        found: list[Form] = []
        for form in effect.forms:
            if not isinstance(form, Wave):
                found.append(form)
                continue
            for order in likely_orders(form, self.experiments, residuals, _WAVES):
                wave = form.at(order)
                self.register(wave)
                found.append(wave)
        return found

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        """Return the form of an effect's part that is like a form of the effect."""
        if not isinstance(form, Wave):
            return part.forms[effect.forms.index(form)]
        found = part.forms[0]
        assert isinstance(found, Wave)
        found = found.at(form.order)
        self.register(found)
        return found

    def register(self, wave: Wave) -> None:
        """Make a wave's parameters known."""
        for part, item in enumerate(wave.parameters):
            assert isinstance(item, DriveParameter)
            self._waves[item.name] = (wave, part)
            self._by_name[item.name] = item

    def absorbed(self, point: Point, gone: Point) -> dict[str, float]:
        """Return the offsets that do as much as they can of what an effect did."""
        result = dict(point)
        for name, value in gone.items():
            item = self._by_name[name]
            for path in item.fields:
                offset = self._by_name.get(f'offset:{path}')
                if offset is None or offset.name not in result or offset.how != item.how:
                    continue
                both = (result[offset.name] + value if item.how == ADD else
                        (1.0 + result[offset.name]) * (1.0 + value) - 1.0)
                result[offset.name] = min(max(both, offset.low), offset.high)
        return result

    # -- running -------------------------------------------------------------------------------

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """Return what the sensors would have shown; see `Model.simulate`."""
        jobs: list[tuple[int, _Job, Point]] = []
        known: dict[_Job, FloatArray] = {}
        wanted: dict[_Job, None] = {}
        for i, (point, one) in enumerate(zip(points, only or [None] * len(points), strict=True)):
            for k in range(len(self._tests)) if one is None else (one,):
                job = self._job(k, point, until)
                # several threads use the cache: what it has now it may not have a moment later
                out = self._cache.get(job)
                if out is None:
                    wanted[job] = None
                else:
                    known[job] = out
                jobs.append((i, job, point))
        self.runs += len(wanted)
        fresh = dict(zip(wanted, self._executor.map(self._run, wanted), strict=True))
        results: list[list[FloatArray | None]] = [[None] * len(self._tests) for _ in points]
        for i, job, point in jobs:
            out = known[job] if job in known else fresh[job]
            results[i][job.experiment] = self._read(job.experiment, out, point)
        with self._lock:
            self._cache.update(fresh)
            while len(self._cache) > _CACHE:
                self._cache.popitem(last=False)
        return results

    @property
    def entries(self) -> Sequence[Entry]:
        """Return where something unknown may enter."""
        return catalogue.ENTRIES

    def pushed(self, point: Point, entry: Entry, course: Input) -> list[FloatArray]:
        """Return what the sensors would have shown; see `Model.pushed`."""
        assert isinstance(entry, DriveEntry)

        def run(k: int) -> FloatArray:
            out = self._run(self._job(k, point, math.inf), (entry, course))
            return self._read(k, out, point)

        return list(self._executor.map(run, range(len(self._tests))))

    def _job(self, k: int, point: Point, until: float) -> _Job:
        """Return the run of one test at a point: what acts on readings alone is no part of it."""
        items = sorted(point.items())
        return _Job(k, tuple(item for item in items if not self._by_name[item[0]].reading
                             and self._by_name[item[0]].experiment in (None, k)), until)

    def _run(self, job: _Job, push: tuple[DriveEntry, Input] | None = None) -> FloatArray:
        test = self._tests[job.experiment]
        kind = test.record.dtype
        # as plain numbers: numpy copies a record field by field
        numbers = test.record.view(np.float64).copy()
        record = numbers.view(kind)
        waves: dict[Wave, list[float]] = {}
        gust: FloatArray | None = None
        bias, delay = test.bias, 0.0
        for name, value in job.items:
            places = self._places.get(name)
            if places is not None:
                for place in places:
                    _change(numbers, place, self._by_name[name].how, value)
            elif name in self._waves:
                form, part = self._waves[name]
                waves.setdefault(form, [0.0] * len(form.parameters))[part] = value
            elif name == catalogue.DELAY:
                delay = value
            elif name.startswith(catalogue.GUST):
                if gust is None:
                    gust = np.zeros(catalogue.gust_knots(float(test.time[-1])))
                knot = int(name.rpartition(':')[2])
                if knot < gust.size:
                    gust[knot] = value
            elif name.startswith(SUPPLY):
                bias = Bias(bias.before * (1.0 + value), bias.after * (1.0 + value), bias.at)
        turns = 0.0
        for form, values in waves.items():
            for path, how, value in form.settings(*values):
                _change(numbers, place_of(kind, path), how, value)
            if form.angle != 'axis' and any(values):
                turns = max(turns, form.order * float(record[form.angle]['gear_ratio'][0]))
        axis = record['plant']['axis']
        if axis['mode_inertias'][0, _EXTRA] > 0.0:
            axis['mode_inertias_count'] = _EXTRA + 1
        torque = None
        if gust is not None:
            knots = catalogue.GUST_KNOT_S * np.arange(gust.size)
            fine = np.arange(0.0, knots[-1] + _GUST_S, _GUST_S)
            torque = (fine, CubicSpline(knots, gust)(fine))
        stiff = any(record[motor]['gearbox'][name][0] > 0.0
                    for motor in ('motor_1', 'motor_2') for name in _STIFF)
        longest = min(self._longest_step, LONGEST_STEP) if stiff else self._longest_step
        plan = self._plan(job.experiment, bias, delay, torque, Longest(
            longest, SHORTEST_STEP, WAVE_STEP, turns))
        if push is not None:
            plan = _with(plan, record, *push)
        samples = int(np.count_nonzero(test.time - test.time[0] < job.until))
        if samples == test.time.size:
            return batch.run(record, plan)
        steps = int(np.argmax(plan.keep == samples - 1))
        out = np.full((test.time.size, len(CHANNELS), 2), np.nan)
        out[:samples] = batch.run(record, batch.Schedule(plan.steps[:steps],
                                                         plan.keep[:steps + 1]))
        return out

    def _plan(self, k: int, bias: Bias, delay: float,
              torque: tuple[FloatArray, FloatArray] | None, longest: Longest) -> batch.Schedule:
        """Return the steps of a run."""
        test = self._tests[k]
        if delay:
            plan = schedule(test.command, bias, test.time, longest, delay)
        else:
            plan = self._kept((k, longest, bias), lambda: with_bias(self._kept(
                (k, longest, test.bias),
                lambda: schedule(test.command, test.bias, test.time, longest)), bias))
        return plan if torque is None else with_torque(plan, *torque)

    def _kept(self, key: tuple[int, Longest, Bias],
              made: Callable[[], batch.Schedule]) -> batch.Schedule:
        """Return the table of steps of a test, made if it is not known."""
        plan = self._plans.get(key)
        if plan is None:
            plan = made()
            with self._lock:
                self._plans[key] = plan
                while len(self._plans) > _PLANS:
                    self._plans.popitem(last=False)
        return plan

    def _read(self, k: int, out: FloatArray, point: Point) -> FloatArray:
        """Return the readings of a run: what sensors do that nothing feeds back."""
        values = out[:, :, 0].copy()
        shift = np.zeros(len(CHANNELS))
        gain = np.ones(len(CHANNELS))
        step = turn = 0.0
        parts: list[float] = []
        form: Wave | None = None
        for name, value in point.items():
            item = self._by_name[name]
            if not item.reading or item.experiment not in (None, k) or not value:
                continue
            if name.startswith(CLOCK):
                values += value * out[:, :, 1]
            elif name.startswith(ZERO):
                shift[_CHANNEL[name.split(':')[1]]] += value
            elif name in self._waves:
                form, part = self._waves[name]
                parts = parts or [0.0] * len(form.parameters)
                parts[part] = value
            elif item.fields[0] == catalogue.DIGIT:
                step = value
            elif item.fields[0] == catalogue.TURN:
                turn = value
            else:
                effect, _, what = item.fields[0].rpartition('.')
                (gain if 'gain' in what else shift)[_METERS[effect]] += value
        values *= gain
        if form is not None:
            values[:, ENCODER] += form.along(out[:, ENCODER, 0], parts)
        values += shift
        if step > 0.0 and self._digit:
            # whatever lies within the digit that was read would have been read
            read = self.experiments[k].measured[:, ENCODER] + turn * step
            off = np.nan_to_num(values[:, ENCODER] - read)
            values[:, ENCODER] -= np.clip(off, -0.5 * step, 0.5 * step) + turn * step
        elif step > 0.0:
            values[:, ENCODER] = step * np.floor(values[:, ENCODER] / step + 0.5)
        return values


def _tolerated(effect: Effect, offsets_known: Sequence[DriveParameter]) -> Effect:
    """Return an effect whose parameters know by how much their numbers may be off anyway."""
    may_be_off = {(path, item.how): item.high for item in offsets_known
                  if item.experiment is None for path in item.fields}

    def told(item: Parameter) -> Parameter:
        assert isinstance(item, DriveParameter)
        known = [may_be_off.get((path, item.how), 0.0) for path in item.fields]
        return replace(item, tolerance=min(known, default=0.0))

    return replace(effect, forms=tuple(
        replace(form, parameters=tuple(told(p) for p in form.parameters))
        for form in effect.forms))


def _coarser_digit(tests: Sequence[FieldTest]) -> float:
    """Return the encoder's digit if it is coarser than its sheet says, else 0 [rad]."""
    digits = [digit_of(test.measured[:, ENCODER]) for test in tests]
    known = max(test.sensors.encoder_step for test in tests)
    seen = [digit for digit in digits if digit > 0.0]
    digit = min(seen, default=0.0)
    return digit if len(seen) == len(tests) and digit > COARSER * known else 0.0


_CHANNEL = {name: c for c, name in enumerate(CHANNELS.values())}
# Which channel a meter's errors act on, by where they are in the record.
_METERS = {'motor_1.ammeter': CURRENT_1, 'motor_2.ammeter': CURRENT_2, 'plant.encoder': ENCODER,
           'torque_share.circuit': BIAS}


def _with(plan: batch.Schedule, record: np.ndarray[Any, np.dtype[Any]], entry: DriveEntry,
          course: Input) -> batch.Schedule:
    """Return a plan that lets an input into the drive, whose record is set up for it."""
    numbers, kind = record.view(np.float64), record.dtype
    for path, how, value in entry.settings:
        _change(numbers, place_of(kind, path), how, value)
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    steps[:, batch.CHANGE] = entry.size * course(np.cumsum(length) - 0.5 * length)
    return batch.Schedule(steps, plan.keep, place_of(kind, entry.path))


def _change(numbers: FloatArray, place: int, how: str, value: float) -> None:
    """Change one number of a record."""
    if how == SCALE:
        numbers[place] *= 1.0 + value
    elif how == ADD:
        numbers[place] += value
    else:
        numbers[place] = value
