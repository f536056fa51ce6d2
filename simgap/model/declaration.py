# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a user says of a machine: numbers, readings, effects, places where something may push.

`machine` collects it. See docs/own-machine.md for the steps, and examples/emps for a real one.
"""

from __future__ import annotations

from collections.abc import Sequence

from simgap.model.declared import (
    Angle, Model, ModelError, Number, OwnEffect, OwnForm, Push, Reading, Ripple,
)

# Words of the declaration.
machine = Model
reading = Reading
push = Push


def known(value: float, unit: str = '1') -> Number:
    """Return a number that is never fitted."""
    return Number(value, value, value, unit)


def within(value: float, share: float | None = None, unit: str = '1', *,
           by: float | None = None, step: float = 0.0) -> Number:
    """
    Return a number that is known within a tolerance, and is fitted within it.

    value : as configured
    share : tolerance as a share of the value
    unit : of the value
    by : tolerance in the unit of the value, in the place of `share`
    step : of the difference quotient; 0 for a usual one

    Raises ModelError if neither `share` nor `by` is given, or both, or the tolerance is not above
    0.
    """
    if (share is None) == (by is None):
        raise ModelError(f'within({value:g}): give either a share or by=')
    size = by if by is not None else abs(value) * share  # type: ignore[operator]
    if not size > 0.0:
        raise ModelError(f'within({value:g}): a tolerance of {size:g} given, allowed is a number '
                         'above 0; give by= where the value is 0, or known()')
    return Number(value, value - size, value + size, unit, step, 0.5 * size)


def free(low: float, high: float, unit: str = '1', *, start: float | None = None,
         step: float = 0.0) -> Number:
    """
    Return a number of which nothing is known but its bounds.

    low, high : bounds
    unit : of the value
    start : where a fit begins; None for the middle
    step : of the difference quotient; 0 for a usual one
    """
    return Number(0.5 * (low + high) if start is None else start, low, high, unit, step)


def size(low: float, high: float, unit: str = '1', *, tolerance: float = 0.0,
         step: float = 0.0) -> Number:
    """
    Return a number of an effect that is zero where the effect is absent.

    low, high : bounds, with 0 between them or at one of them
    unit : of the value
    tolerance : size that a machine in good order may have, which is not named
    step : of the difference quotient; 0 for a usual one
    """
    return Number(0.0, low, high, unit, step, tolerance=tolerance)


def shape(low: float, high: float, start: float, unit: str = '1', *,
          step: float = 0.0) -> Number:
    """Return a number of an effect that means nothing while the effect is absent."""
    return Number(start, low, high, unit, step, is_shape=True)


def form(name: str, **numbers: Number) -> OwnForm:
    """Return one of several forms of an effect."""
    return OwnForm(name, numbers)


def effect(name: str, *forms: OwnForm, cause: str = '', look: str = '', simpler: str = '',
           **numbers: Number) -> OwnEffect:
    """
    Return an effect that the model may lack.

    name : 'component.effect'
    forms : alternative forms, if there are several
    cause : its physical cause, one sentence
    look : what it looks like in the readings, one sentence
    simpler : name of the effect that it becomes at an end of its range, as a Stribeck friction
        becomes a Coulomb friction; it is tried in its place
    numbers : of its only form: `size` or `shape` by name

    Raises ModelError if there are neither forms nor numbers, or both.
    """
    if bool(forms) == bool(numbers):
        raise ModelError(f'effect {name}: give its numbers, such as half_gap=size(0, 1e-3, '
                         "'rad'), or several form()s")
    return OwnEffect(name, cause or name.partition('.')[2].replace('_', ' '), look,
                     forms or (OwnForm('', numbers),), simpler=simpler)


def ripple(name: str, stem: str, amplitude: Number, angle: str | Angle,
           orders: Sequence[float] = (), *, harmonics: int = 1, cause: str = '', look: str = '',
           ) -> OwnEffect:
    """
    Return a wave by an angle that the model may lack.

    The simulation reads numbers.stem_cosine, stem_sine and stem_order, for `parts.wave`; of each
    further harmonic k stem_cosine_k and stem_sine_k, for `parts.harmonics`.

    name : 'component.effect'
    stem : of the three numbers
    amplitude : `size` of the two amplitudes
    angle : name of a column of the logs in rad, or a function of a log that returns the angle
        [rad]
    orders : cycles per revolution that are tried; empty to find them in the residual
    harmonics : how many the wave has, its fundamental counted; waves of real machines are seldom
        pure
    cause, look : as for `effect`
    """
    column = angle
    follow = angle if callable(angle) else (lambda log: log[column])
    return OwnEffect(name, cause or name.partition('.')[2].replace('_', ' '), look,
                     ripple=Ripple(stem, amplitude, follow, tuple(map(float, orders)), harmonics))
