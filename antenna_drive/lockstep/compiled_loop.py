# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The exchange of a member as one compiled loop: wait, take, check, step, pack, publish.

It makes ordinary steps and nothing else: from frames of the peers that make every step, by senders
that are known. As soon as something else is due it returns to Python with the reason, and the
Python side (`member`, `node`) deals with it as if there were no loop.
The loop knows C functions by their addresses only: rcl's in a node, any others in a test.

What it works on is in arrays, so that the Python side reads where it stands. `Word`, `Time`,
`Call` and `Peer` name their places.
"""

from collections import namedtuple
from typing import Any

from antenna_drive.lockstep.delays import count
from antenna_drive.lockstep.frame import HEADER, SENDER
from antenna_drive.lockstep.inbox import DEPTH
from antenna_drive.physics.block import rows
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
import numpy as np
from simgap.laws.compiling import inner, shared

_HEADER, _SENDER = len(HEADER), SENDER

# Why the loop returns.
STEPPED, LIMIT, FOREIGN, MISSING, LAST_STEP, FAULT, TAKE_FAILED, PUBLISH_FAILED = range(1, 9)
_GO_ON = 0

# Whole numbers. `asked` is set by other threads to end the loop; `every` is after how many steps
# readings are published; `pause` is the step after which it returns; `peer` is who sent the frame
# that the loop does not take in.
Word = rows('asked', 'step', 'last_step', 'every', 'pause', 'late', 'peer', 'status',
            'publisher', 'guard', 'wait_set', 'incoming', 'outgoing', 'frame_in', 'frame_out',
            'frame_to', 'size_out', 'clock', 'brief_ns', 'value', 'stamp')

# Floating-point numbers, on the clock of time.monotonic() [s].
Time = rows('run', 'step_s', 'factor', 'start', 'first_step', 'lead', 'now', 'until', 'worst')

# Addresses of C functions.
Call = rows('take', 'publish', 'clear', 'add_subscription', 'add_guard', 'wait', 'copy',
            'compare', 'clock')

# Of each peer: its subscription, the bytes in front of its numbers, and how many numbers.
Peer = rows('subscription', 'prefix', 'prefix_size', 'length')

# Of each reading: the row of its value in the outputs, TIME for the simulated time; its publisher,
# its message, and where the number is in the message.
Reading = rows('row', 'publisher', 'message', 'place')
TIME = -1

# rcl_serialized_message_t as words: address, length and capacity of the bytes, their allocator.
MESSAGE_WORDS = 8
_BYTES, _SIZE = 0, 1
_NANOSECONDS = 1_000_000_000

_RCL_OK = 0
_TAKE_FAILED = 401  # RCL_RET_SUBSCRIPTION_TAKE_FAILED: there is no message
_CLOCK_MONOTONIC = 1

# The longest wait within the loop for a step to be due [s].
_LONGEST_WAIT_S = 0.1

State = namedtuple('State', (
    'words', 'times', 'calls', 'peers', 'order', 'frames', 'held', 'senders', 'sources', 'numbers',
    'outgoing', 'clock', 'incoming', 'readings', 'scales', 'value', 'stamp', 'delays',
    'stamps', 'u', 'y'))


@intrinsic  # type: ignore[untyped-decorator]
def call_c(typing_context: Any, address: Any, arguments: Any) -> Any:
    """Call the C function at an address with a tuple of words; return its int."""
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        words = cgutils.unpack_tuple(builder, values[1])
        kind = ir.FunctionType(ir.IntType(32), [ir.IntType(64)] * len(words))
        return builder.call(builder.inttoptr(values[0], kind.as_pointer()), words)

    return types.int32(address, arguments), generate


@inner
def _read_clock(s: Any) -> float:
    call_c(s.calls[Call.clock], (np.int64(_CLOCK_MONOTONIC), s.words[Word.clock]))
    return s.clock[0] + 1e-9 * s.clock[1]


@inner
def _take(s: Any, peer: int) -> int:
    """Take a frame of a peer: _GO_ON if it is the one wanted, MISSING if there is none."""
    w, t = s.words, s.times
    status = call_c(s.calls[Call.take], (
        s.peers[peer, Peer.subscription], w[Word.incoming], np.int64(0), np.int64(0)))
    if status == _TAKE_FAILED:
        return MISSING
    w[Word.peer] = peer
    if status != _RCL_OK:
        w[Word.status] = status
        return TAKE_FAILED
    prefix_size = s.peers[peer, Peer.prefix_size]
    length = s.peers[peer, Peer.length]
    if s.incoming[_SIZE] != prefix_size + 8 * length:
        return FOREIGN
    start = s.incoming[_BYTES]
    if call_c(s.calls[Call.compare], (start, s.peers[peer, Peer.prefix], prefix_size)) != 0:
        return FOREIGN
    call_c(s.calls[Call.copy], (w[Word.frame_in], start + prefix_size, 8 * length))
    total = 0.0
    for n in range(length):
        total += s.numbers[n]
    step = w[Word.step]
    slot = step % DEPTH
    if (s.numbers[0] != t[Time.run] or s.numbers[1] != step or not np.isfinite(total)
            or s.numbers[_SENDER] != s.senders[peer] or s.held[peer, slot]):
        return FOREIGN
    for n in range(length):
        s.frames[peer, slot, n] = s.numbers[n]
    s.held[peer, slot] = 1
    return _GO_ON


@inner
def _wait_for(s: Any, peer: int) -> None:
    """Sleep until a frame of this peer is there or a brief time is up."""
    w, calls = s.words, s.calls
    call_c(calls[Call.clear], (w[Word.wait_set],))
    call_c(calls[Call.add_subscription], (
        w[Word.wait_set], s.peers[peer, Peer.subscription], np.int64(0)))
    call_c(calls[Call.wait], (w[Word.wait_set], w[Word.brief_ns]))


@shared
def gather(s: Any) -> int:
    """Take what the next step needs, one peer at a time, the slowest first."""
    w = s.words
    slot = w[Word.step] % DEPTH
    for place in range(s.order.size):
        peer = s.order[place]
        if s.held[peer, slot]:
            continue
        reason = _take(s, peer)
        if reason == MISSING:
            _wait_for(s, peer)
            reason = _take(s, peer)
            # While the slowest is waited for, the frames of the others come.
            for earlier in range(place, 0, -1):
                s.order[earlier] = s.order[earlier - 1]
            s.order[0] = peer
        if reason != _GO_ON:
            return reason
    return _GO_ON


@shared
def may_step(s: Any) -> int:
    """Wait until the step is due, or return why it cannot be made here."""
    w, t = s.words, s.times
    if w[Word.step] >= w[Word.last_step]:
        return LAST_STEP
    while True:
        t[Time.now] = _read_clock(s)
        if w[Word.asked] or t[Time.now] >= t[Time.until]:
            return LIMIT
        if t[Time.factor] == 0.0:
            return _GO_ON
        remaining = _due(s, w[Word.step] + 1) - t[Time.lead] - t[Time.now]
        if remaining <= 0.0:
            return _GO_ON
        call_c(s.calls[Call.clear], (w[Word.wait_set],))
        call_c(s.calls[Call.add_guard], (w[Word.wait_set], w[Word.guard], np.int64(0)))
        call_c(s.calls[Call.wait], (
            w[Word.wait_set], np.int64(1e9 * min(remaining, _LONGEST_WAIT_S))))


@inner
def _due(s: Any, step: int) -> float:
    """Return when a step is due; see `pace.Pace`."""
    t = s.times
    return t[Time.start] + (step - t[Time.first_step]) * t[Time.step_s] / t[Time.factor]


@shared
def read_inputs(s: Any) -> None:
    """Put the inputs of the step into u."""
    slot = s.words[Word.step] % DEPTH
    for n in range(s.sources.shape[0]):
        peer, column = s.sources[n, 0], s.sources[n, 1]
        s.u[n, 0] = s.frames[peer, slot, column]
        s.u[n, 1] = s.frames[peer, slot, column + 1]


@inner
def _publish_readings(s: Any) -> None:
    """Publish what `readings.Readings` publishes; one that fails is missed by nobody."""
    w = s.words
    for n in range(s.readings.shape[0]):
        row = s.readings[n, Reading.row]
        if row == TIME:
            # seconds and nanoseconds, four bytes each, the seconds first
            time_ns = np.int64(np.rint(w[Word.step] * s.times[Time.step_s] * 1e9))
            s.stamp[0] = (time_ns // _NANOSECONDS) | ((time_ns % _NANOSECONDS) << 32)
            source = w[Word.stamp]
        else:
            s.value[0] = s.scales[n] * s.y[row, 0]
            source = w[Word.value]
        call_c(s.calls[Call.copy], (s.readings[n, Reading.place], source, np.int64(8)))
        call_c(s.calls[Call.publish], (
            s.readings[n, Reading.publisher], s.readings[n, Reading.message], np.int64(0)))


@shared
def put_out(s: Any) -> int:
    """Go on to the next step: check what the unit has put out, publish it."""
    w, t = s.words, s.times
    slot = w[Word.step] % DEPTH
    s.held[:, slot] = 0
    w[Word.step] += 1
    step = w[Word.step]
    outputs = s.y.shape[0]
    finite = True
    s.outgoing[0] = t[Time.run]
    s.outgoing[1] = step
    s.outgoing[2] = t[Time.step_s]
    for n in range(outputs):
        s.outgoing[_HEADER + 2 * n] = s.y[n, 0]
        s.outgoing[_HEADER + 2 * n + 1] = s.y[n, 1]
        finite = finite and np.isfinite(s.y[n, 0]) and np.isfinite(s.y[n, 1])
    if not finite:
        return FAULT
    # the last row of frames is this unit's own, in case it reads itself
    own, slot = s.frames.shape[0] - 1, step % DEPTH
    for n in range(_HEADER + 2 * outputs):
        s.frames[own, slot, n] = s.outgoing[n]
    call_c(s.calls[Call.copy], (w[Word.frame_to], w[Word.frame_out], w[Word.size_out]))
    if step < s.stamps.size:
        s.stamps[step] = _read_clock(s)
    status = call_c(s.calls[Call.publish], (
        w[Word.publisher], w[Word.outgoing], np.int64(0)))
    if t[Time.factor] > 0.0:
        after = t[Time.now] - _due(s, step)
        count(s.delays, after + t[Time.lead])
        if after > t[Time.step_s] / t[Time.factor]:
            w[Word.late] += 1
            t[Time.worst] = max(t[Time.worst], after)
    if status != _RCL_OK:
        w[Word.status] = status
        return PUBLISH_FAILED
    if w[Word.every] > 0 and step % w[Word.every] == 0:
        _publish_readings(s)
    return STEPPED if step == w[Word.pause] else _GO_ON
