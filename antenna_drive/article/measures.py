# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Figures by name: those that the article publishes and those that a calibration aims at.

A `Readout` is taken from a weighted sum of one experiment's signals. A `Trend` compares several
figures in order. A `ModelFigure` needs no run. `Results` runs each experiment only once.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
import math
from typing import Any

from antenna_drive.article import readings
from antenna_drive.article.experiments import (
    DriveExperiment, experiments, filter_variants, GAINS, LAGS, rate_step, SAW_TOOTH, SQUARE,
    TAU_6_NEW, TAU_6_OLD,
)
from antenna_drive.article.stability import simulated_limit, stability_limit
from antenna_drive.emulator.run import MACRO_STEP, Run, simulate
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters import Drive, load
import numpy as np

# The circuits in config/, of the article's Table 1.
OLD_CIRCUIT, NEW_CIRCUIT = 'old_circuit', 'new_circuit'
# Windows after each reversal of the square wave [s]: the plateau, and the swings before it.
PLATEAU = (1.5, 3.0)
CALM = (0.25, 2.0)


class Results:
    """
    The runs of the experiments for one parameter set; each is simulated on first use.

    drives : the drive with each circuit, by the circuit's name in config/
    known : the experiments, by name
    run : runs an experiment on its drive; by default the emulator in one process
    """

    def __init__(self, drives: Mapping[str, Drive],
                 known: Mapping[str, DriveExperiment] | None = None,
                 run: Callable[[DriveExperiment, Drive], Run] | None = None) -> None:
        """Store the parameters; nothing is run yet."""
        self.drives = drives
        self._known = known or article_experiments()
        self._simulate = run or (
            lambda experiment, drive: simulate(drive, experiment.duration, MACRO_STEP))
        self._runs: dict[str, Run] = {}

    def run(self, name: str) -> Run:
        """Return the run of an experiment; KeyError if there is none of that name."""
        if name not in self._runs:
            experiment = self._known[name]
            drive = experiment.applied_to(self.drives[experiment.circuit])
            self._runs[name] = self._simulate(experiment, drive)
        return self._runs[name]


def with_circuits(*configuration: str) -> dict[str, Drive]:
    """Return the drive of a configuration with each circuit of config/, by name."""
    return {circuit: load(*configuration, circuit) for circuit in (OLD_CIRCUIT, NEW_CIRCUIT)}


def article_experiments() -> dict[str, DriveExperiment]:
    """Return every experiment that a figure of the article is taken from, by name."""
    step = rate_step()
    return {**experiments(), **filter_variants(), step.name: step}


@dataclass(frozen=True)
class Measure:
    """A figure."""

    name: str  # as 'T4a.overshoot'
    unit: str

    def value(self, results: Results) -> float:
        """Return the figure that a parameter set gives."""
        raise NotImplementedError


@dataclass(frozen=True)
class Readout(Measure):
    """A figure taken from the run of one experiment."""

    experiment: str  # the run to read
    kind: str  # how it is evaluated, a key of `readings.KINDS`
    signal: Mapping[str, float]  # weight of each signal in the sum
    # further arguments of the evaluation
    arguments: Mapping[str, Any] = field(default_factory=dict)
    # another experiment; the figure is then the relative change against it [1]
    compared_with: str | None = None
    scale: float = 1.0  # the figure is multiplied by it

    def value(self, results: Results) -> float:
        value = self._read(results.run(self.experiment))
        if self.compared_with is not None:
            value = value / self._read(results.run(self.compared_with)) - 1.0
        return self.scale * value

    def _read(self, run: Run) -> float:
        return readings.KINDS[self.kind](run.time, weighted(run, self.signal), **self.arguments)


def weighted(run: Run, signal: Mapping[str, float]) -> FloatArray:
    """Return the weighted sum of signals of a run, shape (n,)."""
    return np.asarray(sum(weight * run[name] for name, weight in signal.items()), np.float64)


@dataclass(frozen=True)
class Trend(Measure):
    """The largest violation of a trend by figures in order; below zero it holds strictly."""

    of: tuple[Measure, ...]  # the figures in order
    kind: str  # 'falls', or 'falls then rises'

    def value(self, results: Results) -> float:
        """Return the greatest step against the trend, below zero if there is none."""
        return readings.TRENDS[self.kind]([figure.value(results) for figure in self.of])


@dataclass(frozen=True)
class ModelFigure(Measure):
    """A figure that does not come from the run of an experiment."""

    of: Callable[[Drive], float]  # gives the figure of a drive
    circuit: str = OLD_CIRCUIT  # name of the circuit that the drive has

    def value(self, results: Results) -> float:
        return self.of(results.drives[self.circuit])


def article_measures(drive: Drive) -> dict[str, Measure]:
    """
    Return every figure that the article publishes and a run or the model can give, by name.

    drive : for the gear ratio and the greatest current, by which figures are scaled
    """
    ratio, most = drive.plant.axis.gear_ratio, drive.motor_1.motor.current_limit
    degrees = 180.0 / math.pi
    whole_periods = {'after': SQUARE['period']}
    plateau = {'period': SQUARE['period'], 'window': PLATEAU}
    calm = {'period': SQUARE['period'], 'window': CALM}
    tachs = {'motor_1/tach_rate': 0.5, 'motor_2/tach_rate': 0.5}
    bias = {'motor_2/current': 100.0 / most, 'motor_1/current': -100.0 / most}
    voltage = {'torque_share/bias_voltage': 1.0}
    figures: list[Measure] = [
        Readout('T1.tach_rate', 'deg/s', 'T1', 'plateau',
                {name: degrees * weight for name, weight in tachs.items()}, plateau),
        *(Readout(f'T1.current_{m}', 'article A', 'T1', 'plateau',
                  {f'motor_{m}/current': 1.0}, plateau) for m in (1, 2)),
        Readout('T2a.bias', 'percent', 'T2', 'mean', bias, whole_periods),
        *(Readout(f'T2a.current_{m}', 'article A', 'T2', 'mean',
                  {f'motor_{m}/current': 1.0}, whole_periods) for m in (1, 2)),
        Readout('T2b.tach', 'percent', 'T2', 'deviation',
                {**tachs, 'test_signal/rate_command': -ratio}, calm, 'T1', 100.0),
        Readout('T2b.encoder', 'percent', 'T2', 'deviation',
                {'plant/axis_rate': 1.0, 'test_signal/rate_command': -1.0}, calm, 'T1', 100.0),
        Readout('step.overshoot', 'percent', 'step', 'overshoot', tachs, {}, None, 100.0),
    ]
    greatest = drive.torque_share.circuit.saturation_high
    for name in ('T3a', 'T3b'):
        figures += [Readout(f'{name}.{quantity}', unit, name, quantity.removesuffix('_share'),
                            voltage, {'after': SAW_TOOTH['period']}, None, scale)
                    for quantity, unit, scale in (
                        ('low', 'V', 1.0), ('low_share', 'percent', 100.0 / greatest),
                        ('high', 'V', 1.0), ('high_share', 'percent', 100.0 / greatest),
                        ('time_at_zero', 'percent', 100.0))]
    for name in ('T4a', 'T4e', *filter_variants()):
        figures += [
            Readout(f'{name}.final', 'percent', name, 'final', bias),
            Readout(f'{name}.overshoot', 'percent', name, 'overshoot', bias, {}, None, 100.0),
            Readout(f'{name}.settling', 's', name, 'settling', bias)]
    by_name = {figure.name: figure for figure in figures}
    for row, numbers, kinds in (('T4b', GAINS, ('falls', 'falls')),
                                ('T4d', LAGS, ('falls', 'falls then rises'))):
        for kind, (quantity, unit) in zip(kinds, (('overshoot', 'percent'), ('settling', 's'))):
            name = f'{row}.{quantity}_trend'
            by_name[name] = Trend(name, unit, tuple(
                by_name[f'{row} {number:g}.{quantity}'] for number in numbers), kind)
    for name, pole, held in (('T4c.limit', 1.0 / TAU_6_OLD, True),
                             ('T4c.limit_rotors_free', 1.0 / TAU_6_OLD, False),
                             ('literal.limit', 1.0 / TAU_6_NEW, True)):
        by_name[name] = ModelFigure(name, '1/s', partial(stability_limit, pole=pole,
                                                         rotors_held=held))
    for name, pole in (('T4c.simulated', 1.0 / TAU_6_OLD), ('literal.simulated', 1.0 / TAU_6_NEW)):
        by_name[name] = ModelFigure(name, '1/s', partial(simulated_limit, pole=pole))
    return by_name
