# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The labels of a test: what was different in it, such as load: A."""

from simgap.errors import one_line
from simgap.inputs.schema import mapping_of, ParameterError

LONGEST_LABEL = 60


def parse_labels(key: str, tree: object) -> tuple[tuple[str, str], ...]:
    """
    Read the labels of a test: what was different in it, such as load: A.

    YAML reads on and off as truth values; here they are words again. Raises ParameterError if it
    is no mapping from short names to short texts or numbers.
    """
    found = {}
    for name, given in mapping_of(key, tree).items():
        value = {True: 'on', False: 'off'}[given] if isinstance(given, bool) else str(
            plain_value(given))
        if not (isinstance(name, str) and isinstance(given, (str, int, float)) and all(
                0 < len(text) <= LONGEST_LABEL for text in (name, value))):
            raise ParameterError(f'{key}.{one_line(name)}: {one_line(repr(value), 40)} given, '
                                 f'allowed is a text of up to {LONGEST_LABEL} characters')
        found[one_line(name)] = value
    return tuple(found.items())


def plain_value(value: object) -> object:
    """Return a value that can be shown in one line: a short text for what can be no value."""
    if isinstance(value, str):
        return one_line(value)
    if isinstance(value, (bool, float)) or value is None:
        return value
    if isinstance(value, int) and abs(value) < 2**64:
        return value
    return f'a {type(value).__name__}'
