# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The compiled loops that Python calls, made from the wiring: of one unit, and of the whole drive.

A unit's record goes in as an array of one: numba looks anew at a single record in every call,
which takes several times as long as the step itself.
"""

from functools import cache
from pathlib import Path
from typing import Any

from antenna_drive.emulator.wiring import Wiring
from antenna_drive.physics.block import Block
from antenna_drive.physics.compiling import generated

_UNIT = """
@compiled
def start(p, x, mode, u, y):
    x[:] = 0.0
    mode[:] = 0
    u[:] = 0.0
    y[:] = 0.0
    begin(p[0], x, mode)
    read(x, mode, u, 0.0, p[0], y)


@compiled
def step(x, mode, u, p, h, steps, work, y):
    advance(x, mode, u, p[0], h, steps, work, y)
"""

_DRIVE = """
@inner
def copy(source, i, target, j, count):
    for n in range(count):
        target[j + n, 0] = source[i + n, 0]
        target[j + n, 1] = source[i + n, 1]


@compiled
def advance(k, h, steps, every, commands, now, after, kept, units):
    {memories}, = units
    {unpacked}
    row = 0
    for i in range(commands.shape[0]):
        copy(commands[i], 0, after, {command}, {commands})
        {steps}
        copy(after, 0, now, 0, {signals})
        if (k + i + 1) % every == 0:
            copy(now, 0, kept[row], 0, {signals})
            row += 1
"""


@cache
def of_unit(block: Block) -> Any:
    """
    Return the compiled `start` and `step` of a unit, for its node.

    start(p, x, mode, u, y) writes the initial states and outputs; step(x, mode, u, p, h, steps,
    work, y) advances by a macro-step of h [s] in inner steps. p is an array of one record, u and
    y have value and time derivative in each row, work is from `integrator.work_space`.
    """
    return generated('unit', _UNIT, {'begin': block.start, 'read': block.read,
                                     'advance': block.step}, frozenset({block.folder}))


@cache
def of_drive(wiring: Wiring) -> Any:
    """
    Return the compiled `advance` of a whole drive, which gives the bits of single steps.

    advance(k, h, steps, every, commands, now, after, kept, units) goes on from macro-step k by one
    of h [s], in inner steps, for each row of `commands`: the source's outputs at the step's end,
    shape (count, outputs, 2). now and after are samples of shape (signals, 2), of which now
    holds the last; kept receives the samples of each step that `every` divides; units are the
    memories of all blocks, see `units.BlockUnit`.
    """
    place = {signal: row for row, signal in enumerate(wiring.signals)}
    first = {name: place[f'{name}/{outputs[0].name}'] for name, outputs in wiring.outputs.items()}
    names = blocks(wiring)
    steps = []
    for name, block in names.items():
        steps += [f'copy(now, {place[source]}, u_{name}, {j}, 1)  # {source}'
                  for j, source in enumerate(wiring.units[name].sources)]
        steps += [f'advance_{name}(x_{name}, mode_{name}, u_{name}, p_{name}[0], h, steps,'
                  f' work_{name}, y_{name})',
                  f'copy(y_{name}, 0, after, {first[name]}, {len(block.outputs)})']
    parts = ('p', 'x', 'mode', 'u', 'work', 'y')
    (source,) = wiring.units.keys() - names.keys()
    text = _DRIVE.format(
        memories=', '.join(names), signals=len(place), command=first[source],
        commands=len(wiring.outputs[source]), steps='\n        '.join(steps),
        unpacked='\n    '.join(
            f'{", ".join(f"{part}_{name}" for part in parts)} = {name}' for name in names))
    return generated('drive', text, {f'advance_{name}': block.step
                                     for name, block in names.items()}, folders(wiring))


def blocks(wiring: Wiring) -> dict[str, Block]:
    """Return the compiled units of a wiring by name."""
    return {name: unit.interface for name, unit in wiring.units.items()
            if isinstance(unit.interface, Block)}


def folders(wiring: Wiring) -> frozenset[Path]:
    """Return the folders whose sources the compiled units are made from."""
    return frozenset(block.folder for block in blocks(wiring).values())
