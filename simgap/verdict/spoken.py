# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers as people say them."""

from __future__ import annotations

import math

# A change above this share is said as a multiple.
_MULTIPLE = 10.0


def number(value: float) -> str:
    """Return a number with three digits: 23.6, 8.74e6."""
    if not math.isfinite(value):
        return 'no number'
    size = abs(value)
    if 100.0 <= size < 1e5:
        return f'{value:.0f}'
    return f'{value:.3g}'.replace('e+0', 'e').replace('e-0', 'e-').replace('e+', 'e')


def quantity(value: float, unit: str) -> str:
    """Return a number with its unit; a number of unit 1 has none."""
    return number(value) + ('' if unit in ('1', '') else f' {unit}')


def percent(share: float, word: str = ' percent') -> str:
    """Return a share from 0 to 1 in percent; 100 means all of it and 0 nothing."""
    if 0.995 <= share < 1.0:
        return f'more than 99{word}'
    if 0.0 < share < 0.001:
        return f'less than 0.1{word}'
    return f'{100.0 * share:.{0 if abs(share) >= 0.1 else 1}f}{word}'


def ratio(change: float, word: str = ' percent') -> str:
    """Return by how much a number differs, without its sign: 40 percent, 930 times."""
    size = abs(change)
    if not math.isfinite(size):
        return 'without end'
    return f'{number(size)} times' if size >= _MULTIPLE else f'{100.0 * size:.3g}{word}'
