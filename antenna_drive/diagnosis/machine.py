# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The antenna drive of a configuration, in the tests that were recorded, as a `Machine`."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
import copy
from dataclasses import dataclass, replace
from itertools import product
import math
from statistics import fmean
from threading import Lock
from typing import Any, TypeAlias

from antenna_drive.diagnosis import gust
from antenna_drive.diagnosis.advice import ADVICE
from antenna_drive.diagnosis.catalogue import catalogue, DIGITS_SEEN, EXTRA_MODE
from antenna_drive.diagnosis.diagram import DIAGRAM
from antenna_drive.diagnosis.disturbances import DISTURBANCES, DriveDisturbance
from antenna_drive.diagnosis.excitation import (
    Bias, Longest, schedule, with_bias, with_torque,
)
from antenna_drive.diagnosis.field_test import prepared
from antenna_drive.diagnosis.late_readings import RipplingTachometer
from antenna_drive.diagnosis.modifiers import (
    ADD, AntennaParameter, change, Modifier, ReadingModifier, RunModifier, RunSetup,
    SensorReadings,
)
from antenna_drive.diagnosis.outputs import coarser_digit, Outputs, readings_of
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.diagnosis.tolerances import nuisances, starting_places
from antenna_drive.diagnosis.wave_orders import likely_orders
from antenna_drive.diagnosis.waves import fastest_wave, is_there, Wave
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import place_of
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import AT, NAMED, READINGS, SIGNALS
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import CircuitBias, sheet_tree, TestSheet
import numpy as np
from simgap.machine.contract import (
    Course, DisturbanceInput, Effect, Experiment, FloatArray, Form, Machine, Parameter, Point,
    Regimes, TimeScales,
)
from simgap.machine.motion import Motion

_TIME_SCALES = TimeScales(start_s=1.5, scan_s=8.0, pulse_s=0.15, response_s=1.5, block_s=1.0)
LONGEST_STEP = 2.65e-3
# A search looks at this much of a test [s]. It and derivatives take longer steps, whose error is
# a tenth of the noise.
TRUNCATED_S = 15.0
LOW_FIDELITY_STEP = 5.6e-3
# A wave of the motors' angle turns by at most this much in a step [rad], down to a shortest
# step [s].
WAVE_STEP = 0.9
SHORTEST_STEP = 7e-4
# Numbers of cycles per revolution that are tried of each wave.
_ORDERS = 3
# Hysteresis settles too fast for long steps.
_STIFF = ('hysteresis', 'hysteresis_share')
# Places inside the gap, as shares of half the gap, at which each motor may start.
_STARTS = np.linspace(-0.95, 0.95, 13)
# Runs that are kept, and tables of steps: a test has one for each bias voltage and each wave.
_KEPT_RUNS = 24
_KEPT_PLANS = 24
# By number: late jumps of the command [s], or other means in its holes [rad/s].
_Numbered: TypeAlias = tuple[tuple[int, float], ...]
# Test, longest step, delay of the command [s], what it did unrecorded, source of the bias.
_PlanKey: TypeAlias = tuple[int, Longest, float, tuple[_Numbered, _Numbered], Bias]


@dataclass(frozen=True)
class _Job:
    """A run that is wanted: the parameters that act on it, by name and value, and its end [s]."""

    experiment: int
    items: tuple[tuple[str, float], ...]
    until: float


class AntennaMachine(Machine):
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

    disturbance_inputs: Sequence[DisturbanceInput] = DISTURBANCES
    time_scales = _TIME_SCALES
    diagram = DIAGRAM
    advice = ADVICE

    def __init__(self, recordings: Mapping[str, Recording], drive: Drive, threads: int = 2,
                 tolerance: float = 0.02) -> None:
        """Prepare the tests and take the sensors' noise from a first run."""
        self._executor = ThreadPoolExecutor(threads)
        self._runs: OrderedDict[_Job, Outputs] = OrderedDict()
        self._plans: OrderedDict[_PlanKey, batch.Schedule] = OrderedDict()
        self._lock = Lock()
        self._longest_step = LONGEST_STEP
        self._low_fidelity: AntennaMachine | None = None
        notes: list[str] = []
        self._tests = prepared(recordings, drive, notes.append)
        for test in self._tests:
            frequencies = test.record['plant']['axis']['mode_frequencies']
            if frequencies[0, EXTRA_MODE] == 0.0:
                frequencies[0, EXTRA_MODE] = 1.0
        given = [recording.sheet.parameter_tolerance for recording in recordings.values()
                 if recording.sheet.parameter_tolerance is not None]
        if not given:
            notes.append(f'no sheet gives parameter_tolerance: {tolerance:g} assumed')
        self.notes = notes
        self.tolerance = max(given, default=tolerance)
        self._digit = coarser_digit(self._tests)
        tolerances = nuisances(self._tests, self.tolerance)
        effects = catalogue([float(test.time[-1]) for test in self._tests], self._digit)
        # the nuisance that changes the same number in the same way, by field
        self._tolerance_of = {(item.modifier.fields[0], item.modifier.how): item
                              for item in tolerances
                              if item.experiment is None and item.modifier.fields}
        # a point is plain numbers: what they do, and in which test alone, is looked up by name
        self._run_modifiers: dict[str, tuple[RunModifier, int | None]] = {}
        self._reading_modifiers: dict[str, tuple[ReadingModifier, int | None]] = {}
        super().__init__((), tolerances, [
            _tolerated(effect, tolerances) for effect in effects.values()])
        for item in (*tolerances, *(p for effect in effects.values()
                                    for form in effect.forms for p in form.parameters)):
            self._register(item)
        self.experiments = self._experiments({})
        self._drive = drive
        self._in_common = _in_common(test.sheet for test in self._tests)
        self.planning = {'sheet': sheet_tree(self._in_common)}

    @property
    def records(self) -> Sequence[np.ndarray[Any, np.dtype[Any]]]:
        """Return the drive's record in each test: as configured and as the sheet says."""
        return [test.record for test in self._tests]

    def _register(self, item: Parameter) -> None:
        assert isinstance(item, AntennaParameter)
        if isinstance(item.modifier, RunModifier):
            self._run_modifiers[item.name] = item.modifier, item.experiment
        else:
            assert isinstance(item.modifier, ReadingModifier)
            self._reading_modifiers[item.name] = item.modifier, item.experiment

    def _experiments(self, point: Point) -> tuple[Experiment, ...]:
        """Return the tests, with the noise of readings that move as at a point."""
        found = []
        for k, test in enumerate(self._tests):
            out = self._run(self._job(k, point, math.inf)).values[::test.parts]
            # the machine may move faster than the model without effects: the readings tell
            slope = np.fmax(np.abs(out[:, :, 1]), np.abs(test.slope))
            noise = test.sensors.noise(out[:, :, 0], slope, test.jitter)
            found.append(Experiment(
                test.name, test.time, tuple(AT), tuple(reading.unit for reading in READINGS),
                test.measured, noise, labels=test.labels,
                quantised=tuple(r.name for r in READINGS if r.sensor.is_counter)))
        return tuple(found)

    # -- variants of the machine ---------------------------------------------------------------

    def with_noise_at(self, point: Point) -> AntennaMachine:
        """Return the machine with the noise of readings that move as at a point."""
        other = copy.copy(self)
        other.experiments = self._experiments(point)
        return other

    def truncated(self) -> AntennaMachine:
        """Return the machine with the first part of each test; a chirp stays whole."""
        other = self._with_long_steps()
        other._tests = [test.until(TRUNCATED_S if test.repeats else math.inf)
                        for test in self._tests]
        sizes = [test.time.size for test in other._tests]
        other.experiments = tuple(
            replace(e, time=e.time[:n], measured=e.measured[:n], noise=e.noise[:n])
            for n, e in zip(sizes, self.experiments, strict=True))
        return other

    def low_fidelity(self) -> AntennaMachine:
        """Return the machine with longer steps."""
        if self._longest_step >= LOW_FIDELITY_STEP:
            return self
        if self._low_fidelity is None:
            self._low_fidelity = self._with_long_steps()
        return self._low_fidelity

    def _with_long_steps(self) -> AntennaMachine:
        other = copy.copy(self)
        other._runs = OrderedDict()
        other._plans = OrderedDict()
        other._longest_step = LOW_FIDELITY_STEP
        return other

    # -- what it knows of its motion -----------------------------------------------------------

    def regimes(self, experiment: int) -> Regimes:
        """Return the regime of motion of each sample."""
        return self._motion(experiment).regimes()

    def covariates(self, experiment: int) -> Mapping[str, FloatArray]:
        """Return rate, direction, load, angle, time and acceleration."""
        return self._motion(experiment).covariates()

    def _motion(self, experiment: int) -> Motion:
        """Return the motion in an experiment, as measured or else as simulated."""
        recorded = self.experiments[experiment]
        predicted = self.predict({}, experiment)

        def signal(name: str) -> FloatArray:
            c = AT[name]
            measured = recorded.measured[:, c]
            return np.where(np.isfinite(measured), measured, predicted[:, c])

        limit = float(self._tests[experiment].record['motor_1']['motor']['current_limit'][0])
        return Motion(recorded.time, rate=0.5 * (signal('tach_1') + signal('tach_2')),
                      load=signal('current_1') + signal('current_2'), angle=signal('encoder'),
                      load_limit=2.0 * limit)

    def initial_conditions(self, experiment: int) -> Sequence[Sequence[Point]]:
        """
        Return starting places of both motors inside their gaps.

        All combinations: where a bias closes both gaps at once, each motor's place looks right
        or wrong by the other's. One after the other they end in a wrong pair.
        """
        first, second = (item.name for item in starting_places(
            experiment, self._tests[experiment]))
        return [[{first: one, second: other}
                 for one, other in product(_STARTS.tolist(), repeat=2)]]

    # -- effects -------------------------------------------------------------------------------

    def forms(self, effect: Effect, residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return an effect's forms; those of a wave with its likeliest orders."""
        found: list[Form] = []
        for form in effect.forms:
            if isinstance(form, Wave):
                found += [self._wave_at(form, order) for order in likely_orders(
                    form, self.experiments, residuals, _ORDERS)]
            else:
                found.append(form)
        return found

    def typical_form(self, effect: Effect) -> Form:
        """Return the first form of an effect; of a wave, one of a middle order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self._wave_at(form, form.orders[min(11, len(form.orders) - 1)])
        return form

    def form_named(self, effect: Effect, name: str) -> Form:
        """Return the form of an effect by its name; that of a wave says its order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self._wave_at(form, form.order_of(name))
        if name == DIGITS_SEEN and not self._digit:
            return form  # a planned test has no readings to see digits in: it is rounded
        return super().form_named(effect, name)

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        """Return the form of an effect's part that corresponds to a form of the effect."""
        if not isinstance(form, Wave):
            return part.forms[effect.forms.index(form)]
        wave = part.forms[0]
        assert isinstance(wave, Wave)
        return self._wave_at(wave, form.shape.order)

    def _wave_at(self, form: Wave, order: float) -> Wave:
        wave = form.at(order)
        for item in wave.parameters:
            self._register(item)
        return wave

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """Return the tolerances that take over what they can of an effect that is removed."""
        result = dict(point)
        for name, value in removed.items():
            modifier, _ = self._run_modifiers.get(name) or self._reading_modifiers[name]
            for path in modifier.fields:
                tolerance = self._tolerance_of.get((path, modifier.how))
                if tolerance is None or tolerance.name not in result:
                    continue
                both = _together(result[tolerance.name], value, modifier.how)
                result[tolerance.name] = min(max(both, tolerance.low), tolerance.high)
        return result

    def take_over(self, point: Point, forms: Sequence[Form]) -> tuple[dict[str, float], set[str]]:
        """
        Return a point at which effects alone stand for their numbers.

        An effect of several numbers, such as one in both motors, takes over what their tolerances
        have in common. These stay free, because the numbers may differ from each other.
        """
        result, held = dict(point), set()
        for item in (p for form in forms for p in form.sizes):
            assert isinstance(item, AntennaParameter)
            how, fields = item.modifier.how, item.modifier.fields
            same = [found for path in fields if (found := self._tolerance_of.get((path, how)))]
            if not same or len(same) < len(fields):
                continue
            common = fmean(result.get(tolerance.name, 0.0) for tolerance in same)
            together = _together(result[item.name], common, how)
            result[item.name] = min(max(together, item.low), item.high)
            for tolerance in same:
                rest = _apart(result.get(tolerance.name, 0.0), common, how)
                result[tolerance.name] = min(max(rest, tolerance.low), tolerance.high)
            if len(same) == 1:
                held.add(same[0].name)
        return result, held

    # -- running -------------------------------------------------------------------------------

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the readings of one experiment; see `Machine.predict`."""
        found = self.simulate([point], [experiment])[0][experiment]
        assert found is not None
        return found

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """Return the readings of several variants; see `Machine.simulate`."""
        results: list[list[FloatArray | None]] = [[None] * len(self._tests) for _ in points]
        # what acts on readings alone shares a run
        uses: dict[_Job, list[int]] = {}
        for i, (point, one) in enumerate(zip(points, only or [None] * len(points), strict=True)):
            for k in range(len(self._tests)) if one is None else (one,):
                uses.setdefault(self._job(k, point, until), []).append(i)

        def read(job: _Job) -> Outputs | None:
            """Read what needs a run, and return the run if it is a new one."""
            known = self._runs.get(job)
            out = self._run(job) if known is None else known
            for i in uses[job]:
                results[i][job.experiment] = self._read(job.experiment, out, points[i])
            return out if known is None else None

        for job, fresh in zip(uses, self._executor.map(read, uses), strict=True):
            if fresh is not None:
                with self._lock:
                    self._runs[job] = fresh
                    while len(self._runs) > _KEPT_RUNS:
                        self._runs.popitem(last=False)
        return results

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           course: Course) -> list[FloatArray]:
        """Return the readings with an unknown input; see `Machine.simulate_disturbed`."""
        assert isinstance(place, DriveDisturbance)

        def run(k: int) -> FloatArray:
            return self._read(k, self._run(self._job(k, point, math.inf), (place, course)), point)

        return list(self._executor.map(run, range(len(self._tests))))

    def _job(self, k: int, point: Point, until: float) -> _Job:
        """Return the run of one test at a point: what acts on readings alone is no part of it."""
        return _Job(k, tuple(item for item in sorted(point.items())
                             if item[0] not in self._reading_modifiers
                             and self._run_modifiers[item[0]][1] in (None, k)), until)

    def outputs(self, point: Point, experiment: int,
                channels: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
        """
        Return outputs of the drive in one experiment that no sensor reads.

        Parameters
        ----------
        point
            parameter values by name
        experiment
            its index
        channels
            names of c outputs, 'unit/signal'

        Returns
        -------
        times, shape (n,) [s], and values and slopes, shape (n, c, 2)

        """
        job = self._job(experiment, point, math.inf)
        return self._tests[experiment].output_times, self._run(job, channels=channels).values

    def _run(self, job: _Job, disturbance: tuple[DriveDisturbance, Course] | None = None,
             channels: tuple[str, ...] = SIGNALS) -> Outputs:
        test = self._tests[job.experiment]
        kind = test.record.dtype
        run = RunSetup(test.record.view(np.float64).copy(), kind, float(test.time[-1]), test.bias,
                       start_angle=test.start_angle)
        for name, value in job.items:
            self._run_modifiers[name][0].apply(run, value)
        record = run.numbers.view(kind)
        run.write_waves()
        cycles = fastest_wave(test.record)
        for shape, parts in run.waves.items():
            if shape.angle != 'axis' and any(parts):
                cycles = max(cycles, shape.order * float(record[shape.angle]['gear_ratio'][0]))
        axis = record['plant']['axis']
        if axis['mode_inertias'][0, EXTRA_MODE] > 0.0:
            axis['mode_inertias_count'] = EXTRA_MODE + 1
        stiff = any(record[motor]['gearbox'][name][0] > 0.0
                    for motor in ('motor_1', 'motor_2') for name in _STIFF)
        longest = min(self._longest_step, LONGEST_STEP) if stiff else self._longest_step
        plan = self._plan(job.experiment, run, Longest(longest, SHORTEST_STEP, WAVE_STEP, cycles))
        if disturbance is not None:
            plan = _disturbed(plan, run, *disturbance)
        rippling = {f'tach_{m}': f'motor_{m}' for m in (1, 2)
                    if NAMED[f'tach_{m}'].signal in channels
                    and is_there(record[f'motor_{m}']['tachometer'], 'ripple')}
        wanted = (*channels, *(f'{motor}/angle' for motor in rippling.values()))
        time = test.output_times
        samples = int(np.count_nonzero(time - time[0] < job.until))
        if samples == time.size:
            out = batch.run(record, plan, channels=wanted)
        else:
            steps = int(np.argmax(plan.keep == samples - 1))
            out = np.full((time.size, len(wanted), 2), np.nan)
            out[:samples] = batch.run(record, batch.Schedule(
                plan.steps[:steps], plan.keep[:steps + 1]), channels=wanted)
        return Outputs(out[:, :len(channels)], {
            name: RipplingTachometer(out[:, row, 0], record[motor]['tachometer'])
            for row, (name, motor) in enumerate(rippling.items(), len(channels))})

    def _plan(self, k: int, run: RunSetup, longest: Longest) -> batch.Schedule:
        """Return the steps of a run."""
        test = self._tests[k]
        unrecorded = (tuple(run.late_jumps.items()), tuple(run.hole_means.items()))

        def planned() -> batch.Schedule:
            command = test.command
            if isinstance(command, RecordedCommand):
                for number, later in run.late_jumps.items():
                    command = command.with_jump(number, later)
                for number, more in run.hole_means.items():
                    command = command.with_mean(number, more)
            return schedule(command, test.bias, test.output_times, longest, run.delay)

        key = (k, longest, run.delay, unrecorded)
        plan = self._kept((*key, run.bias), lambda: with_bias(
            self._kept((*key, test.bias), planned), run.bias))
        return plan if run.gust is None else with_torque(plan, *gust.course(run.gust))

    def _kept(self, key: _PlanKey, made: Callable[[], batch.Schedule]) -> batch.Schedule:
        """Return the table of steps of a test, made if it is not known."""
        plan = self._plans.get(key) or made()
        with self._lock:
            self._plans[key] = plan
            self._plans.move_to_end(key)
            while len(self._plans) > _KEPT_PLANS:
                self._plans.popitem(last=False)
        return plan

    def _read(self, k: int, out: Outputs, point: Point) -> FloatArray:
        """Return the readings of a run, with the errors of sensors that nothing feeds back."""
        errors = SensorReadings()
        for name, value in point.items():
            modifier, test = self._reading_modifiers.get(name, (None, None))
            if modifier is not None and test in (None, k) and value:
                modifier.apply_to_readings(errors, value)
        digits = self.experiments[k].measured[:, AT['encoder']] if self._digit else None
        return readings_of(self._tests[k], out, errors, digits)


def _in_common(sheets: Iterable[TestSheet]) -> TestSheet:
    """Return what a further test of the machine shares with those that were made."""
    first, *others = sheets
    bias = next((sheet.bias for sheet in (first, *others)
                 if isinstance(sheet.bias, CircuitBias)), first.bias)
    return replace(first, waveform=None, bias=bias, start='rest')


def _together(one: float, other: float, how: str) -> float:
    """Return two changes of one number as one."""
    return one + other if how == ADD else (1.0 + one) * (1.0 + other) - 1.0


def _apart(both: float, other: float, how: str) -> float:
    """Return the change of a number that makes both with another one."""
    return both - other if how == ADD else (1.0 + both) / (1.0 + other) - 1.0


def _tolerated(effect: Effect, tolerances: Sequence[AntennaParameter]) -> Effect:
    """Return an effect whose parameters know by how much their numbers may be off anyway."""
    allowed = {(path, item.modifier.how): item.high for item in tolerances
               if item.experiment is None for path in item.modifier.fields}

    def tolerated(item: Parameter) -> Parameter:
        assert isinstance(item, AntennaParameter)
        modifier: Modifier = item.modifier
        same_number = min(
            (allowed.get((path, modifier.how), 0.0) for path in modifier.fields), default=0.0)
        return replace(item, tolerance=max(item.tolerance, same_number))

    return replace(effect, forms=tuple(
        replace(form, parameters=tuple(tolerated(p) for p in form.parameters))
        for form in effect.forms))


def _disturbed(plan: batch.Schedule, run: RunSetup, place: DriveDisturbance,
               course: Course) -> batch.Schedule:
    """Return a plan that lets an input into the drive, and set the drive's record up for it."""
    for path, how, value in place.settings:
        change(run.numbers, place_of(run.kind, path), how, value)
    steps = plan.steps.copy()
    length = steps[:, batch.LENGTH]
    steps[:, batch.CHANGE] = place.size * course(np.cumsum(length) - 0.5 * length)
    return batch.Schedule(steps, plan.keep, place_of(run.kind, place.path))
