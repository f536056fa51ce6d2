# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a user says of a machine, see docs/own-machine.md; `machine` collects it."""

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
           by: float | None = None, step: float = 0.0, spread: float = 0.0) -> Number:
    """
    Return a number that is known within a tolerance, and is fitted within it.

    value, unit : as configured
    share, by : tolerance as a share of the value, or in its unit
    step : of the difference quotient; 0 for a usual one
    spread : standard deviation from day to day, in its unit; 0 for an eighth of the tolerance

    Raises ModelError unless just one of `share` and `by` is given, and is above 0.
    """
    if (share is None) == (by is None):
        raise ModelError(f'within({value:g}): give either a share or by=')
    size = by if by is not None else abs(value) * share  # type: ignore[operator]
    if not size > 0.0:
        raise ModelError(f'within({value:g}): a tolerance of {size:g} given, allowed is a number '
                         'above 0; give by= where the value is 0, or known()')
    return Number(value, value - size, value + size, unit, step, 0.5 * size, spread=spread)


def free(low: float, high: float, unit: str = '1', *, start: float | None = None,
         step: float = 0.0) -> Number:
    """
    Return a number of which nothing is known but its bounds `low` and `high`, in `unit`.

    start : where a fit begins; None for the middle
    step : of the difference quotient; 0 for a usual one
    """
    return Number(0.5 * (low + high) if start is None else start, low, high, unit, step)


def size(low: float, high: float, unit: str = '1', *, tolerance: float = 0.0,
         step: float = 0.0) -> Number:
    """
    Return a number of an effect that is zero where the effect is absent.

    low, high, unit : bounds, with 0 between them or at one of them, and their unit
    tolerance : size that a machine in good order may have, which is not named
    step : of the difference quotient; 0 for a usual one
    """
    return Number(0.0, low, high, unit, step, tolerance=tolerance)


def shape(low: float, high: float, start: float, unit: str = '1', *, step: float = 0.0) -> Number:
    """Return a number of an effect that means nothing while the effect is absent."""
    return Number(start, low, high, unit, step, is_shape=True)


def form(name: str, **numbers: Number) -> OwnForm:
    """Return one of several forms of an effect."""
    return OwnForm(name, numbers)


def effect(name: str, *forms: OwnForm, cause: str = '', simpler: str = '',
           **numbers: Number) -> OwnEffect:
    """
    Return an effect that the model may lack.

    name : 'component.effect'
    cause : its physical cause, one sentence
    simpler : effect that it becomes at an end of its range; the two are left out together
    forms : alternative forms, if there are several
    numbers : of its only form: `size` or `shape` by name

    Raises ModelError if there are neither forms nor numbers, or both.
    """
    if bool(forms) == bool(numbers):
        raise ModelError(f'effect {name}: give its numbers, such as half_gap=size(0, 1e-3, '
                         "'rad'), or several form()s")
    return OwnEffect(name, cause, forms or (OwnForm('', numbers),), simpler=simpler)


def ripple(name: str, stem: str, amplitude: Number, angle: str | Angle,
           orders: Sequence[float] = (), *, harmonics: int = 1, cause: str = '') -> OwnEffect:
    """
    Return a wave by an angle that the model may lack.

    The simulation reads numbers.stem_cosine, stem_sine and stem_order, for `parts.wave`; of each
    further harmonic k stem_cosine_k and stem_sine_k, for `parts.harmonics`.

    name, stem : 'component.effect', and stem of the three numbers
    amplitude : `size` of the two amplitudes
    angle : column of the logs [rad], or a function of a log that returns the angle [rad]
    orders : cycles per revolution that are tried; empty to find them in the residual
    harmonics : how many the wave has, its fundamental counted; real waves are seldom pure
    cause : as for `effect`
    """
    column = angle
    follow = angle if callable(angle) else (lambda log: log[column])
    return OwnEffect(name, cause, ripple=Ripple(
        stem, amplitude, follow, tuple(map(float, orders)), harmonics))
