# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""An answer of a verdict with its numbers: a rival of others, and a start for a later search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from simgap.machine.contract import FloatArray, Form, Machine

# Digits of a covariance in a file: a number's deviation is known to a few percent at best.
_DIGITS = 5


@dataclass(frozen=True)
class Rival:
    """An answer of a verdict."""

    named: tuple[str, ...]  # effects that it names; none for 'none'
    effects: tuple[str, ...]  # that were fitted
    forms: tuple[str, ...]  # their names, one for each effect
    probability: float  # of the answer, in the verdict
    names: tuple[str, ...]  # numbers of the machine and of the effects, m of them
    values: FloatArray  # shape (m,)
    covariance: FloatArray  # shape (m, m)

    @property
    def point(self) -> dict[str, float]:
        """Return the values by name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    def forms_of(self, machine: Machine) -> list[Form]:
        """Return the forms of the effects in a machine; KeyError if its catalogue lacks one."""
        return [machine.catalogue.form_named(machine.catalogue[effect], form)
                for effect, form in zip(self.effects, self.forms, strict=True)]

    def is_known_to(self, machine: Machine) -> bool:
        """Return whether a machine has the effects in these forms."""
        try:
            self.forms_of(machine)
        except KeyError:
            return False
        return True

    def covariance_of(self, names: Sequence[str]) -> FloatArray:
        """Return the covariance of k of the values, shape (k, k)."""
        places = [self.names.index(name) for name in names]
        return self.covariance[np.ix_(places, places)]

    def as_data(self) -> dict[str, Any]:
        """Return the rival as plain data, for the JSON."""
        # the lower triangle of the covariance, a text for each row: a line for each number would
        # bury the verdict
        rows = [' '.join(f'{x:.{_DIGITS}g}' for x in row[:i + 1])
                for i, row in enumerate(self.covariance)]
        return {'named': list(self.named), 'effects': list(self.effects),
                'forms': list(self.forms), 'probability': self.probability,
                'names': list(self.names), 'values': self.values.tolist(), 'covariance': rows}

    @classmethod
    def of_data(cls, data: Mapping[str, Any]) -> Rival:
        """Take a rival from plain data; KeyError, TypeError, ValueError or AttributeError."""
        names = tuple(data['names'])
        lower = np.zeros((len(names), len(names)))
        for i, row in enumerate(data['covariance']):
            lower[i, :i + 1] = [float(x) for x in row.split()]
        return cls(tuple(data['named']), tuple(data['effects']), tuple(data['forms']),
                   float(data['probability']), names, np.array(data['values'], float),
                   lower + np.tril(lower, -1).T)
