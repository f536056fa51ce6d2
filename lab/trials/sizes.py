# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Sizes that a truth and a verdict both state: as the number of the same thing in the same unit.

Comparable are changes of a constant, and numbers of a law that the trial's antenna and the
catalogue share. Left out are effects whose laws differ (viscous and Stribeck friction, friction
by load, tight spots, dead zones, worn bull gears), waves, whose amplitude a verdict states in
parts, and gusts, which have no size in a verdict. Under family B, all effects of another law are
left out too.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from lab.antenna.effect import Parameters
from lab.antenna.family_b import LAWS
from lab.antenna.machine import nominal
from lab.antenna.table import read_table
from lab.joints.machines import kind_of
from lab.trials.verdict import Interval, Verdict


class Size(NamedTuple):
    """How a verdict states the size of an effect."""

    parameter: str                              # of the verdict, behind the effect's id
    unit: str
    true: float


class StatedSize(NamedTuple):
    """The size of an effect: the true one, and what a verdict says."""

    effect: str
    true: float
    stated: Interval

    @property
    def relative_error(self) -> float:
        """Return the size of the error over the true size."""
        return abs(self.stated.value - self.true) / abs(self.true)

    @property
    def covered(self) -> bool:
        """Return whether the 95 percent interval holds the true size, to the last digits."""
        # an interval may end at what the recording shows exactly, such as the digit of a column
        rounding = 1e-9 * abs(self.true)
        return self.stated.low - rounding <= self.true <= self.stated.high + rounding


_TABLE = read_table('sizes.yaml', Path(__file__).parent)


def size_of(effect: str, values: Parameters, machine: str | None = None) -> Size | None:
    """
    Return how a verdict states the size of an effect; None if it is not comparable.

    Values are its quantities in the truth; `machine` is one of MACHINES, None for the antenna.
    """
    if machine is None:
        row = _TABLE.get(effect) or _TABLE.get(effect.split('.', 1)[1])
    else:
        row = kind_of(machine).cause(effect).stated
    if not row:
        return None
    true = values[row['number']] - (1.0 if row['number'] == 'factor' else 0.0)
    if 'times' in row:
        true *= nominal(*row['times'].split('.'))
    if 'over' in row:
        true /= nominal(*row['over'].split('.'))
    return Size(row['parameter'].format(mode=int(values.get('mode', 0))), row['unit'], true)


def stated_sizes(truth: Mapping[str, Any], verdict: Verdict) -> list[StatedSize]:
    """Return the sizes of the true effects that the first entry of a verdict names and states."""
    first, found = verdict.which[0], []
    for entry in truth['effects']:
        key = entry['id']
        if key not in first.effects or (truth.get('family') == 'b' and key.split('.')[1] in LAWS):
            continue
        size = size_of(key, entry['parameters'], truth.get('machine'))
        stated = first.parameters.get(f'{key}.{size.parameter}') if size else None
        # older verdicts, as the laboratory, say A for article A
        if size and stated and size.unit in ('', stated.unit.removeprefix('article ')):
            found.append(StatedSize(key, size.true, stated))
    return found
