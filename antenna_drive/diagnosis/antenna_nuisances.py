# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The antenna's tolerances, and how they share numbers with the effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from statistics import fmean

from antenna_drive.diagnosis.field_test import FieldTest
from antenna_drive.diagnosis.modifiers import ADD, AntennaParameter, KnownModifiers, Modifier
from antenna_drive.diagnosis.tolerances import starting_places
import numpy as np
from simgap.machine.contract import Effect, Form, Nuisances, Parameter, Point

# Places inside the gap, as shares of half the gap, at which each motor may start.
_STARTS = np.linspace(-0.95, 0.95, 13)


class AntennaNuisances(Nuisances):
    """
    The tolerances of the antenna drive in some tests; what they do is registered in `modifiers`.

    Starting places of both motors inside their gaps are tried in all combinations: where a bias
    closes both gaps at once, each motor's place looks right or wrong by the other's. One after the
    other they end in a wrong pair.
    """

    def __init__(self, tolerances: Sequence[AntennaParameter], tests: Sequence[FieldTest],
                 modifiers: KnownModifiers) -> None:
        super().__init__(tolerances, {k: _in_gaps(k, test) for k, test in enumerate(tests)})
        self._modifiers = modifiers
        modifiers.register(tolerances)
        # the nuisance that changes the same number in the same way, by field
        self._tolerance_of = {(item.modifier.fields[0], item.modifier.how): item
                              for item in tolerances
                              if item.experiment is None and item.modifier.fields}

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """Return the tolerances that take over what they can of an effect that is removed."""
        result = dict(point)
        for name, value in removed.items():
            modifier = self._modifiers.of(name)
            for path in modifier.fields:
                tolerance = self._tolerance_of.get((path, modifier.how))
                if tolerance is None or tolerance.name not in result:
                    continue
                both = _together(result[tolerance.name], value, modifier.how)
                result[tolerance.name] = min(max(both, tolerance.low), tolerance.high)
        return result

    def take_over(self, point: Point, forms: Sequence[Form]) -> tuple[dict[str, float], set[str]]:
        """
        Return a point at which effects alone stand for their numbers.

        An effect of several numbers, such as one in both motors, takes over what their tolerances
        have in common. These stay free, because the numbers may differ from each other.
        """
        result, held = dict(point), set()
        for item in (p for form in forms for p in form.sizes):
            assert isinstance(item, AntennaParameter)
            how, fields = item.modifier.how, item.modifier.fields
            same = [found for path in fields if (found := self._tolerance_of.get((path, how)))]
            if not same or len(same) < len(fields):
                continue
            common = fmean(result.get(tolerance.name, 0.0) for tolerance in same)
            together = _together(result[item.name], common, how)
            result[item.name] = min(max(together, item.low), item.high)
            for tolerance in same:
                rest = _apart(result.get(tolerance.name, 0.0), common, how)
                result[tolerance.name] = min(max(rest, tolerance.low), tolerance.high)
            if len(same) == 1:
                held.add(same[0].name)
        return result, held


def _in_gaps(k: int, test: FieldTest) -> list[list[Point]]:
    first, second = (item.name for item in starting_places(k, test))
    return [[{first: one, second: other}
             for one, other in product(_STARTS.tolist(), repeat=2)]]


def _together(one: float, other: float, how: str) -> float:
    """Return two changes of one number as one."""
    return one + other if how == ADD else (1.0 + one) * (1.0 + other) - 1.0


def _apart(both: float, other: float, how: str) -> float:
    """Return the change of a number that makes both with another one."""
    return both - other if how == ADD else (1.0 + both) / (1.0 + other) - 1.0


def tolerated(effect: Effect, tolerances: Sequence[AntennaParameter]) -> Effect:
    """Return an effect whose parameters know by how much their numbers may be off anyway."""
    allowed = {(path, item.modifier.how): item.high for item in tolerances
               if item.experiment is None for path in item.modifier.fields}

    def known(item: Parameter) -> Parameter:
        assert isinstance(item, AntennaParameter)
        modifier: Modifier = item.modifier
        same_number = min(
            (allowed.get((path, modifier.how), 0.0) for path in modifier.fields), default=0.0)
        return replace(item, tolerance=max(item.tolerance, same_number))

    return replace(effect, forms=tuple(
        replace(form, parameters=tuple(known(p) for p in form.parameters))
        for form in effect.forms))
