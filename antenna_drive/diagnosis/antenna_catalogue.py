# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue of the antenna's effects; the orders of its waves are found or named."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from antenna_drive.diagnosis.catalogue import DIGITS_SEEN
from antenna_drive.diagnosis.modifiers import KnownModifiers
from antenna_drive.diagnosis.wave_orders import likely_orders
from antenna_drive.diagnosis.waves import Wave
from simgap.machine.contract import Catalogue, Effect, Experiment, FloatArray, Form

# Numbers of cycles per revolution that are tried of each wave.
_ORDERS = 3


class AntennaCatalogue(Catalogue):
    """
    The effects of the antenna drive, and the orders of its waves.

    What their parameters do is registered in `modifiers`, which grows as orders are chosen.
    `digits_seen` says whether the readings show digits that are coarser than the sheet says.
    """

    def __init__(self, effects: Iterable[Effect], modifiers: KnownModifiers,
                 digits_seen: bool) -> None:
        super().__init__(effects)
        self._modifiers, self._digits_seen = modifiers, digits_seen
        modifiers.register(p for effect in self.values() for form in effect.forms
                           for p in form.parameters)

    def forms(self, effect: Effect, experiments: Sequence[Experiment],
              residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return an effect's forms; those of a wave with its likeliest orders."""
        found: list[Form] = []
        for form in effect.forms:
            if isinstance(form, Wave):
                found += [self.wave_at(form, order) for order in likely_orders(
                    form, experiments, residuals, _ORDERS)]
            else:
                found.append(form)
        return found

    def typical_form(self, effect: Effect) -> Form:
        """Return the first form of an effect; of a wave, one of a middle order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self.wave_at(form, form.orders[min(11, len(form.orders) - 1)])
        return form

    def form_named(self, effect: Effect, name: str) -> Form:
        """Return the form of an effect by its name; that of a wave says its order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self.wave_at(form, form.order_of(name))
        if name == DIGITS_SEEN and not self._digits_seen:
            return form  # a planned test has no readings to see digits in: it is rounded
        return super().form_named(effect, name)

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        if not isinstance(form, Wave):
            return part.forms[effect.forms.index(form)]
        wave = part.forms[0]
        assert isinstance(wave, Wave)
        return self.wave_at(wave, form.shape.order)

    def wave_at(self, form: Wave, order: float) -> Wave:
        """Return the form of a wave of one order, whose parameters then are known."""
        wave = form.at(order)
        self._modifiers.register(wave.parameters)
        return wave
