# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The shadow: an emulator that is fed piece by piece."""

from antenna_drive.emulator.run import simulate
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import changed
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.twin.shadow import AHEAD, Shadow
import numpy as np
import pytest


@pytest.mark.parametrize('piece', [1, 7, 100])
def test_shadow_of_an_emulated_drive_is_that_drive(piece: int) -> None:
    drive = changed(load(), {'test_signal.rate.waveform': 'square',
                             'test_signal.rate.amplitude': 0.001,
                             'test_signal.rate.period': 0.9})
    run = simulate(drive, 2.0)
    stamps, values = (run.time * 1e9).round().astype(np.int64), run[RATE_COMMAND]
    shadow = Shadow(load())
    grids, samples = [], []
    for first in range(0, len(stamps), piece):
        grid, found = shadow.advance(stamps[first:first + piece], values[first:first + piece])
        grids.append(grid)
        samples.append(found)
    grid, found = np.concatenate(grids), np.concatenate(samples)
    assert np.array_equal(grid, stamps[1:len(stamps) - AHEAD + 1])
    for name in ('motor_1/ammeter', 'plant/encoder', 'torque_share/bias_voltage'):
        column = shadow.names.index(name)
        assert found[:, column, 0] == pytest.approx(run[name][1:len(grid) + 1], abs=1e-12)


def test_shadow_begins_anew_after_a_restart() -> None:
    shadow = Shadow(load())
    stamps = np.arange(0, 10**9, 10**7)
    _, first = shadow.advance(stamps, np.full(100, 1e-4))
    shadow.restart()
    grid, second = shadow.advance(stamps + 5 * 10**9, np.full(100, 1e-4))
    assert np.array_equal(first, second)
    assert grid[0] == 5 * 10**9 + 10**6
