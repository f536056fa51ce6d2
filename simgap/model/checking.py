# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a model of one's own, found out before any fit."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
import math
import time

import numpy as np
from simgap.errors import UserError
from simgap.logs.log import Log, OneTest
from simgap.machine.check import check_machine, check_tests, idle_effects
from simgap.machine.contract import FloatArray, Parameter
from simgap.model.declared import Model
from simgap.model.machine import OwnMachine
from simgap.model.response import NO_RESPONSE, responses, StepResponse, where_it_acts
from simgap.verdict.spoken import quantity

# Two difference quotients with a step and twice the step differ by less than this where the
# simulation is smooth.
_ROUGH = 0.5
_LEAST_SAMPLES = 50
# Runs of all tests for each number that may be fitted: 11 to 55 (lab/notebook/performance.md).
_RUNS_OF_A_NUMBER = 50


@dataclass(frozen=True)
class Checked:
    """What a check found: faults that have to be mended, and remarks, a line each."""

    faults: Sequence[str]
    remarks: Sequence[str]

    def summary(self) -> str:
        return '\n'.join([
            *(f'wrong: {line}' for line in self.faults), *self.remarks,
            f'{len(self.faults)} to mend' if self.faults else 'nothing is wrong'])


def check_model(model: Model, logs: Sequence[Log]) -> Checked:
    """Check a model with logs of its tests; the first fault of the contract ends the check."""
    try:
        machine = OwnMachine(model, logs)
        before = [{name: log[name].copy() for name in log.columns} for log in machine.logs]
        began = time.monotonic()
        check_machine(machine)
        check_tests(machine)
        compiling_s = time.monotonic() - began
        faults = [*_unknown_numbers(machine), *_changed_inputs(machine, before),
                  *_differs_in_itself(machine)]
        if not faults:
            faults += [*idle_effects(machine), *_idle_pushes(machine), *_rough(machine)]
        remarks = list(_remarks(machine, compiling_s))
        if not faults:
            remarks += _rough_effects(machine)
        return Checked(faults, remarks)
    except UserError as error:
        return Checked([str(error)], [])


def _unknown_numbers(machine: OwnMachine) -> Iterator[str]:
    asked: set[str] = set()
    for k, log in enumerate(machine.logs):
        numbers = machine.numbers({}, k)
        machine.simulated(numbers, OneTest(
            log, {name: np.zeros(log.time.size) for name in machine.model.push}))
        asked |= numbers.asked_for
    for name in machine.numbers({}, 0):
        if name not in asked:
            yield f'{name}: the simulation never asks for numbers.{name}'


def _changed_inputs(machine: OwnMachine,
                    before: Sequence[Mapping[str, FloatArray]]) -> Iterator[str]:
    for log, columns in zip(machine.logs, before, strict=True):
        for name, values in columns.items():
            if not np.array_equal(values, log[name], equal_nan=True):
                yield (f"{log.name}: the simulation writes into test['{name}']; let it work on a "
                       'copy')


def _differs_in_itself(machine: OwnMachine) -> Iterator[str]:
    for k, experiment in enumerate(machine.experiments):
        first, second = (machine.predict({}, k) for _ in range(2))
        change = float(np.nanmax(np.abs(first - second) / experiment.noise))
        if change > 0.0:
            yield (f'{experiment.name}: two runs with the same numbers differ by {change:.2g} '
                   'standard deviations; a simulation draws no random numbers and keeps no state')


def _idle_pushes(machine: OwnMachine) -> Iterator[str]:
    neutral = [machine.predict({}, k) for k in range(len(machine.logs))]
    for place in machine.disturbance_inputs:
        pushed = machine.simulate_disturbed({}, place, [np.ones_like] * len(neutral))
        change = max(_rms((one - other) / experiment.noise) for one, other, experiment in zip(
            pushed, neutral, machine.experiments, strict=True))
        if change < NO_RESPONSE:
            name = machine.push_at(place.name)
            yield f"push {name}: changes no reading; add test.push['{name}'] where it enters"


def _rough(machine: OwnMachine) -> Iterator[str]:
    """Yield numbers by which the readings have no derivative, or that change nothing."""
    for parameter in machine.nuisances:
        found = list(responses(machine, parameter, {}))
        if not any(item.acts for item in found):
            yield f'{parameter.name}: changes no reading in these tests; make it known()'
        yield from _told(parameter, found)


def _rough_effects(machine: OwnMachine) -> Iterator[str]:
    """Yield numbers of effects by which a fit will be hard."""
    for effect in machine.catalogue.values():
        form = effect.forms[0]
        for parameter in form.sizes:
            if not any(item.acts for item in responses(machine, parameter, form.start)):
                yield (f'{parameter.name}: a step of {quantity(parameter.step, parameter.unit)} '
                       'from 0 changes no reading, and a search begins there; let it act from 0 '
                       'on, or give a larger step=')
            yield from _told(parameter, responses(
                machine, parameter, where_it_acts(form, parameter)))


def _told(parameter: Parameter, found: Iterable[StepResponse]) -> Iterator[str]:
    worst = max((item.roughness for item in found), default=0.0)
    if worst > _ROUGH:
        yield (f'{parameter.name}: the derivative of the readings by it is noise: it changes by '
               f'{100.0 * min(worst, 9.99):.0f} % where the step of '
               f'{quantity(parameter.step, parameter.unit)} is doubled; leave digits out of the '
               'simulation, let it switch between samples, or give a larger step=')


def _rms(change: FloatArray) -> float:
    return math.sqrt(float(np.nanmean(change ** 2)))


def _remarks(machine: OwnMachine, compiling_s: float) -> Iterator[str]:
    began = time.monotonic()
    before = machine.simulate([{}])[0]
    run_s = time.monotonic() - began
    for experiment, predicted in zip(machine.experiments, before, strict=True):
        assert predicted is not None
        rate = 1.0 / float(np.median(np.diff(experiment.time)))
        yield (f'{experiment.name}: {experiment.time.size} samples are compared, {rate:.3g} per '
               'second')
        for j, channel in enumerate(experiment.channels):
            measured = experiment.measured[:, j]
            count = int(np.isfinite(measured).sum())
            if count <= _LEAST_SAMPLES:
                yield (f'{experiment.name}: {channel}: {count} samples, too few to judge; more '
                       f'than {_LEAST_SAMPLES} are needed')
                continue
            yield (f'{experiment.name}: {channel}: measured {np.nanmin(measured):.4g} to '
                   f'{np.nanmax(measured):.4g}, simulated {np.min(predicted[:, j]):.4g} to '
                   f'{np.max(predicted[:, j]):.4g} {experiment.units[j]}; gap before any fit '
                   f'{_rms(measured - predicted[:, j]):.3g}, noise {experiment.noise[0, j]:.3g}')
    runs = _RUNS_OF_A_NUMBER * (len(machine.nuisances) + sum(
        len(machine.catalogue.typical_form(effect).sizes)
        for effect in machine.catalogue.values()))
    yield (f'one run of all tests takes {run_s:.2g} s (the first one {compiling_s:.2g} s); a '
           f'diagnosis takes about {runs}, {runs * run_s / 60.0:.2g} min')
