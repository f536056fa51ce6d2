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
The compiled steps that Python calls: of one unit, and of the whole drive, to the same bits.

A unit's record goes in as an array of one: numba looks anew at a single record in every call,
which takes several times as long as the step itself.
"""

from __future__ import annotations

from typing import Any

from antenna_drive.physics import motor_drive, structure, test_signal, torque_share
from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.compiling import compiled, inner


@inner
def _gather(now: FloatArray, columns: IntArray, u: FloatArray) -> None:
    for j in range(columns.size):
        u[j, 0] = now[columns[j], 0]
        u[j, 1] = now[columns[j], 1]


@inner
def _scatter(y: FloatArray, first: int, after: FloatArray) -> None:
    for j in range(y.shape[0]):
        after[first + j, 0] = y[j, 0]
        after[first + j, 1] = y[j, 1]


@compiled
def motor_step(x: FloatArray, mode: IntArray, u: FloatArray, p: Any, h: float, steps: int,
               work: FloatArray, y: FloatArray) -> None:
    """Advance a motor; arguments as those of `motor_drive.step`, its record in an array."""
    motor_drive.step(x, mode, u, p[0], h, steps, work, y)


@compiled
def share_step(x: FloatArray, mode: IntArray, u: FloatArray, p: Any, h: float, steps: int,
               work: FloatArray, y: FloatArray) -> None:
    """Advance the torque share; arguments as those of `torque_share.step`."""
    torque_share.step(x, mode, u, p[0], h, steps, work, y)


@compiled
def plant_step(x: FloatArray, mode: IntArray, u: FloatArray, p: Any, h: float, steps: int,
               work: FloatArray, y: FloatArray) -> None:
    """Advance the plant; arguments as those of `structure.step`."""
    structure.step(x, mode, u, p[0], h, steps, work, y)


@compiled
def sample_signals(first: int, count: int, h: float, origins: FloatArray, p: Any,
                   bits: FloatArray, y: FloatArray) -> None:
    """Sample the test signals; arguments as those of `test_signal.sample`."""
    test_signal.sample(first, count, h, origins, p[0], bits, y)


@compiled
def advance(
        k: int, h: float, steps: int, every: int, commands: FloatArray, now: FloatArray,
        after: FloatArray, kept: FloatArray, columns: tuple[IntArray, ...], firsts: IntArray,
        motor_1: Any, motor_2: Any, share: Any, plant: Any,
) -> None:
    """
    Advance the drive by one macro-step for each row of `commands`.

    Parameters
    ----------
    k
        number of the macro-step to begin with
    h, steps, every
        macro-step [s], inner steps in it, and which steps to keep
    commands
        test signals at each step's end, shape (count, 2, 2)
    now, after
        samples at the step's start and end, shape (signals, 2); now holds the last ones
    kept
        receives the kept samples
    columns
        rows of `now` that each of the four units reads, a tuple of index arrays
    firsts
        row of the first output of each of the five units
    motor_1, motor_2, share, plant
        each unit's record, states, mode, inputs, work, outputs

    """
    row = 0
    for i in range(commands.shape[0]):
        _scatter(commands[i], firsts[0], after)
        p, x, mode, u, work, y = motor_1
        _gather(now, columns[0], u)
        motor_drive.step(x, mode, u, p[0], h, steps, work, y)
        _scatter(y, firsts[1], after)
        p, x, mode, u, work, y = motor_2
        _gather(now, columns[1], u)
        motor_drive.step(x, mode, u, p[0], h, steps, work, y)
        _scatter(y, firsts[2], after)
        p_share, x, mode, u, work, y = share
        _gather(now, columns[2], u)
        torque_share.step(x, mode, u, p_share[0], h, steps, work, y)
        _scatter(y, firsts[3], after)
        p_plant, x, mode, u, work, y = plant
        _gather(now, columns[3], u)
        structure.step(x, mode, u, p_plant[0], h, steps, work, y)
        _scatter(y, firsts[4], after)
        _scatter(after, 0, now)
        if (k + i + 1) % every == 0:
            _scatter(now, 0, kept[row])
            row += 1
