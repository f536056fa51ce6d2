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
Ready parts of real drives for a simulation of your own, compiled.

Write the loop over time as a function of plain numbers and arrays, put `compiled` over it, and
call the parts in it:

>>> from antenna_drive.parts import compiled, friction
>>> @compiled
... def coasting(rate, step, count):
...     for _ in range(count):
...         rate = friction.rate_after(step, rate, 0.0, 0.2, 0.0, 1.0)
...     return rate
>>> round(coasting(1.0, 0.01, 100), 6)
0.8

Numbers are in SI units. Each part is a function of numbers; those with many take them in a named
tuple of floats, whose annotations are its units.
"""

from __future__ import annotations

from collections.abc import Callable
import inspect
from pathlib import Path
from typing import Any, TypeVar

from antenna_drive.parts import coupling, friction, loop, sensor, shaping
from antenna_drive.parts.ripple import harmonics, wave
from antenna_drive.physics.compiling import compiled_with, inner

__all__ = ['compiled', 'coupling', 'friction', 'harmonics', 'inner', 'loop', 'sensor', 'shaping',
           'wave']

_PARTS = Path(__file__).resolve().parent
_Function = TypeVar('_Function', bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """
    Compile a function that Python calls and that may call parts.

    The result is kept on disk until a part or a file beside the function's own changes. Inside
    the function, numbers, arrays, tuples, `math` and what is compiled with `inner` can be used.
    """
    file = Path(inspect.getfile(function)).resolve()
    # typed in by hand: there is no folder to watch, and nothing is kept
    return compiled_with(function, frozenset({_PARTS, file.parent if file.is_file() else file}))
