# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a machine keeps its contract: what is missing or wrong is named before a fit."""

from collections.abc import Iterable, Iterator, Sequence
import math

import numpy as np
from simgap.errors import UserError
from simgap.inputs.schema import nearest
from simgap.machine.effect import Effect, Form, Parameter
from simgap.machine.experiment import Experiment
from simgap.machine.machine import Machine

AT_REST = ': at rest, nothing moves; record a test in which the machine moves'
_RESERVED = ('none', 'unknown')
_SCATTER = 1.5  # of a reading, as a multiple of its noise, from which it shows a motion


class MachineError(UserError):
    """A machine breaks the contract of `Machine`; the message names the part that does."""


def check_machine(machine: Machine) -> None:
    """Check what a machine declares and predicts; MachineError if something is wrong."""
    if not machine.experiments:
        raise MachineError('experiments: there is none')
    for k, experiment in enumerate(machine.experiments):
        _check_experiment(experiment, machine.experiments[0])
        if experiment.name in [other.name for other in machine.experiments[:k]]:
            raise MachineError(f'experiment {experiment.name}: the name is there twice')
    count = len(machine.experiments)
    nuisances = [p.name for p in machine.nuisances]
    for number, item in enumerate(machine.nuisances):
        _check_parameter('nuisance', item, count)
        if item.name in nuisances[:number]:
            raise MachineError(f'nuisance {item.name}: the name is there twice')
    for key, effect in machine.catalogue.items():
        _check_effect(key, effect, machine, count)
    if len(machine.nuisances) == 0 and not machine.catalogue:
        raise MachineError('neither nuisances nor effects: nothing may differ from the model')
    predicted = machine.simulate([{}])[0]
    for experiment, readings in zip(machine.experiments, predicted, strict=True):
        _check_readings(experiment, readings)


def check_tests(machine: Machine) -> None:
    """Refuse tests that tell nothing, too short or at rest; UserError says what to record."""
    names = ', '.join(item.name for item in machine.experiments)
    longest = max(float(np.ptp(item.time)) for item in machine.experiments)
    needed = machine.time_scales.start_s
    if longest < needed:
        raise UserError(f'{names}: {longest:.3g} s were recorded, and the machine takes '
                        f'{needed:.3g} s to settle; record a longer test')
    if not any(moves(item, item.measured, _SCATTER) or moves(item, readings, 0.1 * _SCATTER)
               for item, readings in zip(machine.experiments, machine.simulate([{}])[0],
                                         strict=True)):
        raise UserError(names + AT_REST)


def without(machine: Machine, effects: Sequence[str], limits: Iterable[str]) -> Machine:
    """Return a machine without some effects; UserError names one, or a limit, that it lacks."""
    signals = machine.experiments[0].channels
    for kind, names, known in (('effect', effects, [*machine.catalogue]),
                               ('signal', limits, signals)):
        for name in names:
            if name not in known:
                raise UserError(f'{name}: no such {kind}{nearest(name, known)}; there are '
                                + ', '.join(known))
    return machine.without(effects)


def moves(experiment: Experiment, readings: np.ndarray | None,  # type: ignore[type-arg]
          scatter: float = _SCATTER, since_s: float = 0.0) -> bool:
    """Return whether a reading scatters by more than so much of its noise, from a time on [s]."""
    late = experiment.time >= experiment.time[0] + since_s
    assert readings is not None
    return any(np.std(values[there]) > scatter * np.mean(noise[there])
               for values, noise in zip(readings[late].T, experiment.noise[late].T, strict=True)
               if (there := np.isfinite(values)).any())


def idle_effects(machine: Machine) -> Iterator[str]:
    """Yield effects that change no reading, or that change one while they are absent."""
    neutral = machine.simulate([{}])[0]
    for effect in machine.catalogue.values():
        form = machine.catalogue.typical_form(effect)
        points = [form.start, *({**form.start, p.name: 0.5 * bound}
                                for p in form.sizes for bound in (p.low, p.high) if bound)]
        changes = [_change(machine, neutral, readings) for readings in machine.simulate(points)]
        if changes[0] > 1e-6:
            yield (f'effect {effect.id}: changes a reading by {changes[0]:.3g} standard '
                   'deviations while its size is zero')
        if max(changes[1:], default=0.0) == 0.0:
            yield f'effect {effect.id}: changes no reading in these experiments'


def _change(machine: Machine, neutral: Iterable[np.ndarray | None],  # type: ignore[type-arg]
            readings: Iterable[np.ndarray | None]) -> float:  # type: ignore[type-arg]
    found = 0.0
    for experiment, before, after in zip(machine.experiments, neutral, readings, strict=True):
        assert before is not None and after is not None
        change = np.abs(after - before) / experiment.noise
        found = max(found, float(np.nan_to_num(change, nan=math.inf).max(initial=0.0)))
    return found


def _check_experiment(item: Experiment, first: Experiment) -> None:
    name = f'experiment {item.name}'
    n, c = item.time.size, len(item.channels)
    if item.time.shape != (n,) or n < 2 or not np.all(np.diff(item.time) > 0.0):
        raise MachineError(f'{name}: time: {item.time.shape} given, allowed are two or more '
                           'increasing times, shape (n,)')
    if len(item.units) != c or c == 0:
        raise MachineError(f'{name}: units: {len(item.units)} given for {c} channels')
    if item.channels != first.channels:
        raise MachineError(f'{name}: channels: {", ".join(item.channels)} given, allowed are '
                           f'those of {first.name}: {", ".join(first.channels)}; a reading that '
                           'was not recorded is NaN')
    for key in ('measured', 'noise'):
        shape = getattr(item, key).shape
        if shape != (n, c):
            raise MachineError(f'{name}: {key}: shape {shape} given, allowed is {(n, c)}: '
                               f'{n} times, {c} channels')
    there = np.isfinite(item.measured)
    if not there.any():
        raise MachineError(f'{name}: measured: no finite sample')
    if np.isinf(item.measured).any():
        raise MachineError(f'{name}: measured: infinite samples; a missing one is NaN')
    for j, channel in enumerate(item.channels):
        sigma = item.noise[there[:, j], j]
        if not np.all((sigma > 0.0) & np.isfinite(sigma)):
            raise MachineError(f'{name}: noise of {channel}: {sigma.min():g} given, allowed is '
                               'a finite number above 0')
    for channel in item.quantised:
        if channel not in item.channels:
            raise MachineError(f'{name}: quantised: {channel}: no such channel')


def _check_parameter(kind: str, item: Parameter, experiments: int) -> None:
    name = f'{kind} {item.name}'
    if not item.low <= (item.start if item.is_shape else 0.0) <= item.high:
        neutral = f'its start {item.start:g}' if item.is_shape else 'the neutral value 0'
        raise MachineError(f'{name}: bounds {item.low:g} to {item.high:g} without {neutral}')
    if not (math.isfinite(item.low) and math.isfinite(item.high)):
        raise MachineError(f'{name}: bounds {item.low:g} to {item.high:g} given, allowed are '
                           'finite ones')
    if not 0.0 < item.step < math.inf:
        raise MachineError(f'{name}: step: {item.step:g} given, allowed is a number above 0')
    if not 0.0 <= item.prior_sigma < math.inf:
        raise MachineError(f'{name}: prior_sigma: {item.prior_sigma:g} given, allowed is 0 for '
                           'none, or a number above 0')
    if item.experiment is not None and not 0 <= item.experiment < experiments:
        raise MachineError(f'{name}: experiment: {item.experiment} given, allowed is 0 to '
                           f'{experiments - 1}')


def _check_effect(key: str, effect: Effect, machine: Machine, experiments: int) -> None:
    name = f'effect {key}'
    if effect.id != key or '.' not in key or key in _RESERVED:
        raise MachineError(f'{name}: id: {effect.id!r} given, allowed is component.effect')
    for field in ('parts', 'simpler'):
        for other in getattr(effect, field):
            if other not in machine.catalogue:
                raise MachineError(f'{name}: {field}: {other}: no such effect')
    if not effect.forms:
        raise MachineError(f'{name}: forms: there is none')
    taken = {p.name for p in machine.nuisances}
    for form in effect.forms:
        _check_form(name, form, taken, experiments)


def _check_form(name: str, form: Form, taken: set[str], experiments: int) -> None:
    if not form.sizes:
        raise MachineError(f'{name}: form {form.name!r}: has no parameter but shape parameters')
    for number, item in enumerate(form.parameters):
        _check_parameter(f'{name}: parameter', item, experiments)
        if item.name in taken or item.name in [p.name for p in form.parameters[:number]]:
            raise MachineError(f'{name}: parameter {item.name}: the name is there twice')


def _check_readings(experiment: Experiment, readings: np.ndarray | None,  # type: ignore[type-arg]
                    ) -> None:
    name = f'prediction of {experiment.name}'
    shape = None if readings is None else np.shape(readings)
    if shape != experiment.measured.shape:
        raise MachineError(f'{name}: shape {shape} given, allowed is '
                           f'{experiment.measured.shape}: times, channels')
    there = np.isfinite(experiment.measured)
    for j, channel in enumerate(experiment.channels):
        wrong = ~np.isfinite(np.asarray(readings)[there[:, j], j])
        if wrong.any():
            raise MachineError(f'{name}: {channel}: {np.count_nonzero(wrong)} of {wrong.size} '
                               'samples are NaN or infinite without any effect')
