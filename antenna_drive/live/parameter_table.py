# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the page shows of a parameter, read from the descriptor that its node gives."""

from collections.abc import Mapping, Sequence
import math
from typing import Any, NamedTuple

_DEGREES = 180.0 / math.pi

# People read angles in degrees; everything else is shown in the unit of the node.
_SHOWN = {'rad/s': ('deg/s', _DEGREES), 'rad': ('deg', _DEGREES)}

# The waveform of test_signal has no unit of its own: it commands a rate, or a torque.
_TORQUE = 'torque.'
_WAVEFORM_UNIT = 'SI'

# How far a slider reaches where the range is far wider than anybody wants [SI].
_REACH = {'rad/s': math.radians(1.0), 'N m': 1e6, 's': 20.0, 'V': 20.0, '1/s': 150.0, '1': 1.0,
          'Hz': 10.0}
# A range this many times the reach is cut for the slider; the field beside it takes all of it.
_CUT = 4.0


class Description(NamedTuple):
    """A descriptor in plain data."""

    # the parameter, what it is, what is allowed (additional_constraints)
    name: str
    text: str
    allowed: str
    read_only: bool  # whether it is a constant while the drive runs
    # the range, None if it has none
    low: float | None = None
    high: float | None = None
    whole: bool = False  # whether only whole numbers are allowed


def entry_of(described: Description, value: Any) -> dict[str, Any]:
    """
    Return a parameter as the page shows it.

    Returns name, text, allowed, live; value in SI; `kind`: choice, number, list, flag or text;
    `unit` shown and `factor`, how many of it are one SI unit; for a choice `choices`; for a number
    `low` and `high`, which may be None, `from` and `to`, the reach of the slider, and `whole`; all
    numbers in SI.
    """
    text, unit = _split(described)
    entry: dict[str, Any] = {
        'name': described.name, 'text': text, 'allowed': described.allowed,
        'live': not described.read_only, 'value': value, 'kind': _kind(described, value)}
    if unit == _WAVEFORM_UNIT:
        unit = 'N m' if described.name.startswith(_TORQUE) else 'rad/s'
        entry['text'] = text.removesuffix(', rad/s or N m')
    entry['unit'], entry['factor'] = _SHOWN.get(unit, (unit, 1.0))
    if entry['kind'] == 'choice':
        entry['choices'] = described.allowed.removeprefix('one of ').split(', ')
    elif entry['kind'] == 'number':
        entry |= {'low': described.low, 'high': described.high, 'whole': described.whole}
        entry['from'], entry['to'] = reach(described.low, described.high, unit or '1', value)
    return entry


def _kind(described: Description, value: Any) -> str:
    if isinstance(value, bool):
        return 'flag'
    if isinstance(value, str):
        return 'choice' if described.allowed.startswith('one of ') else 'text'
    return 'number' if isinstance(value, (int, float)) else 'list'


def _split(described: Description) -> tuple[str, str]:
    """Return a description without the unit at its end, and the unit, '' for none."""
    # a symbol of docs/model.md stands in brackets too; only a unit is in what is allowed as well
    body, bracket, rest = described.text.rpartition(' [')
    unit = rest.removesuffix(']')
    if bracket and rest.endswith(']') and described.allowed.removesuffix(' or more').endswith(
            f' {unit}'):
        return body, unit
    return described.text, ''


def reach(low: float | None, high: float | None, unit: str, value: float) -> tuple[float, float]:
    """Return from where to where a slider goes: the range, or a useful part of a wide one."""
    wide = max(_REACH.get(unit, 1.0), 2.0 * abs(value))
    least, most = (-math.inf if low is None else low), (math.inf if high is None else high)
    if most - least <= _CUT * wide:
        return least, most
    return max(least, -wide), min(most, wide)


def table(described: Sequence[Description], values: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the entries of a node that has told these descriptors and values."""
    return [entry_of(item, values[item.name]) for item in described if item.name in values]
