# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How functions are compiled: once for this machine, kept on disk until any of their sources changes.

numba's own disk cache looks only at the file of the function that it keeps, so the cache folder is
named after a digest of every source that compiled code is made from. A function is compiled, and
numba itself is loaded, when it is first called: a program that only reads a recording does not
wait for a compiler. Without numba the functions run slowly, with the same numbers.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property, partial
import hashlib
import os
from pathlib import Path
import sys
import tempfile
from types import ModuleType
from typing import Any, cast, TypeVar

Function = TypeVar('Function', bound=Callable[..., Any])

# A zero divisor gives infinity, as in C, and the check for it stays out of the inner loops.
# Compiled code allocates nothing, and so need not count who holds an array.
# nogil: runs of several variants of a drive share the cores, see emulator/batch.py
_OPTIONS: dict[str, Any] = {'error_model': 'numpy', '_nrt': False, 'nogil': True}

_LAWS = Path(__file__).resolve().parent


class Compiled:
    """A function that is compiled when it is first called, by Python or by compiled code."""

    def __init__(self, function: Callable[..., Any], keep: Callable[[], Path | None] | None = None,
                 **options: Any) -> None:
        """Take the function, numba's options, and what names the folder to keep the result in."""
        self.function = function
        self._keep = keep
        self._options = options

    @cached_property
    def dispatcher(self) -> Any:
        """Return numba's own object for the function, or the function itself without numba."""
        try:
            import numba
        except ModuleNotFoundError:
            return self.function
        _teach_numba()
        folder = self._keep() if self._keep else None
        before = numba.config.CACHE_DIR
        if folder:
            numba.config.CACHE_DIR = str(folder)
        try:
            dispatcher = numba.njit(cache=folder is not None, **{**_OPTIONS, **self._options})(
                self.function)
            if folder and not numba.config.DISABLE_JIT:
                _forgive(dispatcher._cache, folder)
            return dispatcher
        finally:
            numba.config.CACHE_DIR = before

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*arguments)


def _forgive(kept: Any, folder: Path) -> None:
    """Let numba's cache of a function miss what cannot be read or written."""
    def tried(act: Callable[..., Any], *key: Any) -> Any:
        try:
            return act(*key)
        except Exception as error:  # noqa: B902 (whatever a damaged file makes pickle raise)
            _say(folder, getattr(error, 'strerror', None) or 'a file is damaged')
            with suppress(OSError):
                kept.flush()  # what is saved next replaces it

    kept.load_overload = partial(tried, kept.load_overload)
    kept.save_overload = partial(tried, kept.save_overload)


@cache
def _say(folder: Path, why: str) -> None:
    print(f'{folder}: compiled code is compiled again, {why}', file=sys.stderr)


@cache
def _teach_numba() -> None:
    """Tell numba what compiled code finds in place of a function that it calls."""
    from numba import types
    from numba.extending import typeof_impl
    typeof_impl.register(Compiled)(lambda value, context: types.Dispatcher(value.dispatcher))


def inner(function: Function) -> Function:
    """Compile a function that only compiled functions call: it becomes a part of each."""
    return cast(Function, Compiled(function, forceinline=True))


def shared(function: Function) -> Function:
    """Compile a larger function that compiled functions call: they share one copy of it."""
    return cast(Function, Compiled(function))


@dataclass(frozen=True)
class Keeping:
    """How a package keeps what it compiles."""

    owner: str  # name of its folder in the user's cache
    sources: frozenset[Path]  # folders its functions are compiled with, beside the laws

    def compiled(self, function: Function) -> Function:
        """Compile a function that Python calls, and keep the result on disk."""
        return cast(Function, Compiled(function, self.folder))

    def compiled_with(self, function: Function, source: Path) -> Function:
        """Compile a user's function for Python, kept until a source in the folder changes."""
        keeping = Keeping(self.owner, self.sources | {source})
        return cast(Function, Compiled(function, keeping.folder, _nrt=True))

    def folder(self, text: str = '') -> Path | None:
        """Return the folder for these sources and a text, or None where nothing can be kept."""
        return _cache_folder(self.owner, self.sources, text)


def generated(keeping: Keeping, name: str, text: str, names: Mapping[str, Any]) -> Any:
    """Return the module of a text of functions that refers to `names`, kept on disk compiled."""
    digest = _digest(keeping.sources, text)
    module = ModuleType(f'{keeping.owner}.generated.{name}_{digest}')
    sys.modules[module.__name__] = module  # where numba looks for it when it loads what it kept
    folder = keeping.folder(text)
    path = folder / f'{name}.py' if folder else Path(name)
    if folder and not path.exists():
        try:
            with tempfile.NamedTemporaryFile('w', dir=folder, delete=False) as file:
                file.write(text)
            # numba compares the time of a source: it must not depend on which process wrote it
            os.utime(file.name, (0, 0))
            os.replace(file.name, path)
        except OSError as error:
            _say(folder, error.strerror or 'it cannot be written')
            folder = None
    vars(module).update(names, inner=inner, shared=shared,
                        compiled=lambda function: Compiled(function, lambda: folder))
    exec(compile(text, str(path), 'exec'), vars(module))
    return module


@cache
def _cache_folder(owner: str, sources: frozenset[Path], text: str) -> Path | None:
    if not all(source.is_dir() for source in sources):
        return None  # typed in by hand: nobody can tell when it changes
    for root in _candidate_roots():
        folder = root / owner / _digest(sources, text)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return None


def _candidate_roots() -> list[Path]:
    from numba import config
    if config.CACHE_DIR:
        return [Path(config.CACHE_DIR)]
    cache_home = os.environ.get('XDG_CACHE_HOME')
    roots = [Path(cache_home)] if cache_home else []
    try:
        roots.append(Path.home() / '.cache')
    except RuntimeError:  # no home folder is known
        pass
    return [*roots, Path(tempfile.gettempdir())]


def _digest(sources: frozenset[Path], text: str) -> str:
    return hashlib.sha256(f'{_sources_digest(sources)}\n{text}'.encode()).hexdigest()[:16]


@cache
def _sources_digest(sources: frozenset[Path]) -> str:
    # a parameter that comes or goes changes the type of a record, and numba looks at types
    import numba
    digest = hashlib.sha256(numba.__version__.encode())
    for folder in sorted({_LAWS, *sources}):
        for source in sorted(folder.glob('*.py')):
            digest.update(source.name.encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()
