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
"""The antenna drive as a `Model`: recordings and their sheets in, predicted readings out."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
import math
from typing import Any

from antenna_drive.emulator import batch
from antenna_drive.errors import UserError
from antenna_drive.gap import catalogue
from antenna_drive.gap.catalogue import ADD, DriveParameter, SCALE, Setting, Wave
from antenna_drive.gap.excitation import Bias, Command, RecordedCommand, schedule, SheetCommand
from antenna_drive.gap.model import Effect, Experiment, FloatArray, Form, Point
from antenna_drive.gap.residuals import Motion
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.recording import sheet as sheets
from antenna_drive.recording.recording import Recording
import numpy as np

CHANNELS = {
    'motor_1/ammeter': 'current_1', 'motor_2/ammeter': 'current_2',
    'motor_1/tach_rate': 'tach_1', 'motor_2/tach_rate': 'tach_2',
    'plant/encoder': 'encoder', 'torque_share/bias_voltage': 'bias_voltage',
}
# Where a recording may keep the same reading under another name.
_ALIASES = {'motor_1/ammeter': ('motor_1/current',), 'motor_2/ammeter': ('motor_2/current',)}
UNITS = ('A', 'A', 'rad/s', 'rad/s', 'rad', 'V')
CURRENT_1, CURRENT_2, TACH_1, TACH_2, ENCODER, BIAS = range(6)

LONGEST_STEP = 2.5e-3
# Samples are thinned to about this rate; they are never averaged, which would hide a ripple.
SAMPLE_RATE = 110.0
# What numbers of the machine the configuration knows only within the sheet's tolerance.
_TOLERANT_MOTOR = (
    'rate_command.k_s', 'rate_command.k_1', 'rate_command.tau_1', 'amplifier.rate_gain',
    'amplifier.integral_time', 'amplifier.lag', 'amplifier.current_feedback_gain',
    'amplifier.tach_gain', 'amplifier.bias_command_gain', 'armature.resistance',
    'armature.inductance', 'armature.back_emf_constant', 'motor.torque_constant',
    'motor.current_limit', 'motor.rotor_inertia', 'motor.coulomb_torque', 'motor.stiction_ratio',
    'gearbox.stiffness', 'gearbox.half_gap', 'gearbox.contact_damping',
)
_TOLERANT_DRIVE = (
    'torque_share.torque_share.bias_pot', 'torque_share.torque_share.fade_out_voltage',
    'torque_share.torque_share.current_to_voltage', 'torque_share.torque_share.k_2',
    'torque_share.torque_share.s_2', 'torque_share.torque_share.k_3',
    'torque_share.torque_share.g_4', 'torque_share.torque_share.saturation_high',
    'torque_share.filter_1.gain', 'torque_share.filter_1.pole',
    'torque_share.filter_1.difference_gain',
    'plant.axis.inertia_hub', 'plant.axis.coulomb_torque', 'plant.axis.stiction_ratio',
    *(f'plant.axis.{name}.{j}' for name in (
        'mode_inertias', 'mode_frequencies', 'mode_damping_ratios') for j in range(3)),
)
_EXTRA = 3
_CACHE = 400


@dataclass(frozen=True)
class Sensors:
    """What the sensors add: standard deviations and steps; usual ones if the sheet is silent."""

    current_noise: float = 0.01
    current_step: float = 0.01
    tach_noise: float = 0.0035
    tach_relative: float = 0.0015
    tach_step: float = 0.002
    encoder_step: float = 2.0 * math.pi / 2 ** 21
    bias_noise: float = 0.01
    bias_step: float = 0.01

    @classmethod
    def of(cls, given: sheets.Sensors | None) -> Sensors:
        """Take what the sheet says."""
        if given is None:
            return cls()
        known = {'current_noise': given.current_noise_A, 'current_step': given.current_step_A,
                 'tach_noise': given.tach_noise_rad_s, 'tach_relative': given.tach_noise_relative,
                 'tach_step': given.tach_step_rad_s, 'bias_noise': given.bias_noise_V,
                 'bias_step': given.bias_step_V}
        if given.encoder_bits is not None:
            known['encoder_step'] = 2.0 * math.pi / 2 ** given.encoder_bits
        return cls(**{name: value for name, value in known.items() if value is not None})

    def noise(self, clean: FloatArray, slope: FloatArray, jitter: float) -> FloatArray:
        """Return the standard deviation of each reading; arrays of shape (n, 6)."""
        noise = np.empty_like(clean)
        noise[:, :2] = math.hypot(self.current_noise, self.current_step / math.sqrt(12.0))
        noise[:, 2:4] = np.sqrt(self.tach_noise ** 2 + self.tach_step ** 2 / 12.0
                                + (self.tach_relative * clean[:, 2:4]) ** 2)
        noise[:, 4] = 0.5 * self.encoder_step  # what is left within a step is no white noise
        noise[:, 5] = math.hypot(self.bias_noise, self.bias_step / math.sqrt(12.0))
        return np.asarray(np.sqrt(noise ** 2 + (slope * jitter) ** 2))


@dataclass
class _Test:
    """One recording, prepared."""

    name: str
    record: np.ndarray[Any, np.dtype[Any]]
    command: Command
    bias: Bias
    time: FloatArray
    sensors: Sensors
    jitter: float
    plan: batch.Schedule | None = None


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
        self._cache: OrderedDict[Any, FloatArray] = OrderedDict()
        self.notes: list[str] = []
        self.runs = 0
        self.effects: dict[str, Effect] = catalogue.catalogue()
        self._tests = [self._test(name, recording, drive)
                       for name, recording in recordings.items()]
        gust = self.effects[catalogue.GUST]
        self.effects[gust.id] = replace(gust, forms=(catalogue.gust_form(
            [float(test.time[-1]) for test in self._tests]),))
        given = [recording.sheet.parameter_tolerance for recording in recordings.values()
                 if recording.sheet.parameter_tolerance is not None]
        if not given:
            self.notes.append(f'no sheet gives parameter_tolerance: {tolerance:g} assumed')
        self.tolerance = max(given, default=tolerance)
        self.nuisances = self._nuisances()
        self._by_name: dict[str, Any] = {item.name: item for item in self.nuisances}
        for effect in self.effects.values():
            for form in effect.forms:
                self._by_name.update((item.name, item) for item in form.parameters)
        self._waves: dict[str, tuple[Wave, int]] = {}
        self.experiments = self._experiments(recordings)

    # -- preparing -----------------------------------------------------------------------------

    def _test(self, name: str, recording: Recording, drive: Drive) -> _Test:
        sheet = recording.sheet
        rate = 'test_signal/rate_command'
        if rate not in recording or len(recording[rate]) < 10:
            raise UserError(f'{name}: no rate command is recorded; {rate} '
                            '(rate_command_rad_s in a CSV) is needed')
        if not any(self._channel(recording, channel) for channel in CHANNELS):
            raise UserError(f'{name}: there is no reading beside the rate command, '
                            'at least one current is needed')
        for part, given, file in (('torque_share.torque_share', sheet.circuit, 'circuit'),
                                  ('torque_share.filter_1', sheet.filter_1, 'filter_1')):
            if given is None:
                self.notes.append(f'{name}: the sheet does not give {file}: as configured')
                continue
            other = load(f'{given}_circuit').torque_share
            names = ('gain', 'pole') if file == 'filter_1' else ('k_2', 's_2', 'k_3', 'g_4')
            source = other.filter_1 if file == 'filter_1' else other.torque_share
            drive = changed(drive, {f'{part}.{key}': getattr(source, key) for key in names})
        drive, bias = self._bias(name, sheet.bias, drive)
        if sheet.elevation_deg is not None:
            drive = changed(drive, {
                'plant.axis.start_elevation': math.radians(sheet.elevation_deg)})
        record = record_of(drive)
        axis = record['plant']['axis']
        axis['mode_frequencies'][0, _EXTRA] = 1.0
        channel = recording[rate]
        time = channel.time_s
        command: Command = RecordedCommand.of(time, channel.values)
        if sheet.waveform is not None:
            exact = SheetCommand(sheet.waveform)
            wrong = np.abs(exact(time) - channel.values) > 0.05 * np.ptp(channel.values)
            if np.mean(wrong) < 0.02:
                command = exact
            else:
                self.notes.append(f"{name}: the recorded command is not the sheet's waveform, "
                                  'it was interpolated')
        else:
            self.notes.append(f'{name}: no waveform in the sheet, the recorded command was '
                              'interpolated')
        time = self._times(recording)
        spacing = np.diff(time)
        line = np.polyval(np.polyfit(np.arange(time.size), time, 1), np.arange(time.size))
        jitter = 0.0
        if time.size > 3:
            jitter = float(min(np.std(time - line), 0.5 * np.median(spacing)))
        return _Test(name, record, command, bias, time, Sensors.of(sheet.sensors), jitter)

    def _bias(self, name: str, given: sheets.Bias | None, drive: Drive) -> tuple[Drive, Bias]:
        share = 'torque_share.torque_share.'
        if isinstance(given, sheets.CircuitBias):
            changes: dict[str, Any] = {f'{share}bias_source': 'circuit'}
            if given.bias_pot is not None:
                changes[f'{share}bias_pot'] = given.bias_pot
            if given.start is not None:
                changes[f'{share}start'] = given.start
            return changed(drive, changes), Bias()
        if given is None:
            self.notes.append(f'{name}: the sheet does not give the bias: as configured')
            voltage = drive.torque_share.torque_share.fixed_voltage
            return drive, Bias(voltage, voltage)
        voltage = given.voltage_V or 0.0
        drive = changed(drive, {f'{share}bias_source': 'fixed'})
        if isinstance(given, sheets.FixedStepBias):
            return drive, Bias(0.0, voltage, given.at_s or 0.0)
        return drive, Bias(voltage, voltage)

    @staticmethod
    def _channel(recording: Recording, name: str) -> Any:
        for alias in (name, *_ALIASES.get(name, ())):
            if alias in recording and len(recording[alias]):
                return recording[alias]
        return None

    def _times(self, recording: Recording) -> FloatArray:
        """Return the times of the samples that are used: those of the most sampled reading."""
        channels = [self._channel(recording, name) for name in CHANNELS]
        time = max((c.time_s for c in channels if c is not None), key=len)
        time = time[time >= 0.0]
        every = max(1, round(1.0 / float(np.median(np.diff(time))) / SAMPLE_RATE))
        return np.asarray(time[::every])

    def _nuisances(self) -> tuple[DriveParameter, ...]:
        tol = self.tolerance
        found = []
        for motor in ('motor_1', 'motor_2'):
            found += [f'{motor}.{name}' for name in _TOLERANT_MOTOR]
        found += _TOLERANT_DRIVE
        parameters = [DriveParameter(f'offset:{path}', '1', -tol, tol, 0.3 * tol,
                                     tol / math.sqrt(3.0), how=SCALE, fields=(path,))
                      for path in found]
        for k, test in enumerate(self._tests):
            for motor in ('motor_1', 'motor_2'):
                parameters.append(DriveParameter(
                    f'start:{test.name}.{motor}', '1', -1.0, 1.0, 0.05, 0.6, experiment=k,
                    how=ADD, fields=(f'{motor}.start_in_gap',)))
            if test.record['torque_share']['torque_share']['bias_source'][0] == 1:
                parameters.append(DriveParameter(
                    f'supply:{test.name}', '1', -tol, tol, 0.3 * tol, tol / math.sqrt(3.0),
                    experiment=k, how=SCALE))
            parameters.append(DriveParameter(
                f'zero:encoder:{test.name}', 'rad', -4e-5, 4e-5, 2e-6, 1e-5, experiment=k,
                reading=True))
            parameters.append(DriveParameter(
                f'clock:{test.name}', 's', -0.01, 0.01, 1e-4, 1e-3, experiment=k, reading=True))
        for name, unit, spread in (
                ('current_1', 'A', 0.01), ('current_2', 'A', 0.01), ('tach_1', 'rad/s', 0.003),
                ('tach_2', 'rad/s', 0.003), ('bias_voltage', 'V', 0.01)):
            parameters.append(DriveParameter(f'zero:{name}', unit, -3.0 * spread, 3.0 * spread,
                                             spread, spread, reading=True))
        return tuple(parameters)

    def _experiments(self, recordings: Mapping[str, Recording]) -> tuple[Experiment, ...]:
        experiments = []
        for test, recording in zip(self._tests, recordings.values(), strict=True):
            measured = np.full((test.time.size, len(CHANNELS)), np.nan)
            for c, name in enumerate(CHANNELS):
                channel = self._channel(recording, name)
                if channel is None:
                    self.notes.append(f'{test.name}: {name} was not recorded')
                    continue
                times = channel.time_s
                at = np.clip(np.searchsorted(times, test.time - 1e-9), 0, times.size - 1)
                there = np.abs(times[at] - test.time) < 1e-6
                measured[there, c] = channel.values[at[there]]
            out = self._run(test, {}, 0.0, None)
            noise = test.sensors.noise(out[:, :, 0], out[:, :, 1], test.jitter)
            experiments.append(Experiment(test.name, test.time, tuple(CHANNELS.values()), UNITS,
                                          measured, noise))
        return tuple(experiments)

    def motion(self, k: int) -> Motion:
        """Return how the machine moved in an experiment: as measured, else as simulated."""
        experiment = self.experiments[k]
        predicted = self.simulate([{}], [k])[0][k]
        assert predicted is not None

        def signal(c: int) -> FloatArray:
            measured = experiment.measured[:, c]
            return np.where(np.isfinite(measured), measured, predicted[:, c])

        test = self._tests[k]
        return Motion(rate=0.5 * (signal(TACH_1) + signal(TACH_2)),
                      load=signal(CURRENT_1) + signal(CURRENT_2), angle=signal(ENCODER),
                      limit=float(test.record['motor_1']['motor']['current_limit'][0]))

    # -- running -------------------------------------------------------------------------------

    def forms(self, effect: Effect, residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return an effect's forms; those of a wave with the likeliest cycles per revolution."""
        found: list[Form] = []
        for form in effect.forms:
            if not isinstance(form, Wave):
                found.append(form)
                continue
            for order in self._orders(form, residuals):
                wave = form.at(order)
                self.register(wave)
                found.append(wave)
        return found

    def register(self, wave: Wave) -> None:
        """Make a wave's parameters known."""
        for part, item in enumerate(wave.parameters):
            self._waves[item.name] = (wave, part)

    def absorbed(self, point: Point, gone: Point) -> dict[str, float]:
        """Return the offsets that do as much as they can of what an effect did."""
        result = dict(point)
        for name, value in gone.items():
            item = self._by_name.get(name)
            if not isinstance(item, DriveParameter) or item.how != SCALE:
                continue
            for path in item.fields:
                offset = self._by_name.get(f'offset:{path}')
                if offset is not None and offset.name in result:
                    both = (1.0 + result[offset.name]) * (1.0 + value) - 1.0
                    result[offset.name] = min(max(both, offset.low), offset.high)
        return result

    def _orders(self, form: Wave, residuals: Sequence[FloatArray]) -> list[float]:
        """Return the cycles per revolution with which the residuals vary most."""
        score = np.zeros(len(form.orders))
        orders = np.array(form.orders)
        for experiment, residual in zip(self.experiments, residuals, strict=True):
            score += _order_scores(form, experiment, residual, orders)
        best: list[float] = []
        for j in np.argsort(score)[::-1]:
            if form.angle == 'axis' and any(abs(math.log(orders[j] / b)) < 0.15 for b in best):
                continue
            best.append(float(orders[j]))
            if len(best) == _WAVES:
                break
        return best

    def _settings(self, point: Point) -> tuple[list[Setting], float, dict[str, float]]:
        """Return what a point sets in the record, the delay, and values read from it later."""
        settings: list[Setting] = []
        waves: dict[Wave, list[float]] = {}
        delay = 0.0
        readings: dict[str, float] = {}
        for name, value in point.items():
            if name == catalogue.DELAY:
                delay = value
            elif name.startswith(('clock:', 'zero:')):
                readings[name] = value
            elif name.startswith('supply:'):
                settings.append((name, SCALE, value))
            elif name in self._waves:
                form, part = self._waves[name]
                waves.setdefault(form, [0.0, 0.0, 0.0])[part] = value
            else:
                item = self._by_name[name]
                assert isinstance(item, DriveParameter)
                settings.extend((path, item.how, value) for path in item.fields)
        for form, (sine, cosine, change) in waves.items():
            settings += form.settings(sine, cosine, change)
        return settings, delay, readings

    def _run(self, test: _Test, settings: Any, delay: float, torque: Any,
             until: float = math.inf) -> FloatArray:
        record = test.record.copy()
        bias = test.bias
        gust: dict[int, float] = {}
        for path, how, value in settings:
            if path.startswith('gust:'):
                gust[int(path.rpartition(':')[2])] = value
            elif path.startswith('supply:'):
                bias = Bias(bias.before * (1.0 + value), bias.after * (1.0 + value), bias.at)
            else:
                _apply(record, path, how, value)
        axis = record['plant']['axis']
        if axis['mode_inertias'][0, _EXTRA] > 0.0:
            axis['mode_inertias_count'] = _EXTRA + 1
        if gust:
            knots = np.arange(max(gust) + 1)
            torque = (knots * catalogue.GUST_KNOT_S,
                      np.array([gust.get(i, 0.0) for i in range(knots.size)]))
        plan = self._plan(test, bias, delay, torque)
        samples = int(np.count_nonzero(test.time < until))
        if samples == test.time.size:
            return batch.run(record, plan)
        steps = int(np.argmax(plan.keep == samples - 1))
        out = np.full((test.time.size, len(CHANNELS), 2), np.nan)
        out[:samples] = batch.run(record, batch.Schedule(plan.steps[:steps],
                                                         plan.keep[:steps + 1]))
        return out

    def _plan(self, test: _Test, bias: Bias, delay: float, torque: Any) -> batch.Schedule:
        if delay:
            return schedule(test.command, bias, test.time, LONGEST_STEP, delay, torque)
        if test.plan is None:
            test.plan = schedule(test.command, test.bias, test.time, LONGEST_STEP)
        if torque is not None:
            steps = test.plan.steps.copy()
            ends = np.cumsum(steps[:, batch.LENGTH])
            left = np.interp(ends - steps[:, batch.LENGTH], *torque)
            steps[:, batch.TORQUE] = left
            steps[:, batch.TORQUE_SLOPE] = (np.interp(ends, *torque) - left) / steps[
                :, batch.LENGTH]
            if bias != test.bias:
                middle = ends - 0.5 * steps[:, batch.LENGTH]
                steps[:, batch.FIXED_BIAS] = np.where(middle < bias.at, bias.before, bias.after)
            return batch.Schedule(steps, test.plan.keep)
        if bias == test.bias:
            return test.plan
        steps = test.plan.steps.copy()
        middle = np.cumsum(steps[:, batch.LENGTH]) - 0.5 * steps[:, batch.LENGTH]
        steps[:, batch.FIXED_BIAS] = np.where(middle < bias.at, bias.before, bias.after)
        return batch.Schedule(steps, test.plan.keep)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = math.inf) -> list[list[FloatArray | None]]:
        """Return what the sensors would have shown; see `Model.simulate`."""
        only = only or [None] * len(points)
        jobs: list[tuple[int, int, Any, Any]] = []
        results: list[list[FloatArray | None]] = [[None] * len(self._tests) for _ in points]
        wanted: OrderedDict[Any, tuple[_Test, Any, float]] = OrderedDict()
        for i, (point, one) in enumerate(zip(points, only, strict=True)):
            settings, delay, readings = self._settings(point)
            for k, test in enumerate(self._tests):
                if one is not None and one != k:
                    continue
                mine = tuple(sorted(s for s in settings if not self._foreign(s, point, k)))
                dynamic = tuple(s for s in mine if not s[0].startswith(_READING_FIELDS))
                key = (k, delay, dynamic, until)
                if key not in self._cache:
                    wanted[key] = (test, dynamic, delay)
                jobs.append((i, k, key, (mine, readings)))
        self.runs += len(wanted)
        outs = self._executor.map(lambda job: self._run(job[0], job[1], job[2], None, until),
                                  wanted.values())
        fresh = dict(zip(wanted, outs, strict=True))
        for i, k, key, (mine, readings) in jobs:
            out = fresh[key] if key in fresh else self._cache[key]
            results[i][k] = self._read(k, out, mine, readings)
        self._cache.update(fresh)
        while len(self._cache) > _CACHE:
            self._cache.popitem(last=False)
        return results

    def _foreign(self, setting: Setting, point: Point, experiment: int) -> bool:
        """Tell whether a setting belongs to another experiment."""
        path = setting[0]
        if path.startswith('gust:'):
            return int(path.split(':')[1]) != experiment
        if path.startswith('supply:'):
            return path != f'supply:{self._tests[experiment].name}'
        if not path.endswith('start_in_gap'):
            return False
        motor = path.partition('.')[0]
        return setting[2] != point.get(f'start:{self._tests[experiment].name}.{motor}', 0.0)

    def _read(self, k: int, out: FloatArray, settings: Iterable[Setting],
              readings: Mapping[str, float]) -> FloatArray:
        """Return the readings of a run: what sensors do that nothing feeds back."""
        test = self._tests[k]
        values = out[:, :, 0].copy()
        gains = {path: value for path, _, value in settings if path.startswith(_READING_FIELDS)}
        clock = readings.get(f'clock:{test.name}', 0.0)
        if clock:
            values += clock * out[:, :, 1]
        for m in (1, 2):
            path = f'motor_{m}.ammeter.'
            values[:, m - 1] *= 1.0 + gains.get(f'{path}gain', 0.0)
            values[:, m - 1] += gains.get(f'{path}offset', 0.0)
        values[:, BIAS] *= 1.0 + gains.get('torque_share.torque_share.voltmeter_gain', 0.0)
        path = 'plant.encoder.'
        angle = values[:, ENCODER]
        if f'{path}cyclic_error' in gains:
            values[:, ENCODER] = angle + gains[f'{path}cyclic_error'] * np.sin(
                gains[f'{path}cyclic_error_cycles'] * angle + gains[f'{path}cyclic_error_phase'])
        values[:, ENCODER] += gains.get(f'{path}offset', 0.0)
        for c, name in enumerate(CHANNELS.values()):
            values[:, c] += readings.get(f'zero:{name}', 0.0)
        values[:, ENCODER] += readings.get(f'zero:encoder:{test.name}', 0.0)
        step = gains.get(f'{path}step', 0.0)
        if step > 0.0:
            values[:, ENCODER] = step * np.floor(values[:, ENCODER] / step + 0.5)
        return values


_READING_FIELDS = ('motor_1.ammeter', 'motor_2.ammeter', 'plant.encoder',
                   'torque_share.torque_share.voltmeter_gain')


# How many cycles per revolution are tried of each wave.
_WAVES = 3
_WINDOW_S = 1.5


def _order_scores(form: Wave, experiment: Experiment, residual: FloatArray,
                  orders: FloatArray) -> FloatArray:
    """Return how much of a residual varies with each number of cycles per revolution."""
    clean = np.nan_to_num(residual / experiment.noise)
    time = experiment.time
    if form.angle == 'axis':
        angle = np.nan_to_num(experiment.measured[:, ENCODER])
        rate = np.gradient(angle, time)
        if form.stem == 'cyclic_error':
            signals = clean[:, ENCODER][np.newaxis]
        else:
            moving = np.abs(rate) > 0.1 * np.abs(rate).max()
            signals = (clean[:, CURRENT_1] + clean[:, CURRENT_2])[np.newaxis] * (
                np.sign(rate) * moving)
        windows = np.zeros(time.size, int)
    else:
        m = int(form.angle[-1]) - 1
        rate = np.nan_to_num(experiment.measured[:, TACH_1 + m])
        angle = np.r_[0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))]
        signals = clean[:, [CURRENT_1 + m, TACH_1 + m]].T
        windows = (time / _WINDOW_S).astype(int)
    score = np.zeros(orders.size)
    for signal in signals:
        for w in range(windows[-1] + 1):
            inside = windows == w
            if np.count_nonzero(inside) < 10:
                continue
            part = signal[inside] - signal[inside].mean()
            wave = np.exp(-1j * np.outer(orders, angle[inside]))
            wave -= wave.mean(axis=1, keepdims=True)
            power = np.sum(np.abs(wave) ** 2, axis=1) + 1e-3
            score += np.abs(wave @ part) ** 2 / power
    return score


def _apply(record: np.ndarray[Any, np.dtype[Any]], path: str, how: str, value: float) -> None:
    """Change one field of a record; the path may end in the index of a list."""
    *parts, last = path.split('.')
    place: Any = record
    for part in parts:
        place = place[part]
    index: Any = 0
    if last.isdigit():
        index = (0, int(last))
        field = place
    else:
        field = place[last]
    if how == SCALE:
        field[index] *= 1.0 + value
    elif how == ADD:
        field[index] += value
    else:
        field[index] = value
