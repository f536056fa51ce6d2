# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is larger than a drive needs is refused in one line, before it takes the memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import struct
import tracemalloc
from typing import Any

from antenna_drive.limits import BAG, BAG_RECORD, LIMITS
from antenna_drive.recording.bag import MESSAGE_DEFINITION, MESSAGE_TYPE
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.csv_format import read_csv
from antenna_drive.recording.files import import_file, load_map
import lz4.frame
from mcap.records import Chunk
from mcap.writer import CompressionType, Writer
import pytest
from simgap.errors import UserError
from simgap.inputs.limits import CSV_LINE, Limit, SAMPLES, SIGNALS, TEXT
from simgap.logs.channel import RecordingError
import zstandard

ROOT = Path(__file__).resolve().parents[2]
ZEROS = bytes(50_000_000)
FLOAT64 = struct.pack('<4sd', b'\0\1\0\0', 1.5)


@pytest.fixture
def set_limit(monkeypatch: pytest.MonkeyPatch) -> Callable[[Limit, int], None]:
    """Return a function that sets a limit."""
    return lambda limit, value: monkeypatch.setenv(limit.variable, str(value))


def refusal_within(most_bytes: float, read: Callable[[], object]) -> str:
    """Return the one line with which `read` refuses, having taken no more memory than this."""
    tracemalloc.start()
    try:
        with pytest.raises(RecordingError) as refused:
            read()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < most_bytes
    assert '\n' not in str(refused.value)
    return str(refused.value)


def packed(path: Path, compression: CompressionType, content: bytes = ZEROS) -> Path:
    """Write a bag of one message in one chunk."""
    with path.open('wb') as stream:
        writer = Writer(stream, compression=compression)
        writer.start('ros2')
        schema = writer.register_schema(MESSAGE_TYPE, 'ros2msg', MESSAGE_DEFINITION)
        writer.add_message(writer.register_channel('/a/b', 'cdr', schema), 0, content, 0)
        writer.finish()
    return path


@pytest.mark.parametrize('limit', LIMITS)
def test_each_limit_is_documented_and_can_be_set(
        limit: Limit, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / 'docs' / 'recording.md').read_text(encoding='utf-8')
    row = next(line for line in text.splitlines() if f'`{limit.variable}`' in line)
    assert int(row.split('|')[2].replace(' ', '')) == limit.default == limit.value()
    monkeypatch.setenv(limit.variable, '7')
    assert limit.value() == 7
    assert limit.variable in limit.exceeded()
    for wrong in ('0', '-1', 'many', '1.5', '1e9', '9' * 100):
        monkeypatch.setenv(limit.variable, wrong)
        with pytest.raises(UserError, match=limit.variable):
            limit.value()


@pytest.mark.parametrize('compression', [CompressionType.ZSTD, CompressionType.LZ4])
def test_a_bag_that_unpacks_into_more_than_allowed(
        tmp_path: Path, compression: CompressionType,
        set_limit: Callable[[Limit, int], None]) -> None:
    path = packed(tmp_path / 'a.mcap', compression)
    assert path.stat().st_size < len(ZEROS) / 200
    set_limit(BAG_RECORD, 1_000_000)
    message = refusal_within(5e6, lambda: read_bag(path))
    assert str(path) in message and BAG_RECORD.variable in message


@pytest.mark.parametrize('pack, name', [(zstandard.compress, 'zstd'),
                                        (lz4.frame.compress, 'lz4')])
def test_a_chunk_that_unpacks_into_more_than_it_says(
        tmp_path: Path, pack: Callable[[bytes], bytes], name: str,
        monkeypatch: pytest.MonkeyPatch) -> None:
    written = Chunk.write

    def lie(chunk: Chunk, stream: Any) -> None:
        chunk.data, chunk.compression, chunk.uncompressed_size = pack(ZEROS), name, 1000
        written(chunk, stream)

    with monkeypatch.context() as patched:
        patched.setattr(Chunk, 'write', lie)
        path = packed(tmp_path / 'a.mcap', CompressionType.NONE, FLOAT64)
    assert 'another size than it says' in refusal_within(5e6, lambda: read_bag(path))


def test_a_record_that_is_longer_than_allowed(
        tmp_path: Path, set_limit: Callable[[Limit, int], None]) -> None:
    path = packed(tmp_path / 'a.mcap', CompressionType.NONE)
    set_limit(BAG_RECORD, 1_000_000)
    assert BAG_RECORD.variable in refusal_within(5e6, lambda: read_bag(path))


@pytest.mark.parametrize('length', [2**20, 2**40, 2**63 - 1])
def test_a_record_that_says_it_is_longer_than_the_file(tmp_path: Path, length: int) -> None:
    path = packed(tmp_path / 'a.mcap', CompressionType.NONE, FLOAT64)
    data = bytearray(path.read_bytes())
    data[9:17] = struct.pack('<Q', length)  # the header's
    path.write_bytes(data)
    refusal_within(5e6, lambda: read_bag(path))


@pytest.mark.parametrize('limit, most', [(SAMPLES, 99), (BAG, 4000), (SIGNALS, 1)])
def test_a_bag_of_more_than_allowed(tmp_path: Path, limit: Limit, most: int,
                                    set_limit: Callable[[Limit, int], None]) -> None:
    path = tmp_path / 'a.mcap'
    with path.open('wb') as stream:
        writer = Writer(stream)
        writer.start('ros2')
        schema = writer.register_schema(MESSAGE_TYPE, 'ros2msg', MESSAGE_DEFINITION)
        topics = [writer.register_channel(f'/a/{n}', 'cdr', schema) for n in 'xy']
        for k in range(50):
            for topic in topics:
                writer.add_message(topic, k, FLOAT64, k)
        writer.finish()
    assert len(read_bag(path)['a/y']) == 50
    set_limit(limit, most)
    assert limit.variable in refusal_within(5e6, lambda: read_bag(path))


def test_messages_of_other_types_in_between_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / 'a.mcap'
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=10_000_000)
        writer.start('ros2')
        ours = writer.register_channel('/a/x', 'cdr', writer.register_schema(
            MESSAGE_TYPE, 'ros2msg', MESSAGE_DEFINITION))
        other = writer.register_channel('/a/s', 'cdr', writer.register_schema(
            'std_msgs/msg/String', 'ros2msg', b'string data\n'))
        for k in range(3000):
            writer.add_message(ours, k, struct.pack('<4sd', b'\0\1\0\0', float(k)), k)
            for _ in range(k % 3):
                writer.add_message(other, k, b'\0\1\0\0' + bytes(k % 50), k)
        writer.finish()
    bag = read_bag(path)
    assert bag['a/x'].values.tolist() == [float(k) for k in range(3000)]
    assert bag.notes['skipped_topics'] == ('/a/s',)


@pytest.mark.parametrize('limit, most', [(SAMPLES, 99), (SIGNALS, 2), (CSV_LINE, 20)])
def test_a_csv_of_more_than_allowed(tmp_path: Path, limit: Limit, most: int,
                                    set_limit: Callable[[Limit, int], None]) -> None:
    path = tmp_path / 'a.csv'
    path.write_text('time_s,a/x [1],a/y [1]\n'
                    + ''.join(f'{k}.0,1.0,{"" if k % 2 else 2.0}\n' for k in range(67)))
    assert len(read_csv(path)['a/x']) == 67
    set_limit(limit, most)
    message = refusal_within(5e6, lambda: read_csv(path))
    assert limit.variable in message and f'{path}: line ' in message


def test_a_csv_without_an_end_of_line(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    path.write_bytes(ZEROS.replace(b'\0', b'0'))
    assert CSV_LINE.variable in refusal_within(2e7, lambda: read_csv(path))


def test_the_samples_of_a_csv_take_16_bytes_each(tmp_path: Path) -> None:
    path = tmp_path / 'a.csv'
    with path.open('w') as stream:
        stream.write('time_s,a/x [1]\n')
        stream.writelines(f'{k}.0,{k}.5\n' for k in range(100_000))
    tracemalloc.start()
    try:
        read_csv(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 16 * 100_000 * 4, 'what is read, its copy, and the room to grow'


def test_a_csv_with_a_map_of_more_than_allowed(
        tmp_path: Path, set_limit: Callable[[Limit, int], None]) -> None:
    path, map_path = tmp_path / 'a.csv', tmp_path / 'map.yaml'
    path.write_text('t,x\n' + ''.join(f'{k}.0,1.0\n' for k in range(100)))
    map_path.write_text('time: {column: t}\nsignals: {a/x: {column: x, unit: "1"}}\n')
    import_map = load_map(map_path)
    assert len(import_file(path, import_map)['a/x']) == 100
    set_limit(SAMPLES, 99)
    assert SAMPLES.variable in refusal_within(5e6, lambda: import_file(path, import_map))


def test_what_lies_beside_a_csv(tmp_path: Path, set_limit: Callable[[Limit, int], None]) -> None:
    path = tmp_path / 'a.csv'
    path.write_text('time_s,a/x [1]\n0.0,1.0\n')
    path.with_suffix('.meta.json').write_text('{"rows": 1, "notes": {"a": "' + 'x' * 1000 + '"}}')
    assert len(read_csv(path).notes['a']) == 1000
    set_limit(TEXT, 1000)
    assert TEXT.variable in refusal_within(5e6, lambda: read_csv(path))


def test_a_frame_of_any_length_is_not_read(set_limit: Callable[[Limit, int], None]) -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    from antenna_drive.lockstep.frame import read_foreign
    from rclpy.serialization import serialize_message
    from std_msgs.msg import Float64MultiArray
    few = serialize_message(Float64MultiArray(data=[1.0, 2.0]))
    assert read_foreign(few) == (1.0, 2.0)
    many = serialize_message(Float64MultiArray(data=[0.0] * 100_000))
    tracemalloc.start()
    try:
        assert read_foreign(many) == ()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 10_000
