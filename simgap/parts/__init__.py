# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Ready parts of real drives for a simulation of your own, compiled.

Write the loop over time as a function of plain numbers and arrays, put `compiled` over it, and
call the parts in it:

>>> from simgap.parts import compiled, friction
>>> @compiled
... def coasting(rate, step, count):
...     for _ in range(count):
...         rate = friction.rate_after(step, rate, 0.0, 0.2, 0.0, 1.0)
...     return rate
>>> round(coasting(1.0, 0.01, 100), 6)
0.8

Each part is a function of numbers in SI units; those with many take them in a named tuple of
floats, whose annotations are its units.
"""

from collections.abc import Callable
import inspect
from pathlib import Path
from typing import Any, TypeVar

from simgap.laws.compiling import inner, Keeping
from simgap.parts import coupling, friction, loop, sensor, shaping
from simgap.parts.ripple import harmonics, wave

__all__ = ['compiled', 'coupling', 'friction', 'harmonics', 'inner', 'loop', 'sensor', 'shaping',
           'wave']

_KEEPING = Keeping('simgap', frozenset({Path(__file__).resolve().parent}))
_Function = TypeVar('_Function', bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """
    Compile a function that Python calls and that may call parts and `inner` functions.

    It may use numbers, arrays, tuples and `math`. It is kept on disk until a source changes.
    """
    file = Path(inspect.getfile(function)).resolve()
    # typed in by hand: there is no folder to watch, and nothing is kept
    return _KEEPING.compiled_with(function, file.parent if file.is_file() else file)
