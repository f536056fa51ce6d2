# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the page shows of a parameter, read from the descriptor that its node gives."""

import math
from typing import Any

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


def entry_of(described: Any, value: Any) -> dict[str, Any]:
    """
    Return a parameter as the page shows it.

    described : its ParameterDescriptor
    value : in force, plain data

    Returns name, text, allowed, live; value in SI; `kind`: choice, number, list, flag or text;
    `unit` shown and `factor`, how many of it are one SI unit; for a choice `choices`; for a number
    `low` and `high`, which may be None, `from` and `to`, the reach of the slider, and `whole`; all
    numbers in SI.
    """
    text, unit = _split(described.description, described.additional_constraints)
    entry: dict[str, Any] = {
        'name': described.name, 'text': text, 'allowed': described.additional_constraints,
        'live': not described.read_only, 'value': value,
        'kind': _kind(described.additional_constraints, value)}
    if unit == _WAVEFORM_UNIT:
        unit = 'N m' if described.name.startswith(_TORQUE) else 'rad/s'
        entry['text'] = text.removesuffix(', rad/s or N m')
    entry['unit'], entry['factor'] = _SHOWN.get(unit, (unit, 1.0))
    if entry['kind'] == 'choice':
        entry['choices'] = entry['allowed'].removeprefix('one of ').split(', ')
    elif entry['kind'] == 'number':
        low, high = next(((float(item.from_value), float(item.to_value)) for item in (
            *described.floating_point_range, *described.integer_range)), (None, None))
        entry |= {'low': low, 'high': high, 'whole': bool(described.integer_range)}
        entry['from'], entry['to'] = reach(low, high, unit or '1', value)
    return entry


def _kind(allowed: str, value: Any) -> str:
    if isinstance(value, bool):
        return 'flag'
    if isinstance(value, str):
        return 'choice' if allowed.startswith('one of ') else 'text'
    return 'number' if isinstance(value, (int, float)) else 'list'


def _split(text: str, allowed: str) -> tuple[str, str]:
    """Return a description without the unit at its end, and the unit, '' for none."""
    # a symbol of docs/model.md stands in brackets too; only a unit is in what is allowed as well
    body, bracket, rest = text.rpartition(' [')
    unit = rest.removesuffix(']')
    if bracket and rest.endswith(']') and allowed.removesuffix(' or more').endswith(f' {unit}'):
        return body, unit
    return text, ''


def reach(low: float | None, high: float | None, unit: str, value: float) -> tuple[float, float]:
    """Return from where to where a slider goes: the range, or a useful part of a wide one."""
    wide = max(_REACH.get(unit, 1.0), 2.0 * abs(value))
    least, most = (-math.inf if low is None else low), (math.inf if high is None else high)
    if most - least <= _CUT * wide:
        return least, most
    return max(least, -wide), min(most, wide)
