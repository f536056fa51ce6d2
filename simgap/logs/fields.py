# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The fields of a message by their paths, such as `motor.position[elbow]`.

`a.b` is a field of a field, `v[2]` an element, counted from 0. Where beside a list there is one of
as many texts, as `name` in a JointState, or its dimensions have labels, as in a multi-array, an
element is also `v[elbow]` and `v[name=elbow]`. A message in a list is also `motors[id=3]`.
"""

from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any

import numpy as np

# Longer lists are pictures or point clouds, of whose elements nobody asks for one.
_LONGEST = 128
# A time is a message of two numbers; ROS 2, Protobuf, Foxglove's JSON and ROS 1 call them so.
_TIMES = (['sec', 'nanosec'], ['seconds', 'nanos'], ['sec', 'nsec'], ['secs', 'nsecs'])


class Stamp(str):
    """A time in seconds as a text, whatever unit numbers are in."""

    @classmethod
    def of(cls, nanoseconds: int) -> 'Stamp':
        return cls(Decimal(nanoseconds).scaleb(-9))


def fields_of(message: Any) -> dict[str, Any]:
    """Return every field that is no message by its paths: numbers, texts, times and lists."""
    return {path: value for path, value, _ in _walk(message, '')}


def numbers_of(message: Any) -> list[str]:
    """Return one path for each number of a message, with a label where there is one."""
    return [path for path, value, is_first in _walk(message, '')
            if is_first and isinstance(value, (int, float, np.generic))]


def _walk(value: Any, path: str, labels: Mapping[int, list[str]] = {},
          is_first: bool = True) -> Iterator[tuple[str, Any, bool]]:
    """Yield path and value of each field, and whether it is the first path of that field."""
    if _is_list(value):
        yield path, value, is_first
        for k, item in enumerate(value if len(value) <= _LONGEST else ()):
            own = [f'{name}={key}' for name, key in _members(item).items()
                   if type(key) in (int, str)]
            for j, label in enumerate([*labels.get(k, ()), str(k), *own]):
                yield from _walk(item, f'{path}[{label}]', is_first=is_first and j == 0)
        return
    members = _members(value)
    if list(members) in _TIMES:
        seconds, rest = members.values()
        yield path, Stamp.of(seconds * 1_000_000_000 + rest), is_first
    elif members:
        for name, member in members.items():
            yield from _walk(member, f'{path}.{name}' if path else name,
                             _labels(members, member) if _is_list(member) else {}, is_first)
    else:
        yield path, value, is_first


def _members(message: Any) -> dict[str, Any]:
    """Return the fields of a mapping, a ROS message or a Protobuf message; none of a number."""
    if isinstance(message, Mapping):
        return dict(message)
    described = getattr(message, 'DESCRIPTOR', None)
    names = ([field.name for field in described.fields] if described else
             getattr(message, '__dataclass_fields__', ()))
    return {name: getattr(message, name) for name in names if name[0] != '_'}


def _is_list(value: Any) -> bool:
    return hasattr(value, '__len__') and not isinstance(value, (str, bytes, Mapping))


def _labels(members: Mapping[str, Any], items: Any) -> dict[int, list[str]]:
    """Return the labels of the elements of a list, from a list of texts beside it."""
    for name, texts in members.items():
        if name == 'layout':
            texts = [_members(dim)['label'] for dim in _members(texts).get('dim', ())]
        if (_is_list(texts) and texts is not items and len(texts) == len(items) == len(set(
                map(str, texts))) and all(isinstance(text, str) and text for text in texts)):
            return {k: [f'name={text}', text] if name == 'name' else [text, f'{name}={text}']
                    for k, text in enumerate(texts)}
    return {}
