# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The named circuits of Table 1, and which of them a configuration describes."""

from __future__ import annotations

from functools import cache, reduce
import math
from typing import Any

from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive

NAMES = ('old', 'new')
# The numbers that a test sheet's name of a circuit stands for.
CIRCUITS = {'circuit': ('torque_share.circuit', ('k_2', 's_2', 'k_3', 'g_4')),
            'filter_1': ('torque_share.filter_1', ('gain', 'pole'))}


@cache
def constants(entry: str, name: str) -> dict[str, float]:
    """Return the numbers that 'circuit' or 'filter_1' of a sheet stands for, by dotted name."""
    return _numbers(load(f'{name}_circuit'), entry)


def nearest_circuit(drive: Drive, entry: str) -> str:
    """Return the named circuit whose numbers are nearest to those of a drive."""
    here = _numbers(drive, entry)

    def distance(name: str) -> float:
        there = constants(entry, name)
        return sum(_logarithm(here[path] / there[path]) for path in here)

    return min(NAMES, key=distance)


def _logarithm(ratio: float) -> float:
    """Return how far a ratio is from one, infinite for one that is not positive."""
    return abs(math.log(ratio)) if ratio > 0.0 else math.inf


def _numbers(drive: Drive, entry: str) -> dict[str, float]:
    part, keys = CIRCUITS[entry]
    return {path: float(value_of(drive, path)) for path in (f'{part}.{key}' for key in keys)}


def value_of(drive: Drive, path: str) -> Any:
    """Return what a configuration says of a dotted name."""
    return reduce(getattr, path.split('.'), drive)
