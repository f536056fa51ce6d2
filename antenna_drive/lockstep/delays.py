# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How long something takes that happens at every step: percentiles of any number of delays."""

import math

from antenna_drive.physics.arrays import IntArray
import numpy as np
from simgap.laws.compiling import inner

# The first bin holds everything up to this [s]; the next ones a sixteenth of an octave each.
_SHORTEST_S = 1e-6
_PER_OCTAVE = 16

# The last bin begins at four minutes.
_BINS = 28 * _PER_OCTAVE

PERCENTILES = (50.0, 99.0, 99.9)


def empty_counts() -> IntArray:
    """Return the counts of no delays, shape (bins,)."""
    return np.zeros(_BINS, np.int64)


@inner
def count(counts: IntArray, delay_s: float) -> None:
    """Count a delay [s] in its bin."""
    place = 0
    if delay_s > _SHORTEST_S:
        place = min(1 + int(_PER_OCTAVE * math.log2(delay_s / _SHORTEST_S)), _BINS - 1)
    counts[place] += 1


class Delays:
    """
    Counts delays, in Python or in a compiled loop that is given `counts`.

    Percentiles are exact to the width of a bin, 4.4 percent.

    counts : how many delays each bin holds, shape (bins,)
    """

    def __init__(self) -> None:
        self.counts = empty_counts()

    def clear(self) -> None:
        """Forget all."""
        self.counts[:] = 0

    def note(self, delay_s: float) -> None:
        """Count a delay [s]."""
        _count(self.counts, delay_s)

    def __str__(self) -> str:
        """Return the percentiles in ms, '' without delays."""
        return ', '.join(f'p{percent:g} {1e3 * value:.3g} ms'
                         for percent, value in zip(PERCENTILES, self.percentiles()))

    def percentiles(self) -> list[float]:
        """Return the upper ends of the bins that hold `PERCENTILES` [s], none without delays."""
        totals = np.cumsum(self.counts)
        if not totals[-1]:
            return []
        wanted = np.ceil(np.array(PERCENTILES) / 100.0 * totals[-1])
        places = np.searchsorted(totals, wanted)
        return (_SHORTEST_S * 2.0 ** (places / _PER_OCTAVE)).tolist()

    def values(self, what: str) -> list[tuple[str, str]]:
        """Return what /diagnostics says of them; `what` takes so long."""
        return [(f'{what} p{percent:g} [ms]', f'{1e3 * delay_s:.3g}')
                for percent, delay_s in zip(PERCENTILES, self.percentiles())]


# In Python a call of compiled code takes longer than the sum itself.
_count = count.function  # type: ignore[attr-defined]
