# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A channel in memory for the compiled exchange: C functions that a test has written."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
import ctypes
import struct
from typing import Any

from antenna_drive.lockstep.compiled_loop import MESSAGE_WORDS
from antenna_drive.lockstep.frame import FrameLayout
import numpy as np

Frame = tuple[float, ...]

_NOTHING_TAKEN = 401  # rcl's own number for it
_OTHER_LAYOUT = b'some other layout of frames'
_PUBLISHER, _GUARD, _WAIT_SET, _FIRST_SUBSCRIPTION = 1, 2, 3, 10


class MemoryChannel:
    """
    Gives a loop what is in `arrived`, and what the loop publishes to a function.

    Attributes
    ----------
    arrived : the frames of each peer that wait to be taken
    waits : how often the loop has waited
    readings : row, scale and publisher of each reading
    read_out : publisher and message of every reading that the loop has published

    """

    def __init__(self, layout: FrameLayout, layouts: Mapping[str, FrameLayout],
                 publish: Callable[[Frame], None],
                 readings: Sequence[tuple[int, float, int]] = ()) -> None:
        self._layout = layout
        self._layouts = dict(layouts)
        self._publish = publish
        self.arrived: dict[str, deque[Frame]] = {peer: deque() for peer in layouts}
        self.subscriptions: Mapping[str, int] = {
            peer: _FIRST_SUBSCRIPTION + row for row, peer in enumerate(layouts)}
        self.publisher, self.guard, self.wait_set = _PUBLISHER, _GUARD, _WAIT_SET
        self.allocator: Sequence[int] = (0,) * 5
        self.readings = readings
        self.read_out: list[tuple[int, bytes]] = []
        self.incoming = np.zeros(MESSAGE_WORDS, np.int64)
        self.waits = 0
        library = ctypes.CDLL(None)
        self._functions: dict[str, Any] = {
            name: ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_int64] * words)(function)
            for name, words, function in (
                ('take', 4, self._take), ('publish', 3, self._published),
                ('clear', 1, self._ready), ('add_subscription', 3, self._ready),
                ('add_guard', 3, self._ready), ('wait', 2, self._wait))}
        self._functions |= {'copy': library.memcpy, 'compare': library.memcmp,
                            'clock': library.clock_gettime}
        self.calls: Mapping[str, int] = {
            name: ctypes.cast(function, ctypes.c_void_p).value or 0
            for name, function in self._functions.items()}

    def _take(self, subscription: int, message: int, *others: int) -> int:
        assert message == self.incoming.ctypes.data
        peer = list(self.subscriptions)[subscription - _FIRST_SUBSCRIPTION]
        if not self.arrived[peer]:
            return _NOTHING_TAKEN
        frame = self.arrived[peer].popleft()
        content = struct.pack(f'<{len(frame)}d', *frame)
        whole = len(frame) == self._layouts[peer].length
        self._bytes = (self._layouts[peer].prefix if whole else _OTHER_LAYOUT) + content
        self._buffer = ctypes.create_string_buffer(self._bytes, len(self._bytes))
        self.incoming[:3] = ctypes.addressof(self._buffer), *[len(self._bytes)] * 2
        return 0

    def _published(self, publisher: int, message: int, *others: int) -> int:
        content = ctypes.string_at(*_words(message, 2))
        if publisher != _PUBLISHER:
            self.read_out.append((publisher, content))
            return 0
        frame = self._layout.decode(content)
        assert frame is not None
        self._publish(frame)
        return 0

    def _ready(self, *words: int) -> int:
        return 0

    def _wait(self, *words: int) -> int:
        self.waits += 1
        return 0

    def read(self, message: bytes) -> Frame:
        """Return the numbers of a message of another layout."""
        numbers = message.removeprefix(_OTHER_LAYOUT)
        return struct.unpack(f'<{len(numbers) // 8}d', numbers)

    def trim(self) -> None:
        """Give nothing back."""


def _words(address: int, count: int) -> list[int]:
    return list((ctypes.c_int64 * count).from_address(address))
