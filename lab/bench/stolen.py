# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How much of the machine's time its host gave to others, while something was measured."""

from pathlib import Path
import time

import numpy as np

# proc_stat(5): user nice system idle iowait irq softirq steal
_STEAL, _COLUMNS = 7, 8
_PERIOD_S = 1.0


class Steal:
    """Notes the steal time of all cores about once a second."""

    def __init__(self) -> None:
        """Begin to note."""
        self._notes: list[tuple[float, int, int]] = []
        self._next_s = 0.0

    def note(self) -> None:
        """Note it if the last note is a second old; nothing where the system does not tell."""
        now = time.monotonic()
        if now < self._next_s:
            return
        self._next_s = now + _PERIOD_S
        try:
            line = Path('/proc/stat').read_text().partition('\n')[0]
        except OSError:
            return
        times = [int(word) for word in line.split()[1:1 + _COLUMNS]]
        if len(times) == _COLUMNS:
            self._notes.append((now, times[_STEAL], sum(times)))

    def share(self, begin: float, end: float) -> float:
        """Return the share of the cores' time from `begin` to `end` [s], NaN if unknown."""
        if len(self._notes) < 2:
            return float('nan')
        moments, stolen, total = np.array(self._notes).T
        took = np.diff(np.interp([begin, end], moments, total))[0]
        return float(np.diff(np.interp([begin, end], moments, stolen))[0] / took) if took else (
            float('nan'))
