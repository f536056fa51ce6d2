# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Plain data beside the samples of a recording: frozen on the way in, JSON on the way out."""

from collections.abc import Mapping, Sequence
import json
import math
import numbers
from types import MappingProxyType
from typing import Any

from simgap.inputs.plain import PlainDataError


def freeze(value: object, where: str = '') -> Any:
    """
    Return an unchangeable copy: mappings become read-only views, lists become tuples.

    Raises PlainDataError: a part is none of the plain kinds, or a number is not finite.
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        if not math.isfinite(value):
            raise PlainDataError(f'{where or "value"}: {value!r} is no finite number')
        return float(value)
    if isinstance(value, Mapping):
        frozen = {}
        for key, item in value.items():
            if not isinstance(key, str):
                raise PlainDataError(f'{where or "mapping"}: the key {key!r} is no text')
            frozen[key] = freeze(item, f'{where}.{key}' if where else key)
        return MappingProxyType(frozen)
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray)):
        return tuple(freeze(item, f'{where}[{i}]') for i, item in enumerate(value))
    raise PlainDataError(f'{where or "value"}: {type(value).__name__} is no plain data')


def thaw(value: Any) -> Any:
    """Return frozen plain data as dicts and lists, the way json and yaml write them."""
    if isinstance(value, Mapping):
        return {key: thaw(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [thaw(item) for item in value]
    return value


def to_json(value: Any) -> str:
    """Return frozen plain data as strict JSON; every double comes back to its last bit."""
    return json.dumps(thaw(value), ensure_ascii=False, allow_nan=False, indent=1)
