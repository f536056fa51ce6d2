# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with what a real drive sends: nothing comes, or too much of it is rubbish."""

from collections import deque
import math

from antenna_drive.twin.intake import Intake

# Input is bad if more than this share of a signal's samples of the last blocks was rubbish.
_RUBBISH_SHARE = 0.02
_RUBBISH_BLOCKS = 10


class InputFaults:
    """
    Watches the counts of an intake.

    stale : whether no sample has come for so long that the real drive has stopped
    """

    def __init__(self, intake: Intake, stale_s: float) -> None:
        """Watch an intake; without new samples for `stale_s`, the real drive has stopped [s]."""
        self._intake, self._stale_s = intake, stale_s
        self._last_put: tuple[int, float] = (0, -math.inf)
        self._before: deque[tuple[dict[str, int], dict[str, int]]] = deque(
            maxlen=_RUBBISH_BLOCKS)
        self.stale = False

    def look(self, now_s: float) -> None:
        """Look whether samples come, by the time of any steady clock [s]."""
        count = sum(self._intake.accepted.values())
        if count != self._last_put[0]:
            self._last_put = (count, now_s)
        self.stale = bool(count) and now_s - self._last_put[1] > self._stale_s

    def end_block(self) -> None:
        """Note the counts at the end of a block."""
        self._before.append((self._rubbish(), dict(self._intake.accepted)))

    def _rubbish(self) -> dict[str, int]:
        counts: dict[str, int] = {}
        for (name, _), count in self._intake.rubbish.items():
            counts[name] = counts.get(name, 0) + count
        return counts

    def found(self) -> dict[str, str]:
        """Return the signals of which too much was rubbish lately, and what it was."""
        found: dict[str, str] = {}
        if self._before:
            before, accepted = self._before[0]
            for name, count in self._rubbish().items():
                new = count - before.get(name, 0)
                good = self._intake.accepted[name] - accepted.get(name, 0)
                if new > max(_RUBBISH_SHARE * good, 3):
                    kinds = [kind for key, kind in self._intake.rubbish if key == name]
                    found[name] = f'{new} samples {" or ".join(kinds)}'
        return found
