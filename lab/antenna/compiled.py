# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Compile the real antenna's kernels and cache them on disk while their sources are unchanged.

numba's own cache checks only the file of the outermost function and would miss a change of an
equation in another file. The cache folder's name is therefore a hash of this package's sources.
"""

from collections.abc import Callable
import hashlib
import os
from pathlib import Path
import tempfile
from typing import Any, cast, TypeVar

import numba
from simgap.errors import UserError

Function = TypeVar('Function', bound=Callable[..., Any])


def _cache_folder() -> Path:
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob('*.py')):
        digest.update(source.name.encode() + b'\0' + source.read_bytes() + b'\0')
    home = os.environ.get('XDG_CACHE_HOME') or str(Path('~/.cache').expanduser())
    if not os.access(home if Path(home).exists() else Path(home).parent, os.W_OK):
        home = tempfile.gettempdir()
    return Path(home) / 'antenna_drive' / f'trial-{digest.hexdigest()[:16]}'


CACHE_FOLDER = _cache_folder()


def compiled(function: Function) -> Function:
    """
    Compile a function of numbers and arrays; a division by zero gives infinity.

    Where nothing is compiled, its call raises UserError: Python does not read fields of records.
    """
    if numba.config.DISABLE_JIT:
        return cast(Function, _refuse)
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(CACHE_FOLDER)
    try:
        kernel: Function = numba.njit(cache=True, error_model='numpy')(function)
    finally:
        numba.config.CACHE_DIR = before
    return kernel


def _refuse(*arguments: Any) -> None:
    raise UserError('NUMBA_DISABLE_JIT is set, and Python cannot read what the compiled antenna '
                    'reads: unset it')


def inner(function: Function) -> Function:
    """Compile a function that only compiled functions call: it becomes a part of each."""
    kernel: Function = numba.njit(forceinline=True, error_model='numpy', _nrt=False)(function)
    return kernel
