# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
MATLAB's .mat files, up to version 7: the variables that are plain real numbers.

scipy takes a number's type in a file as an index into a table of 20 pointers, without a look: a
damaged file crashes the process (scipy pull request 25829). So the types are looked at first.
Format: The MathWorks, 'MAT-File Format', level 5.
"""

from pathlib import Path
from struct import error as StructError, unpack_from
from typing import Any
import zlib

import numpy as np
from simgap.inputs.limits import SAMPLES
from simgap.logs.channel import RecordingError

_NUMBERS = frozenset({'double', 'single', 'logical', *(
    f'{sign}int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64))})
# Codes of the format: the types of stored numbers, the classes of arrays of numbers, and a flag.
_STORED = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13})
_CLASSES = range(6, 16)
_OPAQUE, _MATRIX, _COMPRESSED = 17, 14, 15
_COMPLEX = 1 << 11
_HEADER = 128
# What stands before the numbers of a variable takes less than this [B].
_HEAD = 65536
# what scipy calls a variable without a name
_NAMELESS = '__function_workspace__'


def read_mat(path: Path) -> dict[str, Any]:
    """
    Return the variables of a .mat file, version 4 to 7, that are plain real numbers.

    Shapes are as in MATLAB: at least two axes. Raises RecordingError if it is of version 7.3, or
    has more numbers than `simgap.inputs.limits` allows; ValueError, or another error of scipy's,
    if it is damaged.
    """
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import matfile_version, MatReadError
    wanted, room = [], SAMPLES.value()
    try:
        plain = _variables(path) if matfile_version(path)[0] == 1 else None
        for name, shape, kind in whosmat(path):
            if kind in _NUMBERS and (plain is None or plain.get(name)):
                wanted.append(name)
                room -= int(np.prod(shape, dtype=object))
        if room < 0:
            raise RecordingError(SAMPLES.exceeded())
        found = loadmat(path, variable_names=wanted) if wanted else {}
    except (MatReadError, StructError) as error:
        raise ValueError(str(error)) from None
    except NotImplementedError:
        raise RecordingError('a file of version 7.3; in MATLAB, save it with -v7') from None
    return {name: np.asarray(found[name]) for name in wanted if name in found}


def _variables(path: Path) -> dict[str, bool]:
    """Return the names of a file of level 5, and which of them are plain real numbers."""
    variables: dict[str, bool] = {}
    with path.open('rb') as stream:
        order = '<' if stream.read(_HEADER)[-2:] == b'IM' else '>'
        while tag := stream.read(8):
            code, size = unpack_from(f'{order}II', tag)
            place = stream.tell()
            head = stream.read(min(size, _HEAD))
            if code == _COMPRESSED:
                head = zlib.decompressobj().decompress(head, _HEAD)
                code, _ = unpack_from(f'{order}II', head)
                head = head[8:]
            if code != _MATRIX:
                raise ValueError(f'an element of type {code} in the place of a variable')
            name, is_plain = _variable(head, order)
            variables.setdefault(name, is_plain)  # of two with one name scipy reads the first
            stream.seek(place + size)
    return variables


def _variable(head: bytes, order: str) -> tuple[str, bool]:
    flags, = unpack_from(f'{order}I', head, 8)
    kind, place = flags & 0xff, 16
    if kind != _OPAQUE:
        *_, place = _element(head, place, order)  # the dimensions
    _, text, place = _element(head, place, order)
    name = text.decode('latin1') or _NAMELESS
    if kind not in _CLASSES or flags & _COMPLEX:
        return name, False
    stored, *_ = _element(head, place, order)
    if stored not in _STORED:
        raise ValueError(f'numbers of type {stored}, which the format does not have')
    return name, True


def _element(head: bytes, place: int, order: str) -> tuple[int, bytes, int]:
    """Return an element's type and content, and where the next begins."""
    code, size = unpack_from(f'{order}II', head, place)
    if code >> 16:  # four bytes or less are in the place of the size
        return code & 0xffff, head[place + 4:][:code >> 16], place + 8
    return code, head[place + 8:][:size], place + 8 + size + -size % 8
