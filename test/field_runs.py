# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Field recordings that the emulator makes: macro-steps, not the integration of the diagnosis."""

from __future__ import annotations

from typing import Any

from antenna_drive.emulator.run import MACRO_STEP, simulate
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import TestSheet
import numpy as np

NOISE = (0.01, 0.01, 0.0035, 0.0035, 1e-6, 0.01)
SLOW_SQUARE: dict[str, Any] = {'waveform': 'square', 'amplitude': 8.7e-4, 'period': 6.3}
FAST_TRIANGLE: dict[str, Any] = {'waveform': 'saw_tooth', 'amplitude': 8e-3, 'period': 6.0}


def field_run(drive: Drive, duration: float, sheet: TestSheet | None = None, every: int = 5,
              noise: float = 1.0, changes: Any = None, **signal: Any) -> Recording:
    """Return a run with a test signal as a crew records it, with some times the usual noise."""
    drive = changed(drive, {f'test_signal.rate.{name}': value for name, value in signal.items()})
    run = simulate(drive, duration, MACRO_STEP, changes, every)
    random = np.random.default_rng(0)
    signals = {RATE_COMMAND: run[RATE_COMMAND]}
    for name, level in zip(SIGNALS, NOISE, strict=True):
        signals[name] = run[name] + noise * level * random.normal(size=run.time.size)
    return Recording.from_arrays(run.time, signals, sheet=sheet or TestSheet())
