# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter sets as numpy records: what the compiled physics reads, field by field."""

from dataclasses import fields
from functools import cache
import os
from typing import Any, get_type_hints, TypeVar

import numpy as np
from simgap.errors import UserError
from simgap.inputs.schema import Entry

Set = TypeVar('Set')


@cache
def dtype_of(kind: type) -> np.dtype[Any]:
    """
    Return the record type of a parameter set, with a record in it for each set within.

    Numbers become float64, choices and whole numbers int64, lists a fixed number of float64 with
    their length in `<name>_count`. Raises UserError where nothing is compiled.
    """
    if os.environ.get('NUMBA_DISABLE_JIT', '0').strip() not in ('', '0'):
        raise UserError('NUMBA_DISABLE_JIT is set, and Python cannot read what the compiled '
                        'physics reads: unset it')
    hints: dict[str, Any] = get_type_hints(kind)
    parts: list[tuple[Any, ...]] = []
    for item in fields(kind):
        entry = item.metadata.get('entry')
        if entry is None:
            parts.append((item.name, dtype_of(hints[item.name])))
        elif entry.lengths is not None:
            parts.append((item.name, np.float64, (entry.lengths[1],)))
            parts.append((f'{item.name}_count', np.int64))
        elif entry.choices is not None or entry.whole:
            parts.append((item.name, np.int64))
        else:
            parts.append((item.name, np.float64))
    return np.dtype(parts, align=True)


@cache
def place_of(kind: np.dtype[Any], path: str) -> int:
    """
    Return where a number lies in a record, in numbers: every field takes eight bytes.

    kind : of the record, from `dtype_of`
    path : names of the fields with dots between; the last one may be the index of a list
    """
    at = 0
    for part in path.split('.'):
        if kind.subdtype is not None:
            kind, _ = kind.subdtype
            at += int(part) * kind.itemsize
        else:
            assert kind.fields is not None
            kind, offset = kind.fields[part][:2]
            at += offset
    return at // 8


def record_of(parameters: Any) -> np.ndarray[Any, np.dtype[Any]]:
    """Return a parameter set as an array of one record, to vary by field or to repeat."""
    kind: Any = type(parameters)
    record = np.zeros(1, dtype_of(kind))
    _fill(record, parameters)
    return record


def set_of(kind: type[Set], record: Any) -> Set:
    """Return the parameter set of a record, in an array of one; the inverse of `record_of`."""
    hints: dict[str, Any] = get_type_hints(kind)
    found: dict[str, Any] = {}
    for item in fields(kind):  # type: ignore[arg-type]
        part, entry = record[item.name], item.metadata.get('entry')
        if entry is None:
            found[item.name] = set_of(hints[item.name], part)
        elif entry.lengths is not None:
            found[item.name] = tuple(part[0, :record[f'{item.name}_count'][0]].tolist())
        elif entry.choices is not None:
            found[item.name] = entry.choices[part[0]]
        else:
            found[item.name] = part[0].item()
    return kind(**found)


def _fill(record: Any, parameters: Any) -> None:
    for item in fields(parameters):
        value = getattr(parameters, item.name)
        entry: Entry | None = item.metadata.get('entry')
        if entry is None:
            _fill(record[item.name], value)
        elif entry.lengths is not None:
            record[item.name][..., :len(value)] = value
            record[f'{item.name}_count'] = len(value)
        elif entry.choices is not None:
            record[item.name] = entry.choices.index(value)
        else:
            record[item.name] = value
