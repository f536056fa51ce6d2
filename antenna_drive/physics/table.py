# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A function that was learnt and that no equation has: a table of its values."""

from typing import Any

from simgap.laws.compiling import inner


@inner
def tabled(x: float, span: Any, values: Any) -> float:
    """
    Return a function at x: straight lines between its values, and the outer ones beyond.

    span : where its first and its last value is, the others at even distances; equal for none
    values : arrays of shape (2,) and (n,), which a typed set has as tuples
    """
    if not span[1] > span[0]:
        return 0.0
    last = len(values) - 1
    place = min(max((x - span[0]) / (span[1] - span[0]), 0.0), 1.0) * last
    k = min(int(place), last - 1)
    return float(values[k] + (place - k) * (values[k + 1] - values[k]))
