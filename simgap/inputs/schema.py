# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What may be said of one parameter, and the check of a value against it."""

from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
import difflib
import math
from typing import Any

from simgap.errors import one_line, UserError

Value = float | int | bool | str | tuple[float, ...]


class ParameterError(UserError, ValueError):
    """A parameter is unknown, missing, of the wrong kind or out of range; one line says which."""


@dataclass(frozen=True)
class Entry:
    """One parameter: its unit, what is allowed, and what it means."""

    unit: str = ''  # SI unit, '1' for a plain number, '' for a choice or a text
    low: float = -math.inf  # the closed range allowed, for numbers
    high: float = math.inf
    description: str = ''  # one sentence, for people
    live: bool = False  # whether it may change while the machine runs
    choices: tuple[str, ...] | None = None  # the allowed texts, for a choice; None for a number
    # least and greatest number of values of a list; None for one value
    lengths: tuple[int, int] | None = None
    whole: bool = False  # whether only whole numbers are allowed

    def allowed(self) -> str:
        if self.choices is not None:
            return 'one of ' + ', '.join(self.choices)
        kind = 'a whole number' if self.whole else 'a number'
        if self.lengths is not None:
            kind = f'a list of {self.lengths[0]} to {self.lengths[1]} numbers'
        unit = '' if self.unit in ('', '1') else f' {self.unit}'
        if math.isinf(self.low) and math.isinf(self.high):
            return kind + (f' in{unit}' if unit else '')
        if math.isinf(self.high):
            return f'{kind} of {self.low:g}{unit} or more'
        return f'{kind} from {self.low:g} to {self.high:g}{unit}'

    def check(self, key: str, value: object) -> Value:
        """Return `value` as this parameter's own type; ParameterError says what is allowed."""
        if self.choices is not None:
            if value not in self.choices:
                raise ParameterError(f'{key}: {quoted(value)} given, allowed is {self.allowed()}')
            return str(value)
        if self.lengths is not None:
            if (not isinstance(value, (list, tuple))
                    or not self.lengths[0] <= len(value) <= self.lengths[1]):
                raise ParameterError(f'{key}: {quoted(value)} given, allowed is {self.allowed()}')
            return tuple(self._number(f'{key}[{i}]', item) for i, item in enumerate(value))
        return self._number(key, value)

    def _number(self, key: str, value: object) -> float:
        # bool is an int in Python, and YAML 1.1 reads 8.74e6 as text: both are refused
        number = math.nan
        with suppress(OverflowError):  # an integer beyond every float
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                number = float(value)
        if (not math.isfinite(number) or not self.low <= number <= self.high
                or self.whole and number != int(number)):
            raise ParameterError(f'{key}: {quoted(value)} given, allowed is {self.allowed()}')
        return int(number) if self.whole else number


def quoted(value: object) -> str:
    """Return a value as it was given, short enough for an error of one line."""
    return one_line(repr(value), 80)


def nearest(key: str, known: Iterable[str]) -> str:
    """Return ', did you mean ...?' for a misspelt key, or nothing."""
    close = difflib.get_close_matches(key, list(known), n=1)
    return f', did you mean {close[0]}?' if close else ''


def mapping_of(key: str, body: object,
               allowed: Collection[str] | None = None) -> Mapping[str, Any]:
    """
    Return a mapping that a file holds under a key, '' for the file itself.

    Raises ParameterError if it is no mapping, or one of its keys is not allowed.
    """
    if not isinstance(body, Mapping):
        where = f'{key}: ' if key else ''
        raise ParameterError(f'{where}{one_line(repr(body), 40)} given, allowed is a mapping of '
                             'entries')
    for name in body:
        if allowed is not None and name not in allowed:
            where = one_line(f'{key}.{name}' if key else name)
            raise ParameterError(f'{where}: no such entry{nearest(str(name), allowed)}; '
                                 f'allowed are {", ".join(allowed)}')
    return body
