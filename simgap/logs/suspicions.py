# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What looks wrong in a column of numbers: stuck, at a limit, or jumping as a register does."""

from collections.abc import Iterator, Mapping
import math
from typing import Any, NamedTuple

import numpy as np
from simgap.logs.channel import Channel, FloatArray

_FEW = 10         # distinct values of a command in steps, which may stand still and jump
_LONG = 20        # equal samples in a row that are no accident
_LIMITED = 0.01   # least share of samples at a limit
# Where a number may begin again: a turn in radians, degrees, turns, and powers of two.
_PERIODS = (2 * math.pi, 360.0, 1.0, *(2.0**bits for bits in range(8, 33)))


class Suspicion(NamedTuple):
    text: str
    entries: Mapping[str, float] = {}  # of a map, that mend it


def suspicions(channel: Channel) -> Iterator[Suspicion]:
    """Yield what looks wrong in the numbers of a channel, as they are written."""
    values, distinct = channel.values, np.unique(channel.values)
    if distinct.size == 1 and values.size >= _LONG:
        yield Suspicion(f'stands at {values[0]:.6g} all the time')
    if distinct.size < _FEW or values.size < _LONG:
        return
    first, last = _runs(np.diff(values) == 0.0)
    if first.size:
        longest = int(np.argmax(last - first))
        count = int(last[longest] - first[longest]) + 2
        if count >= _LONG and np.sum(last - first + 1) - count < 0.1 * (values.size - count):
            yield Suspicion(f'stuck at {values[first[longest]]:.6g} for {count} samples from '
                            f'{channel.time_s[first[longest]]:.6g} s on; it changes at all others')
            return
    for limit, word in ((distinct[-1], 'upper'), (distinct[0], 'lower')):
        first, last = _runs(values == limit)
        share = float(np.mean(values == limit))
        if share >= _LIMITED and np.max(last - first) >= 4 and distinct.size > 5 * _FEW:
            yield Suspicion(f'at its {word} limit {limit:.6g} for {share:.0%} of the samples')
    yield from _jumps(values, distinct)


def _runs(same: Any) -> tuple[Any, Any]:
    """Return first and last place of each run of true values."""
    edges = np.flatnonzero(np.diff(np.r_[0, same.astype(int), 0]))
    return edges[::2], edges[1::2] - 1


def _jumps(values: FloatArray, distinct: FloatArray) -> Iterator[Suspicion]:
    """Find jumps of one size in a number that is continuous otherwise: its coding makes them."""
    steps, span = np.abs(np.diff(values)), float(distinct[-1] - distinct[0])
    far = steps > 0.5 * span
    if not far.any() or np.max(steps[~far], initial=0.0) > 0.25 * span:
        return
    size, is_whole = float(np.mean(steps[far])), bool(np.all(np.mod(values, 1.0) == 0.0))
    bits = int(distinct[-1]).bit_length()
    if is_whole and distinct[0] >= 0.0 and bits >= 8:
        bit = 2 ** (bits - 1)
        low, high = distinct[distinct < bit], distinct[distinct >= bit] - bit
        if low.size and max(low[-1], high[-1]) < bit / 2:
            yield Suspicion(f'jumps by about {bit} where it changes sign: a register of {bits} '
                            'bits with its sign in the highest', {'sign_magnitude_bits': bits})
            return
    for period in _PERIODS if is_whole else _PERIODS[:3]:
        if span <= period * (1 + 1e-6) and abs(size - period) < 0.1 * period:
            yield Suspicion(f'jumps by about {period:.6g}, where it wraps around',
                            {'unwrap': period})
            return
