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
            and isinstance(values, Mapping) and _is_plain(values))


def is_count(value: object) -> bool:
    """Return whether this is a whole number that may be a run or a step."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < LARGEST_RUN


def _is_plain(values: object) -> bool:
    """Return whether these are finite numbers and texts that can be written, and not too deep."""
    try:
        # a text may hold half of a surrogate pair, which JSON can spell
        json.dumps(values, allow_nan=False, ensure_ascii=False).encode()
    except (TypeError, ValueError, RecursionError):
        return False
    return _depth(values) <= _DEEPEST


def _depth(value: object) -> int:
    if not isinstance(value, (dict, list, tuple)):
        return 0
    items = value.values() if isinstance(value, dict) else value
    return 1 + max(map(_depth, items), default=0)
