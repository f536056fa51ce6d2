# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers as people say them."""

from collections.abc import Mapping
import math
from typing import Any


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


def size(value: float, unit: str, word: str = ' percent') -> str:
    """Return the size of an effect with its unit; one of unit 1 is a share, and in percent."""
    return f'{number(100.0 * value)}{word}' if unit == '1' else quantity(value, unit)


def percent(share: float) -> str:
    """Return a share from 0 to 1 in percent; 100 means all of it and 0 nothing."""
    if 0.995 <= share < 1.0:
        return 'more than 99 percent'
    if 0.0 < share < 0.001:
        return 'less than 0.1 percent'
    return f'{100.0 * share:.{0 if abs(share) >= 0.1 else 1}f} percent'


def with_interval(item: Mapping[str, Any]) -> str:
    """Return a number of a verdict with its unit and its interval."""
    low, high = item['ci95']
    return f'{quantity(item["value"], item["unit"])} ({number(low)} to {number(high)})'
