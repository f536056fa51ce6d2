# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a node says on `<node>/changes`: which parameters are in force from which step of a run.

One JSON text for each message. A run begins with {"run", "step": 0, "settings": {...}}, every
parameter in force; each live change follows as {"run", "step", "changes": {...}}. Whoever
listens gets whatever anybody has put on the topic, so a text is checked in full before it is
used. Nothing here needs ROS.
"""

from collections.abc import Mapping
import json
import math
from typing import Any

from antenna_drive.limits import CHANGE
from antenna_drive.lockstep.frame import LARGEST_RUN

SETTINGS, CHANGES = 'settings', 'changes'

# Lists of numbers, such as a multisine's, are the deepest that a parameter is.
_DEEPEST = 4


def write_record(run: float, step: int, key: str, values: Mapping[str, Any]) -> str:
    """Return the text of a record; `key` is SETTINGS or CHANGES."""
    return json.dumps({'run': int(run), 'step': step, key: dict(values)})


def read_record(text: str) -> dict[str, Any] | None:
    """Return the record that a text holds, None if it holds none."""
    if len(text) > CHANGE.value():
        return None
    try:
        record = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return record if is_record(record) else None


def is_record(record: object) -> bool:
    """Return whether this is a record: a run, a step, and settings or changes of plain data."""
    if not isinstance(record, Mapping):
        return False
    values = record.get(SETTINGS, record.get(CHANGES))
    return (is_count(record.get('run')) and record['run'] > 0 and is_count(record.get('step'))
            and isinstance(values, Mapping) and _is_plain(values, _DEEPEST))


def is_count(value: object) -> bool:
    """Return whether this is a whole number that may be a run or a step."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < LARGEST_RUN


def _is_plain(value: object, deepest: int) -> bool:
    if isinstance(value, str):
        return value.isascii() or _has_utf_8(value)
    if value is None or isinstance(value, (bool, int)):
        return True
    if isinstance(value, float):
        return math.isfinite(value)
    if deepest and isinstance(value, Mapping):
        return all(isinstance(key, str) and _is_plain(key, 0) and _is_plain(item, deepest - 1)
                   for key, item in value.items())
    return bool(deepest) and isinstance(value, (list, tuple)) and all(
        _is_plain(item, deepest - 1) for item in value)


def _has_utf_8(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:  # half of a surrogate pair, which JSON can spell
        return False
    return True
