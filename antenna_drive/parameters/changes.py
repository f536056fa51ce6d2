# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of tuning parameters while the drive runs."""

from collections.abc import Mapping

from simgap.inputs.schema import Entry, nearest, ParameterError, Value


def check_changes(changes: Mapping[str, object], entries: Mapping[str, Entry]) -> dict[str, Value]:
    """
    Check a set of live changes, all or nothing.

    Raises ParameterError if a key is unknown or no tuning parameter, or its value not allowed.
    """
    checked: dict[str, Value] = {}
    for key, value in changes.items():
        if key not in entries:
            raise ParameterError(f'{key}: no such parameter{nearest(key, tuple(entries))}')
        if not entries[key].live:
            raise ParameterError(f'{key}: a physical constant, read-only while the drive runs')
        checked[key] = entries[key].check(key, value)
    return checked
