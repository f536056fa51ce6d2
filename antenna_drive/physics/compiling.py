# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
How the physics is compiled: once for this machine, kept on disk until any of its sources changes.

numba's own disk cache looks only at the file of the function that it keeps, and so a stale
kernel would survive the mending of a block in another file. The cache folder is therefore
named after a digest of every source that compiled code is made from.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
import hashlib
import os
from pathlib import Path
import tempfile
from typing import Any, TypeVar

import numba
from numba import config, njit

Function = TypeVar('Function', bound=Callable[..., Any])

# A zero divisor gives infinity, as in C, and the check for it stays out of the inner loops.
# Compiled code allocates nothing, and so need not count who holds an array.
# nogil: runs of several variants of a drive share the cores, see emulator/batch.py
_OPTIONS: dict[str, Any] = {'error_model': 'numpy', '_nrt': False, 'nogil': True}


def inner(function: Function) -> Function:
    """Compile a function that only compiled functions call: it becomes a part of each."""
    return njit(forceinline=True, **_OPTIONS)(function)  # type: ignore[no-any-return]


def shared(function: Function) -> Function:
    """Compile a larger function that compiled functions call: they share one copy of it."""
    return njit(**_OPTIONS)(function)  # type: ignore[no-any-return]


def compiled(function: Function) -> Function:
    """Compile a function that Python calls, and keep the result on disk."""
    folder = _cache_folder()
    if folder is None:
        return njit(**_OPTIONS)(function)  # type: ignore[no-any-return]
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    try:
        return njit(cache=True, **_OPTIONS)(function)  # type: ignore[no-any-return]
    finally:
        config.CACHE_DIR = before


@cache
def _cache_folder() -> Path | None:
    """Return the folder for this version of the physics, or None where nothing can be written."""
    for root in _candidate_roots():
        folder = root / 'antenna_drive' / _sources_digest()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return None


def _candidate_roots() -> list[Path]:
    if config.CACHE_DIR:
        return [Path(config.CACHE_DIR)]
    cache_home = os.environ.get('XDG_CACHE_HOME')
    roots = [Path(cache_home)] if cache_home else []
    try:
        roots.append(Path.home() / '.cache')
    except RuntimeError:  # no home folder is known
        pass
    return [*roots, Path(tempfile.gettempdir())]


def _sources_digest() -> str:
    # a parameter that comes or goes changes the type of a record, and numba looks at types
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).resolve().parent.glob('*.py')):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
