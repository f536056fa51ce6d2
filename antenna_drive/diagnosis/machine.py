# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The antenna drive of a configuration, in the tests that were recorded, as a `Machine`."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
import copy
from dataclasses import dataclass, replace
from functools import cached_property
import math
from threading import Lock
from typing import Any

from antenna_drive.diagnosis.catalogue import AntennaCatalogue, catalogue, EXTRA_MODE
from antenna_drive.diagnosis.diagram import DIAGRAM
from antenna_drive.diagnosis.disturbances import disturbances, disturbed, DriveDisturbance
from antenna_drive.diagnosis.excitation import Longest
from antenna_drive.diagnosis.field_test import FieldTest, Plans, prepared
from antenna_drive.diagnosis.late_readings import Outputs, RipplingTachometer
from antenna_drive.diagnosis.laws import learnable
from antenna_drive.diagnosis.modifiers import KnownModifiers, RunSetup, SensorReadings
from antenna_drive.diagnosis.sensors import digit_of
from antenna_drive.diagnosis.tolerances import (
    AntennaNuisances, everyday_wind_torque, nuisances, tolerated,
)
from antenna_drive.diagnosis.waves import fastest_wave, is_there
from antenna_drive.diagnosis.words import advice, words
from antenna_drive.emulator import batch
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import AT, NAMED, READINGS, SIGNALS
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import CircuitBias, sheet_tree, TestSheet
import numpy as np
from simgap.machine.contract import (
    Course, DisturbanceInput, Experiment, FloatArray, Machine, Motion, Point, TimeScales,
)

LONGEST_STEP = 2.65e-3
# A search looks at this much of a test [s]. It and derivatives take longer steps, whose error is
# a tenth of the noise.
TRUNCATED_S = 15.0
LOW_FIDELITY_STEP = 5.6e-3
# A wave of the motors' angle turns by at most this much in a step [rad], down to a shortest
# step [s].
WAVE_STEP = 0.9
SHORTEST_STEP = 7e-4
# Hysteresis settles too fast for long steps.
_STIFF = ('hysteresis', 'hysteresis_share')
# An encoder's digit differs from the sheet's if it is larger by this factor.
_COARSER = 1.3
# Of the parameters, where no sheet gives it.
_TOLERANCE = 0.02
# Runs that are kept.
_KEPT_RUNS = 24


@dataclass(frozen=True)
class _Job:
    """A run that is wanted: the parameters that act on it, by name and value, and its end [s]."""

    experiment: int
    items: tuple[tuple[str, float], ...]
    until: float

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        # of hundreds of numbers, and asked for many times
        return hash((self.experiment, self.items, self.until))


class AntennaMachine(Machine):
    """
    The antenna drive of a configuration, in the tests that were recorded.

    recordings : of one machine, by name
    drive : the configuration
    threads : how many runs at once

    Raises UserError: a recording lacks its rate command or has no reading to compare.
    """

    catalogue: AntennaCatalogue
    time_scales = TimeScales(
        start_s=1.5, scan_s=8.0, pulse_s=0.15, response_s=1.5, block_s=1.0)
    diagram = DIAGRAM

    def __init__(self, recordings: Mapping[str, Recording], drive: Drive,
                 threads: int = 2) -> None:
        """Prepare the tests and take the sensors' noise from a first run."""
        # one thread needs no other, and no time to hand over to it
        self._map = ThreadPoolExecutor(threads).map if threads > 1 else map
        self._runs: OrderedDict[_Job, Outputs] = OrderedDict()
        self._lock = Lock()
        self._longest_step = LONGEST_STEP
        self._low_fidelity: AntennaMachine | None = None
        notes: list[str] = []
        self._tests = prepared(recordings, drive, notes.append)
        self._plans = Plans(self._tests)
        for test in self._tests:
            frequencies = test.record['plant']['axis']['mode_frequencies']
            if frequencies[0, EXTRA_MODE] == 0.0:
                frequencies[0, EXTRA_MODE] = 1.0
        given = [recording.sheet.parameter_tolerance for recording in recordings.values()
                 if recording.sheet.parameter_tolerance is not None]
        if not given:
            notes.append(f'no sheet gives parameter_tolerance: {_TOLERANCE:g} assumed')
        self.notes = notes
        self._digit = _coarser_digit(self._tests)
        tolerances = nuisances(self._tests, max(given, default=_TOLERANCE))
        effects = catalogue(self._digit)
        self.advice = advice()
        self.words = words(effects.values(), drive, self._tests[0].record)
        self._modifiers = KnownModifiers()
        super().__init__((), AntennaNuisances(tolerances, self._tests, self._modifiers),
                         AntennaCatalogue((tolerated(effect, tolerances)
                                           for effect in effects.values()), self._modifiers))
        self.disturbance_inputs = tuple(disturbances(everyday_wind_torque(self._tests[0])))
        self.experiments = self._experiments({})
        self.learnable = tuple(learnable(
            self._tests, [self.predict({}, k) for k in range(len(self._tests))], drive))
        self._modifiers.register(p for law in self.learnable
                                 for p in law.effect.forms[0].parameters)
        self.planning = {'sheet': sheet_tree(_in_common([test.sheet for test in self._tests]))}

    @property
    def records(self) -> Sequence[np.ndarray[Any, np.dtype[Any]]]:
        """Return the drive's record in each test: as configured and as the sheet says."""
        return [test.record for test in self._tests]

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
                test.measured, noise, labels=test.labels, excerpt=test.excerpt,
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
        other = self._with_long_steps([
            test.until(TRUNCATED_S if test.repeats else math.inf) for test in self._tests])
        other.experiments = tuple(
            replace(e, time=e.time[:n], measured=e.measured[:n], noise=e.noise[:n])
            for n, e in zip([test.time.size for test in other._tests], self.experiments,
                            strict=True))
        return other

    def low_fidelity(self) -> AntennaMachine:
        """Return the machine with longer steps."""
        if self._longest_step >= LOW_FIDELITY_STEP:
            return self
        if self._low_fidelity is None:
            self._low_fidelity = self._with_long_steps(self._tests)
        return self._low_fidelity

    def _with_long_steps(self, tests: list[FieldTest]) -> AntennaMachine:
        other = copy.copy(self)
        other._tests, other._plans, other._runs = tests, Plans(tests), OrderedDict()
        other._longest_step = LOW_FIDELITY_STEP
        return other

    # -- what it knows of its motion -----------------------------------------------------------

    def motion(self, experiment: int) -> Motion:
        """Return how it moves in an experiment, as measured or else as simulated."""
        recorded = self.experiments[experiment]
        predicted = self.predict({}, experiment)

        def signal(name: str) -> FloatArray:
            c = AT[name]
            measured = recorded.measured[:, c]
            return np.where(np.isfinite(measured), measured, predicted[:, c])

        limit = float(self._tests[experiment].record['motor_1']['motor']['current_limit'][0])
        return Motion(recorded.time, rate=0.5 * (signal('tach_1') + signal('tach_2')),
                      load=signal('current_1') + signal('current_2'), angle=signal('encoder'),
                      load_limit=2.0 * limit,
                      units={'rate': 'rad/s', 'load': 'article A', 'angle': 'rad'})

    # -- running -------------------------------------------------------------------------------

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

        for job, fresh in zip(uses, self._map(read, uses), strict=True):
            if fresh is not None:
                with self._lock:
                    self._runs[job] = fresh
                    while len(self._runs) > _KEPT_RUNS:
                        self._runs.popitem(last=False)
        return results

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        """Return the readings with an unknown input; see `Machine.simulate_disturbed`."""
        assert isinstance(place, DriveDisturbance)

        def run(k: int) -> FloatArray:
            job = self._job(k, point, math.inf)
            return self._read(k, self._run(job, (place, courses[k])), point)

        return list(self._map(run, range(len(self._tests))))

    def _job(self, k: int, point: Point, until: float) -> _Job:
        """Return the run of one test at a point: what acts on readings alone is not part of it."""
        known = self._modifiers.of_runs
        return _Job(k, tuple(sorted(item for item in point.items() if item[0] in known
                                    and known[item[0]][1] in (None, k))), until)

    def outputs(self, point: Point, experiment: int,
                channels: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
        """
        Return outputs of the drive in one experiment that no sensor reads.

        channels : names of c outputs, 'unit/signal'

        Returns times, shape (n,) [s], and values and slopes, shape (n, c, 2).
        """
        job = self._job(experiment, point, math.inf)
        return self._tests[experiment].output_times, self._run(job, channels=channels).values

    def _run(self, job: _Job, disturbance: tuple[DriveDisturbance, Course] | None = None,
             channels: tuple[str, ...] = SIGNALS) -> Outputs:
        test = self._tests[job.experiment]
        kind = test.record.dtype
        run = RunSetup(test.record.view(np.float64).copy(), kind, test.bias,
                       start_angle=test.start_angle)
        for name, value in job.items:
            self._modifiers.of_runs[name][0].apply(run, value)
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
        plan = self._plans.steps(job.experiment, run, Longest(
            longest, SHORTEST_STEP, WAVE_STEP, cycles))
        if disturbance is not None:
            plan = disturbed(plan, run, *disturbance)
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
            out[:samples] = batch.run(record, replace(
                plan, steps=plan.steps[:steps], keep=plan.keep[:steps + 1]), channels=wanted)
        return Outputs(out[:, :len(channels)], {
            name: RipplingTachometer(out[:, row, 0], record[motor]['tachometer'])
            for row, (name, motor) in enumerate(rippling.items(), len(channels))})

    def _read(self, k: int, out: Outputs, point: Point) -> FloatArray:
        """Return the readings of a run, with the errors of sensors that nothing feeds back."""
        errors = SensorReadings()
        for name, value in point.items():
            modifier, test = self._modifiers.of_readings.get(name, (None, None))
            if modifier is not None and test in (None, k) and value:
                modifier.apply_to_readings(errors, value)
        digits = self.experiments[k].measured[:, AT['encoder']] if self._digit else None
        return self._tests[k].readings_of(out, errors, digits)


def _coarser_digit(tests: Sequence[FieldTest]) -> float:
    """Return the encoder's digit if it is coarser than its sheet says, else 0 [rad]."""
    digit = min(digit_of(test.measured[:, AT['encoder']]) for test in tests)
    known = max(test.sensors.errors(NAMED['encoder']).digit for test in tests)
    return digit if digit > _COARSER * known else 0.0


def _in_common(sheets: Sequence[TestSheet]) -> TestSheet:
    """Return what a further test of the machine shares with those that were made."""
    bias = next((sheet.bias for sheet in sheets if isinstance(sheet.bias, CircuitBias)),
                sheets[0].bias)
    return replace(sheets[0], waveform=None, bias=bias, start='rest')
