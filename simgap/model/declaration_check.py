# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a declaration is what it should be: what is wrong is named, with the remedy."""

from __future__ import annotations

import numpy as np
from simgap.inputs.schema import nearest
from simgap.model.declared import Model, ModelError, Number, OwnEffect, Push, Reading


def check(model: Model) -> None:
    """
    Check the entries of a model.

    Raises
    ------
    ModelError : a name is there twice, or an entry is not what it should be

    """
    if not callable(model.simulate):
        raise ModelError('simulate: no function given')
    if not model.readings:
        raise ModelError('readings: none is given')
    for name, sensor in model.readings.items():
        if not isinstance(sensor, Reading):
            raise ModelError(f'readings: {name}: give reading(unit, noise)')
        if not sensor.sigma > 0.0:
            raise ModelError(f'readings: {name}: noise: {sensor.noise:g} given, allowed is a '
                             'number above 0, in the unit of the reading, or a digit')
    taken: dict[str, str] = {}
    for where, numbers in (('base', model.base), ('per_test', model.per_test)):
        for name, number in numbers.items():
            _check_number(f'{where}: {name}', number)
            if not number.low <= number.value <= number.high:
                raise ModelError(f'{where}: {name}: {number.value:g} given, allowed is '
                                 f'{number.low:g} to {number.high:g}')
            _take(taken, name, where)
    for item in model.effects:
        if not isinstance(item, OwnEffect):
            raise ModelError(f'effects: {item!r} given, allowed is effect() or ripple()')
        _check_effect(item, taken)
    names = [item.name for item in model.effects]
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f'effect {name}: the name is there twice')
    for item in model.effects:
        others = [name for name in names if name != item.name]
        if item.simpler and item.simpler not in others:
            raise ModelError(f'effect {item.name}: simpler: {item.simpler}: no such other effect'
                             f'{nearest(item.simpler, others)}')
    for name, draw in model.tests.items():
        if not callable(draw):
            raise ModelError(f'tests: {name}: give a function f(duration_s, random) -> Log')
    for name, limit in model.limits.items():
        if name not in model.readings:
            raise ModelError(f'limits: {name}: no such reading{nearest(name, model.readings)}')
        if not limit > 0.0:
            raise ModelError(f'limits: {name}: {limit!r} given, allowed is a number above 0')
    for name, place in model.push.items():
        if not isinstance(place, Push) or not place.size > 0.0:
            raise ModelError(f'push: {name}: give push(component, label, unit, size) with a size '
                             'above 0')


def _check_effect(item: OwnEffect, taken: dict[str, str]) -> None:
    where = f'effect {item.name}'
    if '.' not in item.name:
        raise ModelError(f'{where}: allowed is a name such as gearbox.backlash: component, dot, '
                         'effect')
    if item.ripple is not None:
        _check_size(f'{where}: amplitude', item.ripple.amplitude)
        if not isinstance(item.ripple.harmonics, int) or item.ripple.harmonics < 1:
            raise ModelError(f'{where}: harmonics: {item.ripple.harmonics!r} given, allowed is '
                             'a whole number from 1')
        for name in (*item.ripple.fundamental, *item.ripple.higher, f'{item.ripple.stem}_order'):
            _take(taken, name, where)
    for one in item.forms:
        for name, number in one.numbers.items():
            _check_size(f'{where}: {name}', number)
            if taken.get(name) != where:  # forms of one effect may share a number
                _take(taken, name, where)


def _check_size(where: str, number: object) -> None:
    _check_number(where, number)
    assert isinstance(number, Number)
    if not number.is_shape and (number.value != 0.0 or number.sigma):
        raise ModelError(f'{where}: give size() or shape(): the number of an effect is 0 where '
                         'the effect is absent')
    if not number.low <= number.value <= number.high:
        neutral = f'its start {number.value:g}' if number.is_shape else 'the neutral value 0'
        raise ModelError(f'{where}: bounds {number.low:g} to {number.high:g} without {neutral}')
    if not number.low < number.high:
        raise ModelError(f'{where}: bounds {number.low:g} to {number.high:g} leave no room')


def _check_number(where: str, number: object) -> None:
    if not isinstance(number, Number):
        raise ModelError(f'{where}: {number!r} given, allowed is known(), within() or free()')
    if not (np.isfinite([number.value, number.low, number.high]).all()
            and number.low <= number.high):
        raise ModelError(f'{where}: bounds {number.low:g} to {number.high:g} given, allowed are '
                         'finite ones, the smaller first')


def _take(taken: dict[str, str], name: str, where: str) -> None:
    if not name.isidentifier():
        raise ModelError(f'{where}: {name!r}: a name is made of letters, digits and underscores')
    if name in taken:
        raise ModelError(f'{where}: {name}: the name is there twice, in {taken[name]} too')
    taken[name] = where
