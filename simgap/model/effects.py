# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The effects that a user has declared, as a catalogue; the orders of a ripple are found."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from simgap.machine.contract import Catalogue, Effect, Experiment, FloatArray, Form, Parameter
from simgap.model.declared import Angle, Number, OwnEffect
from simgap.model.orders import likely_orders, USUAL_ORDERS

# Stands between the stem of a ripple's numbers and its order.
ORDER_MARK = '@'
_CYCLES = ' cycles'
# Orders of a ripple that a fit is tried with where they are not given.
_FOUND_ORDERS = 4


class OwnCatalogue(Catalogue):
    """The catalogue of a user's machine; `angles` of waves are at the judged samples [rad]."""

    def __init__(self, effects: Sequence[OwnEffect],
                 angles: Callable[[Angle], Sequence[FloatArray]]) -> None:
        super().__init__(map(_effect, effects))
        self._declared = {item.name: item for item in effects}
        self._angles = angles

    def form_named(self, effect: Effect, name: str) -> Form:
        """Return the form of an effect by its name; that of a ripple says its order."""
        own = self._declared[effect.id]
        if own.ripple is None:
            return super().form_named(effect, name)
        try:
            return _ripple_form(own, float(name.removesuffix(_CYCLES)))
        except ValueError:
            raise KeyError(f'{effect.id}: {name}') from None

    def forms(self, effect: Effect, experiments: Sequence[Experiment],
              residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return the forms that are worth a fit: of a ripple, orders that stand out."""
        own = self._declared[effect.id]
        if own.ripple is None or own.ripple.orders:
            return effect.forms
        orders = likely_orders(experiments, residuals, self._angles(own.ripple.angle),
                               _FOUND_ORDERS)
        return tuple(_ripple_form(own, order) for order in orders)


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
    return Effect(item.name, item.component, item.cause, item.look, tuple(forms),
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
