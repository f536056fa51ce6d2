# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A model file: YAML that makes a machine of a MuJoCo model or FMU, see docs/own-machine.md."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

import numpy as np
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, ParameterError, quoted
from simgap.logs.log import OneTest
from simgap.machine.contract import FloatArray
from simgap.model.declaration import (
    effect, free, known, machine, ripple, shape, size, within)
from simgap.model.declared import Model, ModelError, Number, Numbers, OwnEffect, Push, Reading
from simgap.model.simulator import Ports, Simulator

_PROGRAMS = ('mujoco', 'fmu')
_TOP = (*_PROGRAMS, 'step_s', 'inputs', 'starts', 'constants', 'base', 'per_test', 'readings',
        'effects', 'push', 'settles_s', 'judged_hz', 'along', 'blocks', 'advice', 'source')
# What a number may do, in the order in which it is done. Inputs are delayed; inputs and readings
# are scaled and added to, as places are.
_ACTS = ('sets', 'scales', 'adds', 'adds_to_inverse', 'delays')
_KINDS = ('known', 'share', 'by', 'free', 'size', 'shape')
_OF_EFFECT = ('cause', 'simpler', 'numbers', 'ripple')
_OF_RIPPLE = ('size', 'unit', 'tolerance', 'angle', 'orders', 'into')
_NUMBER = Entry('')
_POSITIVE = Entry('', low=1e-12)
# A sample counts as there at a time that differs by less than this share of a step.
_SAME = 1e-6


@dataclass(frozen=True)
class _Action:
    """What a number does, by a factor, to a place or an input: one of _ACTS."""

    key: str
    number: str
    act: str
    target: str
    factor: float

    def is_of(self, signals: Collection[str]) -> bool:
        """Return whether it is done to one of these inputs or readings, and to no place."""
        return self.act == 'delays' or self.act in ('scales', 'adds') and self.target in signals


def load_model_file(path: Path) -> Model:
    """
    Return the model that a YAML file describes.

    Raises ModelError, in a line with file and entry, if the file or its model cannot be used, and
    ModuleNotFoundError if mujoco or fmpy is not installed.
    """
    try:
        return _model(path, mapping_of('', read_yaml(path), _TOP))
    except (ParameterError, ModelError) as error:
        text = str(error)
        raise ModelError(text if text.startswith(str(path)) else f'{path}: {text}') from None


def _model(path: Path, top: Mapping[str, Any]) -> Model:
    program = [name for name in _PROGRAMS if name in top]
    if len(program) != 1:
        raise ModelError(f'give one of {" and ".join(_PROGRAMS)}, with the file of the model')
    actions = list(_actions(top))
    inputs = _texts('inputs', top)
    starts, constants = _texts('starts', top), _texts('constants', top)
    readings = {name: (key, body) for key, name, body in _bodies(
        'readings', top, ('from', 'column', *Reading.__dataclass_fields__))}
    pushes = {name: (key, body) for key, name, body in _bodies(
        'push', top, ('into', *Push.__dataclass_fields__))}
    entries = {str(body.get('into', name)): key for name, (key, body) in pushes.items()}
    for name, (key, body) in pushes.items():
        if entries[str(body.get('into', name))] != key:
            raise ModelError(f'{key}: into: two pushes enter at {body.get("into", name)}; leave '
                             'one out')
    signals = {**inputs, **readings}
    targets = {item.target: item.key for item in actions if not item.is_of(signals)}
    ports = Ports(
        {**targets, **dict.fromkeys(starts, 'starts'), **dict.fromkeys(constants, 'constants')},
        dict.fromkeys(inputs, 'inputs'),
        entries,
        {str(body.get('from', name)): key for name, (key, body) in readings.items()})
    _check_actions(actions, inputs)
    simulator = _simulator(program[0], path.parent / _text(program[0], top[program[0]]), ports)
    defaults = dict(zip(ports.places, simulator.defaults.tolist(), strict=True))
    given = {*starts, *constants, *(item.target for item in actions if item.act == 'sets')}
    for item in actions:
        if item.target not in given and math.isnan(defaults.get(item.target, 0.0)):
            raise ModelError(f'{item.key}: {item.target}: {top[program[0]]} gives it no value; '
                             'let a number set it first')
    actions.sort(key=lambda item: _ACTS.index(item.act))
    simulate = FileSimulation(
        simulator, tuple(ports.places), _optional('step_s', top) or simulator.longest_step_s,
        tuple(item for item in actions if not item.is_of(signals)),
        tuple(item for item in actions if item.is_of(signals)), inputs, starts, constants,
        tuple(pushes), {name: list(ports.outputs).index(str(body.get('from', name)))
                        for name, (_, body) in readings.items()})
    return machine(
        simulate,
        base={name: _declared(key, body, defaults) for key, name, body in _bodies('base', top)},
        per_test={name: _declared(key, body, defaults)
                  for key, name, body in _bodies('per_test', top)},
        readings={name: _reading(key, body) for name, (key, body) in readings.items()},
        effects=[_effect(*item) for item in _bodies('effects', top)],
        push={name: _push(key, name, body) for name, (key, body) in pushes.items()},
        settles_s=_optional('settles_s', top), judged_hz=_optional('judged_hz', top),
        along=_texts('along', top),
        blocks=tuple(_list('blocks', top)), advice=tuple(_list('advice', top)),
        parallel=simulator.parallel)


@dataclass(frozen=True)
class FileSimulation:
    """A simulation program as the `simulate` of a machine."""

    simulator: Simulator
    places: tuple[str, ...]
    longest_step_s: float
    of_places: tuple[_Action, ...]  # what is done to places, in this order
    of_signals: tuple[_Action, ...]  # to inputs and readings likewise
    inputs: Mapping[str, str]
    starts: Mapping[str, str]
    constants: Mapping[str, str]
    pushes: tuple[str, ...]
    readings: Mapping[str, int]  # which output of the program each is

    def __call__(self, numbers: Numbers, test: OneTest) -> dict[str, FloatArray]:
        time = test.time
        sampled = float(np.median(np.diff(time)))
        step = sampled / max(1, math.ceil(sampled / self.longest_step_s - _SAME))
        count = math.ceil((time[-1] - time[0]) / step - _SAME) + 1
        grid = time[0] + step * np.arange(count)
        held = np.searchsorted(time, grid + _SAME * sampled, side='right') - 1
        columns = [self._late(name, test[column][held], numbers, step)
                   for name, column in self.inputs.items()]
        columns += [test.push[name][held] for name in self.pushes]
        inputs = np.column_stack(columns) if columns else np.empty((count, 0))
        found = self.simulator.run(self._values(numbers, test), float(time[0]), step, inputs)
        return {reading: self._altered(reading, np.interp(time, grid, found[:, place]), numbers)
                for reading, place in self.readings.items()}

    def _values(self, numbers: Numbers, test: OneTest) -> FloatArray:
        values = dict(zip(self.places, self.simulator.defaults.tolist(), strict=True))
        for place, name in self.constants.items():
            if name not in test.constants:
                raise ModelError(f'{test.name}: constants: {name}: not in the sheet beside the '
                                 'log; add it there')
            values[place] = test.constants[name]
        for place, column in self.starts.items():
            values[place] = float(test[column][0])
        return np.array(list(self.acted(values, numbers).values()))

    def acted(self, values: dict[str, float], numbers: Numbers) -> dict[str, float]:
        """Return the values of places after what numbers do to them."""
        for item in self.of_places:
            change = item.factor * numbers[item.number]
            if item.act == 'sets':
                values[item.target] = change
            elif item.act == 'scales':
                values[item.target] *= 1.0 + change
            elif item.act == 'adds':
                values[item.target] += change
            elif item.act == 'adds_to_inverse':
                if values[item.target] == 0.0:
                    raise ModelError(f'{item.key}: {item.target}: it is 0, which has no inverse; '
                                     'add to it, or set it')
                values[item.target] = 1.0 / (1.0 / values[item.target] + change)
        return values

    def _altered(self, name: str, course: FloatArray, numbers: Numbers) -> FloatArray:
        """Return the course of an input or reading, scaled and added to if numbers say so."""
        for item in self.of_signals:
            if item.target == name and item.act != 'delays':
                change = item.factor * numbers[item.number]
                course = course * (1.0 + change) if item.act == 'scales' else course + change
        return course

    def _late(self, name: str, course: FloatArray, numbers: Numbers, step: float) -> FloatArray:
        """Return the course of an input, altered and delayed if numbers say so."""
        course = self._altered(name, course, numbers)
        delay = sum(item.factor * numbers[item.number] for item in self.of_signals
                    if item.act == 'delays' and item.target == name)
        if delay == 0.0:
            return course
        places = np.arange(course.size, dtype=float)
        return np.interp(places - delay / step, places, course)


def _simulator(program: str, path: Path, ports: Ports) -> Simulator:
    if not path.is_file():
        raise ModelError(f'{program}: {path}: no such file; its place is counted from the model '
                         'file')
    # each needs a package of its own, which only its users have
    if program == 'mujoco':
        from simgap.model.mujoco_model import MujocoModel
        return MujocoModel(path, ports)
    from simgap.model.fmu_model import FmuModel
    return FmuModel(path, ports)


def _number_bodies(top: Mapping[str, Any]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield key, name and body of every number of the file."""
    allowed = (*_KINDS, 'value', 'start', 'unit', 'step', 'spread', 'tolerance', *_ACTS)
    yield from _bodies('base', top, allowed)
    yield from _bodies('per_test', top, allowed)
    for key, _, item in _bodies('effects', top, _OF_EFFECT):
        yield from _bodies('numbers', item, allowed, f'{key}.')


def _actions(top: Mapping[str, Any]) -> Iterator[_Action]:
    for key, name, body in _number_bodies(top):
        acts = [act for act in _ACTS if act in body]
        if len(acts) != 1:
            raise ModelError(f'{key}: give one of {", ".join(_ACTS)}: what the number does in the '
                             'simulation')
        targets = body[acts[0]]
        if isinstance(targets, str):
            targets = {targets: 1.0}
        elif isinstance(targets, list):
            targets = {_text(f'{key}.{acts[0]}', target): 1.0 for target in targets}
        for target, factor in mapping_of(f'{key}.{acts[0]}', targets).items():
            yield _Action(f'{key}.{acts[0]}', name, acts[0], str(target),
                          _number(f'{key}.{acts[0]}.{target}', factor))
    for key, name, body in _bodies('effects', top, _OF_EFFECT):
        into = mapping_of(f'{key}.ripple', body.get('ripple', {}), _OF_RIPPLE).get('into')
        yield from (_Action(f'{key}.ripple.into', f'{name}_{part}'.replace('.', '_'), 'sets',
                            f'{into}_{part}', 1.0)
                    for part in ('cosine', 'sine', 'order') if 'ripple' in body)


def _check_actions(actions: list[_Action], inputs: Mapping[str, str]) -> None:
    taken: dict[str, str] = {}
    for item in actions:
        if item.act == 'delays' and item.target not in inputs:
            raise ModelError(f'{item.key}: {item.target} is no input; there are '
                             f'{", ".join(inputs) or "none"}')
        if item.act == 'sets' and taken.setdefault(item.target, item.key) != item.key:
            raise ModelError(f'{item.key}: {item.target}: {taken[item.target]} sets it, too; '
                             'let one of them add or scale')


def _declared(key: str, body: Mapping[str, Any], defaults: Mapping[str, float]) -> Number:
    """Return a number of the model; where it has no value, the program's own file has it."""
    kind = _kind(key, body, ('known', 'share', 'by', 'free'))
    unit, step = _unit(key, body), _number(f'{key}.step', body.get('step', 0.0))
    if kind == 'known':
        return known(_number(f'{key}.known', body['known']), unit)
    if kind == 'free':
        return free(*_pair(f'{key}.free', body['free']), unit, step=step,
                    start=_value(f'{key}.start', body.get('start'), body, defaults))
    value = _value(f'{key}.value', body.get('value'), body, defaults)
    if value is None:
        raise ModelError(f'{key}: value: none is given')
    return within(value, unit=unit, step=step, **{
        name: _number(f'{key}.{name}', body[name]) for name in (kind, 'spread') if name in body})


def _value(key: str, given: object, body: Mapping[str, Any],
           defaults: Mapping[str, float]) -> float | None:
    """Return a value as given, else that of the place which the number sets; None for neither."""
    if given is not None:
        return _number(key, given)
    place = body.get('sets')
    found = defaults.get(place, math.nan) if isinstance(place, str) else math.nan
    return found if math.isfinite(found) else None


def _effect(key: str, name: str, body: Mapping[str, Any]) -> OwnEffect:
    cause = _text(f'{key}.cause', body.get('cause', ''))
    if 'ripple' in body:
        item, where = body['ripple'], f'{key}.ripple'
        amplitude = size(*_pair(f'{where}.size', item.get('size')), _unit(where, item),
                         tolerance=_number(f'{where}.tolerance', item.get('tolerance', 0.0)))
        orders = [_number(f'{where}.orders', order) for order in item.get('orders', ())]
        return ripple(name, name.replace('.', '_'), amplitude, _text(
            f'{where}.angle', item.get('angle')), orders, cause=cause)
    numbers = {}
    for where, one, item in _bodies('numbers', body, before=f'{key}.'):
        unit, step = _unit(where, item), _number(f'{where}.step', item.get('step', 0.0))
        if _kind(where, item, ('size', 'shape')) == 'size':
            numbers[one] = size(
                *_pair(f'{where}.size', item['size']), unit, step=step,
                tolerance=_number(f'{where}.tolerance', item.get('tolerance', 0.0)))
        else:
            numbers[one] = shape(
                *_pair(f'{where}.shape', item['shape']),
                _number(f'{where}.start', item.get('start')), unit, step=step)
    simpler = _text(f'{key}.simpler', body.get('simpler', ''))
    return effect(name, cause=cause, simpler=simpler, **numbers)


def _kind(key: str, body: Mapping[str, Any], allowed: Collection[str]) -> str:
    kinds = [kind for kind in _KINDS if kind in body]
    if len(kinds) != 1 or kinds[0] not in allowed:
        raise ModelError(f'{key}: {" and ".join(kinds) or "nothing"} given, allowed is one of '
                         f'{", ".join(allowed)}')
    return kinds[0]


def _reading(key: str, body: Mapping[str, Any]) -> Reading:
    if 'noise' not in body and 'digit' not in body:
        raise ModelError(f'{key}: noise: none is given; what would a perfect model leave?')
    numbers = {name: _number(f'{key}.{name}', body[name])
               for name in ('model_error', 'digit', 'zero', 'gain') if name in body}
    return Reading(_unit(key, body), _number(f'{key}.noise', body.get('noise', 0.0)),
                   column=_text(f'{key}.column', body.get('column', '')), **numbers)


def _push(key: str, name: str, body: Mapping[str, Any]) -> Push:
    return Push(_text(f'{key}.component', body.get('component', name)),
                _text(f'{key}.label', body.get('label', name)), _unit(key, body),
                _number(f'{key}.size', body.get('size'), _POSITIVE),
                _number(f'{key}.everyday', body.get('everyday', 0.0), Entry('', 0.0)))


def _bodies(where: str, top: Mapping[str, Any], allowed: Collection[str] | None = None,
            before: str = '') -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield key, name and entries of each thing in a part of the file."""
    for name, body in mapping_of(f'{before}{where}', top.get(where) or {}).items():
        key = f'{before}{where}.{name}'
        yield key, str(name), mapping_of(key, body, allowed)


def _texts(where: str, top: Mapping[str, Any]) -> dict[str, str]:
    return {str(name): _text(f'{where}.{name}', value)
            for name, value in mapping_of(where, top.get(where) or {}).items()}


def _list(where: str, top: Mapping[str, Any]) -> list[str]:
    found = top.get(where) or []
    if not isinstance(found, list):
        raise ModelError(f'{where}: {quoted(found)} given, allowed is a list of texts')
    return [_text(where, item) for item in found]


def _text(key: str, value: object) -> str:
    if not isinstance(value, str):
        raise ModelError(f'{key}: {quoted(value)} given, allowed is a text')
    return value


def _unit(key: str, body: Mapping[str, Any]) -> str:
    # YAML reads 1, the unit of a plain number, as a number
    return str(body.get('unit', '1'))


def _number(key: str, value: object, entry: Entry = _NUMBER) -> float:
    return float(entry.check(key, value))  # type: ignore[arg-type]


def _optional(key: str, top: Mapping[str, Any]) -> float | None:
    return _number(key, top[key], _POSITIVE) if key in top else None


def _pair(key: str, value: object) -> tuple[float, float]:
    low, high = Entry('', lengths=(2, 2)).check(key, value)  # type: ignore[misc, str-unpack]
    return float(low), float(high)
