# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue of what a model may lack, and how its effects belong together."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from copy import copy

from simgap.machine.arrays import FloatArray
from simgap.machine.effect import Effect, Form
from simgap.machine.experiment import Experiment


class Catalogue(dict[str, Effect]):
    """Effects by id, in the order in which they are tried."""

    def __init__(self, effects: Iterable[Effect] = ()) -> None:
        super().__init__({effect.id: effect for effect in effects})

    def without(self, effects: Collection[str]) -> Catalogue:
        """Return the catalogue without effects and what depends on them; KeyError if unknown."""
        # also without their parts, and what becomes one of them at an end of its range
        gone = {name for effect in effects for name in (effect, *self[effect].parts)}
        kept = copy(self)
        while found := gone.intersection(kept):
            for name in found:
                del kept[name]
            gone |= {name for name, effect in kept.items()
                     if gone.intersection((*effect.parts, *effect.simpler))}
        return kept

    def forms(self, effect: Effect, experiments: Sequence[Experiment],
              residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return the forms of an effect worth a fit; residuals are measured minus predicted."""
        return effect.forms

    def whole(self, form: Form) -> Form:
        """Return the form with one size for all tests."""
        return form

    def typical_form(self, effect: Effect) -> Form:
        """Return the form of an effect by which planned tests are judged."""
        return effect.forms[0]

    def form_named(self, effect: Effect, name: str) -> Form:
        """Return the form of an effect by its name; KeyError if there is no such form."""
        for form in effect.forms:
            if form.name == name:
                return form
        raise KeyError(f'{effect.id}: {name}')

    def relatives(self, ident: str) -> Iterator[Effect]:
        """Yield an effect in other places."""
        effect = self[ident]
        for part in effect.parts:
            yield self[part]
        for whole in self.values():
            if effect.id in whole.parts:
                yield whole
                yield from (self[part] for part in whole.parts if part != effect.id)

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        """Return the form of an effect's part that corresponds to a form of the effect."""
        return part.forms[effect.forms.index(form)]
