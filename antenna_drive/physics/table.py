# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A function that was learnt and that no equation has: a table of its values."""

from typing import Any

from simgap.laws.compiling import shared


@shared
def tabled(x: float, reach: float, values: Any) -> float:
    """
    Return a function at x: straight lines between its values, and the outer ones beyond.

    reach : its values are at even distances from -reach to reach
    values : an array of shape (n,), which a typed set has as a tuple
    """
    last = len(values) - 1
    place = min(max(0.5 + 0.5 * x / reach, 0.0), 1.0) * last
    k = min(int(place), last - 1)
    return float(values[k] + (place - k) * (values[k + 1] - values[k]))
