# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The bare exchange as one compiled loop: the limit of the drive's own, in C's speed.

It takes one frame of each peer without looking at it and publishes a constant frame, with the
functions, the entities and the order of waiting of the drive's compiled exchange. There is no
physics, check, copy, pace, reading or report.
"""

from __future__ import annotations

from typing import Any, TYPE_CHECKING

from antenna_drive.lockstep.compiled_loop import Call, call_c, MESSAGE_WORDS
from antenna_drive.physics.compiling import compiled
from lab.bench.stamps import Stamps, WARM_STEPS
import numpy as np

if TYPE_CHECKING:
    from antenna_drive.lockstep.rcl_channel import RclChannel

_CLOCK_MONOTONIC = 1
_NEVER_NS = -1


@compiled
def _exchange(first: int, last: int, calls: Any, subscriptions: Any, words: Any, clock: Any,
              stamps: Any) -> None:
    publisher, wait_set, incoming, outgoing, clock_at = (
        words[0], words[1], words[2], words[3], words[4])
    for step in range(first, last + 1):
        for place in range(subscriptions.size):
            subscription = subscriptions[place]
            waited = False
            while call_c(calls[Call.take], (
                    subscription, incoming, np.int64(0), np.int64(0))) != 0:
                call_c(calls[Call.clear], (wait_set,))
                call_c(calls[Call.add_subscription], (wait_set, subscription, np.int64(0)))
                call_c(calls[Call.wait], (wait_set, np.int64(_NEVER_NS)))
                waited = True
            if waited:
                # the slowest first, as in the drive's own
                for earlier in range(place, 0, -1):
                    subscriptions[earlier] = subscriptions[earlier - 1]
                subscriptions[0] = subscription
        call_c(calls[Call.clock], (np.int64(_CLOCK_MONOTONIC), clock_at))
        stamps[step] = clock[0] + 1e-9 * clock[1]
        call_c(calls[Call.publish], (publisher, outgoing, np.int64(0)))


def compile_ahead() -> None:
    """Compile the loop now, or load it; it makes no step."""
    _exchange(1, 0, np.zeros(len(Call), np.int64), np.zeros(0, np.int64), np.zeros(5, np.int64),
              np.zeros(2, np.int64), np.zeros(1))


def exchange(last: int, frame: bytes, channel: RclChannel, stamps: Stamps) -> None:
    """Exchange frames up to step `last`, and note when each was made."""
    clock, times = np.zeros(2, np.int64), np.zeros(last + 1)
    content = np.frombuffer(frame, np.uint8)
    message = np.array([content.ctypes.data, content.size, content.size, *channel.allocator],
                       np.int64)
    assert message.size == MESSAGE_WORDS
    words = np.array([channel.publisher, channel.wait_set, channel.incoming.ctypes.data,
                      message.ctypes.data, clock.ctypes.data], np.int64)
    calls = np.array([channel.calls[name] for name in Call._fields], np.int64)
    subscriptions = np.array(list(channel.subscriptions.values()), np.int64)
    first = 1
    for until in (min(WARM_STEPS, last), last):
        _exchange(first, until, calls, subscriptions, words, clock, times)
        stamps.note_all(times, first, until)
        first = until + 1
