# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
rcl's C functions for the compiled exchange, where they are as expected.

rclpy makes and owns every entity. Here its addresses are read, and the entities are kept from
being destroyed until `close`. Nothing is compiled against ROS 2: before the first use the
functions are looked up in the libraries that rclpy has loaded, the layout of a message is
checked, and a frame is sent to ourselves and back. Whatever is not as expected is `Unusable`.
"""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
import ctypes
from pathlib import Path
import struct
import sys
import time
from typing import Any

from antenna_drive.lockstep.compiled_loop import MESSAGE_WORDS
from antenna_drive.lockstep.frame import FrameLayout, read_foreign
from antenna_drive.lockstep.readings import Readings
from antenna_drive.lockstep.ros_link import FRAME_QOS, FrameLink, unserved
import numpy as np
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

# C functions by the names of `compiled_loop.Call`; the rest are those of the C library.
_RCL = {
    'take': 'rcl_take_serialized_message',
    'publish': 'rcl_publish_serialized_message',
    'clear': 'rcl_wait_set_clear',
    'add_subscription': 'rcl_wait_set_add_subscription',
    'add_guard': 'rcl_wait_set_add_guard_condition',
    'wait': 'rcl_wait',
}
_C = {'copy': 'memcpy', 'compare': 'memcmp', 'clock': 'clock_gettime'}

# How many bytes a message may have before its memory is given back: ours have a few hundred.
_SPACE = 4096

# How long a frame may take to ourselves and back [s]; it takes some milliseconds.
_LOOPBACK_PATIENCE_S = 1.0


class Unusable(Exception):
    """The compiled exchange cannot be used here; the message says why."""


_ALLOCATOR = ('allocate', 'deallocate', 'reallocate', 'zero_allocate', 'state')


class _Allocator(ctypes.Structure):
    """Mirrors rcutils_allocator_t."""

    _fields_ = [(name, ctypes.c_void_p) for name in _ALLOCATOR]


class RclChannel:
    """A node's frames and readings as rcl's C functions carry them; see `exchange.Channel`."""

    def __init__(self, node: Node, link: FrameLink, readings: Readings) -> None:
        """Look everything up for a node's frames and readings, and check it; or Unusable."""
        _check_platform()
        rcl, rcutils, libc = _loaded('rcl'), _loaded('rcutils'), ctypes.CDLL(None)
        self.calls: Mapping[str, int] = {
            **{name: _address(rcl, symbol) for name, symbol in _RCL.items()},
            **{name: _address(libc, symbol) for name, symbol in _C.items()}}
        self.read = read_foreign
        self._initialise = _function(
            rcutils, 'rcutils_uint8_array_init', ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)
        self._finish = _function(rcutils, 'rcutils_uint8_array_fini', ctypes.c_void_p)
        default_allocator = _function(rcutils, 'rcutils_get_default_allocator')
        default_allocator.restype = _Allocator
        self._allocator = default_allocator()
        self.allocator: Sequence[int] = [
            getattr(self._allocator, name) or 0 for name in _ALLOCATOR]
        self.incoming = np.zeros(MESSAGE_WORDS, np.int64)
        self._entities = ExitStack()
        try:
            self._check_message()
            self._keep(node, link, readings.routes())
            self._check_loopback(node)
        except BaseException:
            self.close()
            raise

    def _check_message(self) -> None:
        """Have rcutils fill in a message: every word must be where it is expected."""
        self._make_space()
        address, size, capacity, *allocator = self.incoming.tolist()
        if not address or size != 0 or capacity != _SPACE or allocator != list(self.allocator):
            self.incoming[:] = 0
            raise Unusable('a serialised message has another layout')

    def _make_space(self) -> None:
        self.incoming[:] = 0
        if self._initialise(self.incoming.ctypes.data, _SPACE, ctypes.addressof(self._allocator)):
            raise Unusable('a serialised message cannot be made')

    def trim(self) -> None:
        """Give back the memory of a message larger than any of ours."""
        if self.incoming[2] > _SPACE:
            self._finish(self.incoming.ctypes.data)
            self._make_space()

    def _keep(self, node: Node, link: FrameLink, routes: list[tuple[int, float, Any]]) -> None:
        context = node.context.handle
        assert context is not None
        wait_set = _rclpy.WaitSet(1, 1, 0, 0, 0, 0, context)
        publisher, guard, subscriptions = link.handles()
        # rclpy destroys an entity only when nobody has entered it
        for handle in (context, wait_set, publisher, guard, *subscriptions.values(),
                       *(handle for _, _, handle in routes)):
            self._entities.enter_context(handle)
        self.publisher: int = publisher.pointer
        self.guard: int = guard.pointer
        self.wait_set: int = wait_set.pointer
        self.subscriptions: Mapping[str, int] = {
            peer: handle.pointer for peer, handle in subscriptions.items()}
        self.readings: Sequence[tuple[int, float, int]] = [
            (row, scale, handle.pointer) for row, scale, handle in routes]

    def _check_loopback(self, node: Node) -> None:
        """Send a frame to ourselves, with the functions that will carry all others."""
        topic = f'{node.get_name()}/_exchange_check'
        publisher = node.create_publisher(Float64MultiArray, topic, FRAME_QOS)
        subscription = unserved(node, Float64MultiArray, topic, FRAME_QOS, raw=True)
        try:
            frame = FrameLayout(()).encode(1.0, 2, 3.0, 4.0)
            with publisher.handle, subscription.handle:
                if self._round_trip(publisher.handle.pointer, subscription.handle.pointer,
                                    frame) != frame:
                    raise Unusable('a frame sent to ourselves did not come back')
        finally:
            node.destroy_subscription(subscription)
            node.destroy_publisher(publisher)

    def _round_trip(self, publisher: int, subscription: int, frame: bytes) -> bytes:
        content = np.frombuffer(frame, np.uint8)
        message = np.array([content.ctypes.data, content.size, content.size, *self.allocator],
                           np.int64)
        incoming = self.incoming.ctypes.data
        if self._call('publish', publisher, message.ctypes.data, 0):
            return b''
        end = time.monotonic() + _LOOPBACK_PATIENCE_S
        while self._call('take', subscription, incoming, 0, 0):
            left = end - time.monotonic()
            if left <= 0.0:
                return b''
            self._call('clear', self.wait_set)
            self._call('add_subscription', self.wait_set, subscription, 0)
            self._call('wait', self.wait_set, int(1e9 * left))
        return ctypes.string_at(*self.incoming[:2].tolist())

    def _call(self, name: str, *words: int) -> int:
        kind = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_int64] * len(words))
        return int(kind(self.calls[name])(*words))

    def close(self) -> None:
        """Let the entities go; nothing here may be called afterwards."""
        self._entities.close()
        if self.incoming[0]:
            self._finish(self.incoming.ctypes.data)
            self.incoming[:] = 0


def _check_platform() -> None:
    if not sys.platform.startswith('linux'):
        raise Unusable(f'{sys.platform} is not Linux')
    if sys.byteorder != 'little' or struct.calcsize('P') != 8:
        raise Unusable('this is no little-endian machine of 64 bits')


def _loaded(name: str) -> ctypes.CDLL:
    """Return a library that this process has loaded already."""
    for line in Path('/proc/self/maps').read_text().splitlines():
        path = Path(line.partition('/')[1] + line.partition('/')[2])
        if path.name.partition('.so')[0] == f'lib{name}' and '.so' in path.name:
            return ctypes.CDLL(str(path))
    raise Unusable(f'lib{name} is not loaded')


def _function(library: ctypes.CDLL, symbol: str, *arguments: type) -> Any:
    try:
        function = library[symbol]
    except AttributeError as error:
        raise Unusable(f'{symbol} is not there') from error
    function.argtypes = arguments
    function.restype = ctypes.c_int
    return function


def _address(library: ctypes.CDLL, symbol: str) -> int:
    return ctypes.cast(_function(library, symbol), ctypes.c_void_p).value or 0
