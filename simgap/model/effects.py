# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The effects that a user has declared, as a catalogue.

The orders (cycles per revolution) of a ripple are those that stand out in what a model leaves.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter
from simgap.machine.contract import Catalogue, Effect, Experiment, FloatArray, Form, Parameter
from simgap.model.declared import Angle, Number, OwnEffect

# Stands between the stem of a ripple's numbers and its order.
ORDER_MARK = '@'
_CYCLES = ' cycles'
# Orders of a ripple that a fit is tried with where they are not given.
_FOUND_ORDERS = 4
# Orders for which a ripple is judged before a residual tells better ones.
USUAL_ORDERS = (1.0, 2.0, 3.0, 4.0, 6.0)
_GREATEST, _STEP = 64.0, 0.5
_NEIGHBOURS = 9
# Least samples and revolutions of a window, in which a machine answers a wave with a constant
# phase, more or less.
_WINDOW_SAMPLES, _WINDOW_REVOLUTIONS = 64, 2.0


class OwnCatalogue(Catalogue):
    """The catalogue of a user's machine; `angles` of waves are at the judged samples [rad]."""

    def __init__(self, effects: Sequence[OwnEffect],
                 angles: Callable[[Angle], Sequence[FloatArray]]) -> None:
        super().__init__(map(_effect, effects))
        self._declared = {item.name: item for item in effects}
        self._angles = angles

    def form_named(self, effect: Effect, name: str) -> Form:
        own = self._declared[effect.id]
        if own.ripple is None:
            return super().form_named(effect, name)
        try:
            return _ripple_form(own, float(name.removesuffix(_CYCLES)))
        except ValueError:
            raise KeyError(f'{effect.id}: {name}') from None

    def forms(self, effect: Effect, experiments: Sequence[Experiment],
              residuals: Sequence[FloatArray]) -> Sequence[Form]:
        own = self._declared[effect.id]
        if own.ripple is None or own.ripple.orders:
            return effect.forms
        return tuple(_ripple_form(own, order) for order in likely_orders(
            experiments, residuals, self._angles(own.ripple.angle)))


def absent(effect: OwnEffect) -> Iterator[tuple[str, float]]:
    """Yield the numbers of an effect as they are without it."""
    if effect.ripple is not None:
        yield f'{effect.ripple.stem}_order', 1.0
        yield from dict.fromkeys((*effect.ripple.fundamental, *effect.ripple.higher), 0.0).items()
    for form in effect.forms:
        yield from ((name, item.value) for name, item in form.numbers.items())


def _effect(item: OwnEffect) -> Effect:
    if item.ripple is not None:
        forms = [_ripple_form(item, order) for order in item.ripple.orders or USUAL_ORDERS]
    else:
        forms = [Form(form.name, tuple(_parameter(f'{item.name}.{name}', number)
                                       for name, number in form.numbers.items()))
                 for form in item.forms]
    cause = item.cause or item.name.partition('.')[2].replace('_', ' ')
    return Effect(item.name, item.component, cause, tuple(forms),
                  simpler=(item.simpler,) if item.simpler else ())


def _parameter(name: str, item: Number) -> Parameter:
    return Parameter(name, item.unit, item.low, item.high, item.quotient_step, start=item.value,
                     is_shape=item.is_shape, tolerance=item.tolerance, least_step=item.step)


def _ripple_form(item: OwnEffect, order: float) -> Form:
    wave = item.ripple
    assert wave is not None
    # higher harmonics mean nothing without the fundamental, as the shape of other effects
    numbers = {**dict.fromkeys(wave.fundamental, wave.amplitude),
               **dict.fromkeys(wave.higher, replace(wave.amplitude, is_shape=True))}
    return Form(f'{order:g}{_CYCLES}', tuple(
        _parameter(f'{item.name}.{name}{ORDER_MARK}{order:g}', number)
        for name, number in numbers.items()), scanned=True, is_wave=True)


def likely_orders(experiments: Sequence[Experiment], residuals: Sequence[FloatArray],
                  angles: Sequence[FloatArray]) -> list[float]:
    """Return likely orders, half by peak and half by energy, from residuals and angles [rad]."""
    orders = np.arange(_STEP, _GREATEST + _STEP, _STEP)
    energy = np.zeros(orders.size)
    for experiment, residual, angle in zip(experiments, residuals, angles, strict=True):
        clean = np.nan_to_num(residual / experiment.noise)
        for rows in _windows(angle):
            for channel in clean[rows].T:
                energy += _power(channel, angle[rows], orders)
    # a score is a sum of squares, whose scatter is its square root
    usual = median_filter(energy, _NEIGHBOURS, mode='nearest') + 1e-9
    peak = (energy - usual) / np.sqrt(usual)
    found: list[float] = []
    ranks = [list(np.argsort(by)[::-1]) for by in (peak, energy)]
    while len(found) < _FOUND_ORDERS:
        order = float(orders[ranks[len(found) % 2].pop(0)])
        if order not in found:
            found.append(order)
    return found


def _windows(angle: FloatArray) -> Iterator[slice]:
    """Yield windows of enough samples and revolutions; the last one may be short."""
    turned = np.r_[0.0, np.cumsum(np.abs(np.diff(angle)))] / (2.0 * np.pi)
    first = 0
    while first + _WINDOW_SAMPLES <= angle.size:
        last = int(np.searchsorted(turned, turned[first] + _WINDOW_REVOLUTIONS))
        last = max(last, first + _WINDOW_SAMPLES)
        yield slice(first, last)
        first = last


def _power(signal: FloatArray, angle: FloatArray, orders: FloatArray) -> FloatArray:
    """Return the power of a signal in waves of an angle, less its mean and slope, shape (m,)."""
    if np.ptp(angle) < 1e-9:
        return np.zeros(orders.size)
    wave = np.exp(-1j * np.outer(orders, angle))
    n = angle.size
    basis = np.linalg.qr(np.column_stack([np.ones(n), np.arange(n)]))[0]
    wave -= (wave @ basis) @ basis.T
    signal = signal - basis @ (basis.T @ signal)
    power = np.sum(np.abs(wave) ** 2, axis=1) + 1.0
    return np.asarray(np.abs(wave @ signal) ** 2 / power)
