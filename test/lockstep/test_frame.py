# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The frame's bytes, against rclpy's own serialisation where rclpy is."""

from __future__ import annotations

import struct

from antenna_drive.emulator.unit import Signal
from antenna_drive.lockstep.frame import all_finite, FrameLayout, read_foreign
from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

finite = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(st.characters(codec='ascii', categories=('L', 'N')), min_size=1, max_size=12)


@st.composite
def layouts(draw: st.DrawFn) -> FrameLayout:
    return FrameLayout([Signal(name, 'rad/s', '') for name in draw(st.lists(names, max_size=6))])


@given(layouts(), st.integers(1, 2**51), st.integers(0, 2**40), st.data())
def test_what_is_encoded_is_decoded_to_the_same_bits(
        layout: FrameLayout, run: int, step: int, data: st.DataObject) -> None:
    count = len(layout.signals)
    numbers = data.draw(st.lists(finite, min_size=2 * count, max_size=2 * count))
    outputs = np.array(numbers, dtype=float).reshape(count, 2)
    frame = layout.decode(layout.encode(float(run), step, 1e-3, 7.0, outputs.tobytes()))
    assert frame is not None
    assert frame[:4] == (run, step, 1e-3, 7.0)
    assert np.array(frame[4:]).tobytes() == outputs.tobytes()


@given(layouts(), st.data())
def test_a_message_of_another_length_is_not_decoded(
        layout: FrameLayout, data: st.DataObject) -> None:
    message = layout.hello(5.0, 7.0)
    cut = data.draw(st.integers(0, len(message) - 1))
    assert layout.decode(message[:cut]) is None
    assert layout.decode(message + b'\0' * (cut + 1)) is None


@settings(deadline=None)
@given(layouts(), st.integers(1, 2**51))
def test_rclpy_reads_our_bytes(layout: FrameLayout, run: int) -> None:
    serialization = pytest.importorskip('rclpy.serialization', reason='rclpy is not installed')
    messages = pytest.importorskip('std_msgs.msg', reason='std_msgs is not installed')
    outputs = np.arange(2.0 * len(layout.signals)).reshape(-1, 2)
    message = serialization.deserialize_message(
        layout.encode(float(run), 7, 1e-3, 9.0, outputs.tobytes()), messages.Float64MultiArray)
    assert list(message.data) == [run, 7.0, 1e-3, 9.0, *outputs.ravel()]
    [dimension] = message.layout.dim
    assert dimension.size == dimension.stride == layout.length
    assert len(dimension.label.split(', ')) == layout.length


@settings(deadline=None)
@given(st.lists(st.tuples(names, st.integers(0, 9), st.integers(0, 9)), max_size=3),
       st.lists(st.floats(allow_nan=False), max_size=9))
def test_a_foreign_layout_is_read_as_rclpy_writes_it(
        dimensions: list[tuple[str, int, int]], numbers: list[float]) -> None:
    serialization = pytest.importorskip('rclpy.serialization', reason='rclpy is not installed')
    messages = pytest.importorskip('std_msgs.msg', reason='std_msgs is not installed')
    message = messages.Float64MultiArray(data=numbers)
    message.layout.dim = [messages.MultiArrayDimension(label=label, size=size, stride=stride)
                          for label, size, stride in dimensions]
    assert read_foreign(serialization.serialize_message(message)) == tuple(numbers)


def test_the_other_byte_order_is_read() -> None:
    # no dimensions, offset 0, two numbers; big-endian
    body = struct.pack('>III4x2d', 0, 0, 2, 1.5, -3.0)
    assert read_foreign(b'\0\0\0\0' + body) == (1.5, -3.0)


@given(st.binary(max_size=200), st.sampled_from([b'', b'\0\0\0\0', b'\0\1\0\0']))
def test_garbage_has_numbers_or_none(garbage: bytes, head: bytes) -> None:
    assert isinstance(read_foreign(head + garbage), tuple)


def test_a_count_of_billions_is_refused_at_once() -> None:
    for body in (struct.pack('<I', 2**32 - 1), struct.pack('<III', 0, 0, 2**32 - 1),
                 struct.pack('<II', 1, 2**32 - 1)):
        assert read_foreign(b'\0\1\0\0' + body + bytes(64)) in ((), (0.0,) * 8)


def test_the_labels_name_every_number_with_its_unit() -> None:
    layout = FrameLayout([Signal('axis_rate', 'rad/s', ''), Signal('current', 'A', '')])
    assert layout.label == ('run, step, step_s, sender, axis_rate [rad/s], '
                            'd/dt axis_rate [rad/s^2], current [A], d/dt current [A/s]')


@given(st.lists(st.floats(), max_size=8))
def test_finite_means_every_number(numbers: list[float]) -> None:
    assert all_finite(numbers) == bool(np.isfinite(np.array(numbers)).all())
