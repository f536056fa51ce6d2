# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The unit of a member in a form that the compiled exchange can call.

Units of exactly these types have one; a unit in plain Python, or a subclass that may do
something else in its `step`, has none.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from antenna_drive.emulator.kernels import of_unit
from antenna_drive.emulator.unit import FloatArray, Unit
from antenna_drive.emulator.units import BlockUnit, inner_steps, SourceUnit
from antenna_drive.lockstep import partner
from antenna_drive.physics import signal_generator
from antenna_drive.physics.block import Block
import numpy as np
from simgap.laws.compiling import inner


class CompiledForm(NamedTuple):
    """What a compiled loop needs of a unit."""

    name: str  # tells the form from others
    advance: Any  # compiled (k, h, u, y, memory), one macro-step of h [s] from step k
    # gives the last argument, for a macro-step [s]; asked anew after each change
    memory: Callable[[float], tuple[Any, ...]]
    outputs: FloatArray  # y, value and time derivative in each row
    reached: Callable[[int], None]  # tells the unit that the loop has gone on to a step
    folder: Path  # of the sources that it is compiled from


@cache
def _advance_block(block: Block) -> Any:
    # The function that the unit calls itself: its physics is not compiled a second time.
    step = of_unit(block).step

    @inner
    def advance(k: int, h: float, u: FloatArray, y: FloatArray, memory: Any) -> None:
        p, x, mode, work, steps = memory
        step(x, mode, u, p, h, steps, work, y)

    return advance


@inner
def _advance_source(k: int, h: float, u: FloatArray, y: FloatArray, memory: Any) -> None:
    origins, record, bits, rows = memory
    signal_generator.sample(k + 1, 1, h, origins, record, bits, rows)


def _of_block(unit: Any) -> CompiledForm:
    record, x, mode, _, work, y = unit.memory()
    rates = unit.block.rates.function
    return CompiledForm(f'{rates.__module__}.{rates.__qualname__}', _advance_block(unit.block),
                        lambda step_s: (record, x, mode, work, inner_steps(step_s)), y,
                        lambda step: None, unit.block.folder)


def _of_source(unit: Any) -> CompiledForm:
    y = np.zeros((1, len(unit.outputs), 2))
    return CompiledForm(signal_generator.__name__, _advance_source,
                        lambda step_s: (*unit.memory(), y), y[0],
                        unit.reached, Path(signal_generator.__file__).resolve().parent)


@inner
def _advance_partner(k: int, h: float, u: FloatArray, y: FloatArray, memory: Any) -> None:
    # what it puts out is there already
    seen, = memory
    for row in range(u.shape[0]):
        seen[row, 0] = u[row, 0]
        seen[row, 1] = u[row, 1]


def _of_partner(unit: Any) -> CompiledForm:
    y, seen = unit.memory()
    return CompiledForm(partner.__name__, _advance_partner, lambda step_s: (seen,), y,
                        lambda step: None, Path(partner.__file__).resolve().parent)


# By exact type: a subclass may do something else in its step.
FORMS: dict[type[Unit], Callable[[Any], CompiledForm]] = {
    BlockUnit: _of_block, SourceUnit: _of_source, partner.PartnerUnit: _of_partner}


def form_of(unit: Unit) -> CompiledForm | None:
    """Return the compiled form of a unit, None if it has none."""
    make = FORMS.get(type(unit))
    return make(unit) if make else None
