# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Plain data (texts, numbers, lists, mappings) as strict JSON, and back."""

from collections.abc import Mapping
import json
import math
import os
from typing import Any

import numpy as np
from simgap.errors import one_line


class PlainDataError(ValueError):
    """Something is no plain data: a text, number, truth value, None, list or mapping."""


def strict_json(result: object) -> str:
    """
    Return a result as strict JSON, as every command writes it.

    NaN, which means that there is no value, becomes null; numpy scalars, arrays and paths become
    numbers, lists and texts. Raises ValueError if `result` holds an infinity, TypeError if it
    holds something that JSON has no word for.
    """
    return json.dumps(_plain(result), indent=2, allow_nan=False, ensure_ascii=False) + '\n'


def _plain(value: object) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, float) and math.isnan(value):
        return None
    return value


def _refuse_constant(text: str) -> None:
    raise PlainDataError(f'{text} is no finite number')


def from_json(text: str | bytes) -> Any:
    """Read strict JSON; PlainDataError if it is none, too deep, or holds NaN or an infinity."""
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except PlainDataError:
        raise
    except json.JSONDecodeError as error:
        raise PlainDataError(
            f'line {error.lineno}, column {error.colno}: no JSON, {error.msg}') from None
    except UnicodeDecodeError:
        raise PlainDataError('the text is not UTF-8') from None
    except RecursionError:
        raise PlainDataError('nested too deeply') from None
    except ValueError as error:  # an integer with more digits than Python reads
        raise PlainDataError(one_line(error)) from None
