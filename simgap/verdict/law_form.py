# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The textbook form that a law is most like, and how far it is from it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from simgap.machine.contract import FloatArray
from simgap.machine.with_law import Law
from simgap.settings import DEFAULT
from simgap.verdict.spoken import quantity

# Rates and widths that are tried, as shares of the greatest value of the quantity.
_SHARES = np.linspace(0.05, 0.8, 16)


def nearest_form(law: Law) -> tuple[str, float]:
    """
    Return the form that a law is most like, and the share of its square that the form lacks.

    Forms are compared by Akaike's criterion, with the law's deviations and an error of form.
    """
    x, y, sigma = (np.array(item) for item in (law.at, law.values, law.deviations))
    error = DEFAULT.evidence.form_error * float(np.sqrt(np.mean(y ** 2)))
    weight = 1.0 / np.maximum(np.hypot(sigma, error), 1e-300)
    whole = float(np.sum((weight * y) ** 2))
    best, name, lacks = np.inf, '', 1.0
    for form, columns, numbers in _forms(x, law.by_unit):
        design = np.column_stack([np.ones_like(x), *columns]) * weight[:, np.newaxis]
        values, *_ = np.linalg.lstsq(design, weight * y, rcond=None)
        chi = float(np.sum((weight * y - design @ values) ** 2))
        if chi + 2.0 * numbers < best:
            best, name, lacks = chi + 2.0 * numbers, form, chi / max(whole, 1e-300)
    return name, min(lacks, 1.0)


def _forms(x: FloatArray, unit: str) -> Iterator[tuple[str, list[FloatArray], int]]:
    """Yield forms, their functions of a quantity beside a constant, and how many numbers."""
    sign, greatest = np.sign(x), float(np.abs(x).max())
    yield 'a constant', [], 1
    yield 'a straight line', [x], 2
    if x.min() < 0.0 < x.max():
        yield 'a jump at zero (Coulomb friction)', [sign], 2
        yield 'a jump at zero and a straight line', [sign, x], 3
        yield 'its square with its sign', [x * np.abs(x)], 2
    yield 'a parabola', [x, x ** 2], 3
    for at in (_SHARES * greatest).tolist():
        text = quantity(at, unit)
        beyond = sign * np.maximum(np.abs(x) - at, 0.0)
        yield f'a spring with slack, none within {text}', [beyond], 3
        if x.min() < 0.0 < x.max():
            yield (f'Stribeck friction, within {text}',
                   [sign, sign * np.exp(-(x / at) ** 2)], 4)
