# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The frame: what one node tells the others about one macro-step, and its bytes on the wire.

A frame is a std_msgs/Float64MultiArray holding run, step, step_s, sender, then value and time
derivative of each output of the unit. Its layout names them, so that a frame can be read
without this package. Nothing here needs ROS.
"""

from collections.abc import Sequence
import math
import os
import secrets
import struct

from antenna_drive.emulator.unit import Signal
from antenna_drive.limits import FRAME

HEADER = ('run', 'step', 'step_s', 'sender')
SENDER = HEADER.index('sender')

# A sender is a whole number that a double can hold: drawn at random, but for the last bits, which
# are the number of its process (Linux has none greater), so that people find it.
_PROCESS_BITS = 22
_DRAWN_BITS = 30

# A frame with this run is a hello: "I am here and have no part in any run".
NO_RUN = 0.0

# Runs are microseconds of wall time; beyond this a double no longer tells them apart.
LARGEST_RUN = 2.0 ** 52

# A birth later than this leaves no room for the runs that follow.
LATEST_BIRTH = LARGEST_RUN - 2.0 ** 40

# In front of every message; behind it are the eight bytes of a Float64 or a Clock.
CDR_LITTLE_ENDIAN = b'\x00\x01\x00\x00'


class FrameLayout:
    """
    The length, labels and bytes of one unit's frames.

    length, label : how many numbers a frame has, and their names and units
    prefix : the bytes in front of the numbers
    packed_size : how many bytes `encode` packs behind the header
    """

    def __init__(self, signals: Sequence[Signal]) -> None:
        """Lay out frames that carry `signals`; none for an observer, which only says its step."""
        columns = [*HEADER]
        for signal in signals:
            columns.append(f'{signal.name} [{signal.unit}]')
            columns.append(f'd/dt {signal.name} [{signal.rate_unit}]')
        self.signals = tuple(signals)
        self.length = len(columns)
        self.label = ', '.join(columns)
        self.prefix = _cdr_prefix(self.label, self.length)
        self._data = struct.Struct(f'<{self.length}d')
        self._header = struct.Struct(f'<{len(HEADER)}d')
        self.packed_size = 16 * len(self.signals)
        self._size = len(self.prefix) + self._data.size

    def encode(self, run: float, step: int, step_s: float, sender: float,
               packed: bytes = b'') -> bytes:
        """
        Return the serialised message.

        run, step, step_s, sender : the run's id, the macro-step, its length [s], who sends it, see
            `new_sender`
        packed : value and time derivative of each signal, as little-endian doubles
        """
        return self.prefix + self._header.pack(run, step, step_s, sender) + packed

    def hello(self, birth: float, sender: float, ended: float = NO_RUN) -> bytes:
        """
        Return the serialised hello of a node born at `birth` [us of wall time].

        In the place of step_s a conductor names the run that has just ended.
        """
        return self.encode(NO_RUN, int(birth), ended, sender, bytes(self.packed_size))

    def decode(self, message: bytes) -> tuple[float, ...] | None:
        """Return the numbers of a message of exactly this layout, None for any other message."""
        if len(message) != self._size or not message.startswith(self.prefix):
            return None
        return self._data.unpack_from(message, len(self.prefix))


def new_sender() -> float:
    """Return an identity for a node of this process: no two nodes have the same."""
    return float(secrets.randbits(_DRAWN_BITS) << _PROCESS_BITS | os.getpid())


def process_of(sender: float) -> int:
    """Return the number of the process that a sender is."""
    return int(sender) % 2**_PROCESS_BITS


def two_of_one_name(name: str, senders: tuple[float, float]) -> str:
    """Say that two nodes of one name have sent frames of one run, and what to do."""
    first, second = map(process_of, senders)
    return (f'two nodes are called {name}, processes {first} and {second}; end one of them, or '
            'give each drive a namespace of its own')


def _cdr_prefix(label: str, length: int) -> bytes:
    # Common Data Representation (OMG DDSI-RTPS 9.4, XCDR version 1): everything before the doubles
    text = label.encode() + b'\0'
    body = struct.pack('<II', 1, len(text)) + text
    body += b'\0' * (-len(body) % 4)
    body += struct.pack('<IIII', length, length, 0, length)
    body += b'\0' * (-len(body) % 8)
    return CDR_LITTLE_ENDIAN + body


def read_foreign(message: bytes) -> tuple[float, ...]:
    """
    Return the numbers of a Float64MultiArray of any layout and byte order.

    ROS 2's own deserialisation writes a line to the log for each message that it cannot read, so
    anybody could fill a disk.

    Returns no number at all if it is no such message, or longer than any that is taken.
    """
    order = {b'\x00\x00': '>', b'\x00\x01': '<'}.get(message[:2])
    if order is None or len(message) > FRAME.value():
        return ()
    body, place = message[4:], 4
    try:
        for _ in range(*struct.unpack_from(f'{order}I', body)):
            (label,) = struct.unpack_from(f'{order}I', body, place)
            place += 4 + label
            place += -place % 4 + 8
        _, count = struct.unpack_from(f'{order}II', body, place)
        place += 8
        return struct.unpack_from(f'{order}{count}d', body, place + (-place % 8 if count else 0))
    except struct.error:
        return ()


def all_finite(numbers: Sequence[float]) -> bool:
    """Return whether no number is NaN or infinite."""
    # The sum is finite only if every term is; it may overflow though all terms are finite.
    return math.isfinite(sum(numbers)) or all(map(math.isfinite, numbers))
