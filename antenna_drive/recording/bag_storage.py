# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the storage files of a bag, MCAP, record by record up to where they were cut off."""

from dataclasses import dataclass, field
import io
import os
from pathlib import Path
import struct
import tempfile
from typing import Any, BinaryIO, cast
import zlib

from antenna_drive.limits import BAG, BAG_RECORD
from antenna_drive.recording.bag import CDR_HEADER, CHANGE, FORMAT, FORMAT_VERSION, MESSAGE_TYPE
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment, Channel as Topic, Chunk, Footer, Header, Message, Metadata, Schema, Statistics,
)
from mcap.stream_reader import StreamReader
import numpy as np
from numpy.typing import NDArray
from simgap.errors import one_line
from simgap.inputs.limits import SAMPLES, SIGNALS
from simgap.inputs.plain import from_json
from simgap.logs.channel import RecordingError

# A message record of Float64 as it lies in a chunk: 43 bytes, read by the thousand.
_MESSAGE = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('topic', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8'), ('cdr', 'S4'), ('value', '<f8')])
_MESSAGE_LENGTH = _MESSAGE.itemsize - 9
_FEW = 1024  # messages that are looked at at first
_FOOTER_TAIL = 12  # the summary's checksum and the magic
PACKED = '.zstd'  # ending of a storage file that is packed as a whole


class DamageError(Exception):
    """A storage file ends early or is damaged; the text says how."""


@dataclass
class Storage:
    """What was found in the storage files so far."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    topics: dict[int, Topic] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    samples: dict[str, list[NDArray[Any]]] = field(default_factory=dict)
    skipped: set[str] = field(default_factory=set)
    attachments: dict[str, bytes] = field(default_factory=dict)
    changes: list[Any] = field(default_factory=list)
    messages: int = 0
    unpacked: int = 0

    def take(self, record: object) -> None:
        """Take in one record of a file."""
        if isinstance(record, Header):
            if record.profile not in ('ros2', ''):
                raise RecordingError(f'profile {one_line(repr(record.profile), 30)}, '
                                     "but a ROS 2 bag has 'ros2'")
        elif isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Topic):
            self._take_topic(record)
        elif isinstance(record, Chunk):
            self._take_chunk(record)
        elif isinstance(record, Message):
            self._take_messages(np.frombuffer(_message_bytes(record), dtype=_MESSAGE))
        elif isinstance(record, Attachment):
            self.attachments[record.name] = record.data
        elif isinstance(record, Metadata):
            self._take_metadata(record)

    def _take_topic(self, topic: Topic) -> None:
        known = self.topics.get(topic.id)
        if known is not None and known.topic != topic.topic:
            raise DamageError(f'topic {topic.id} is defined twice')
        self.topics[topic.id] = topic
        schema = self.schemas.get(topic.schema_id)
        if schema is None and topic.schema_id:
            raise DamageError(f'topic {one_line(topic.topic)} has no message type')
        if schema is None or schema.name != MESSAGE_TYPE or topic.message_encoding != 'cdr':
            self.skipped.add(topic.topic)
            return
        if len(self.samples) >= SIGNALS.value():
            raise RecordingError(SIGNALS.exceeded())
        self.units.setdefault(topic.topic, topic.metadata.get('unit', ''))
        self.samples.setdefault(topic.topic, [])

    def _take_chunk(self, chunk: Chunk) -> None:
        data = _unpacked(chunk)
        length = len(data)
        self.unpacked += length
        if self.unpacked > BAG.value():
            raise RecordingError(BAG.exceeded())
        place = 0
        ahead = _FEW
        while place < length:
            # looked at in pieces that grow: other records in between may be many
            many = min(ahead, (length - place) // _MESSAGE.itemsize)
            block = np.frombuffer(data, dtype=_MESSAGE, count=many, offset=place)
            other = np.flatnonzero((block['opcode'] != Opcode.MESSAGE)
                                   | (block['length'] != _MESSAGE_LENGTH))
            block = block[:int(other[0])] if len(other) else block
            ahead = _FEW if len(other) else 2 * ahead
            if len(block):
                self._take_messages(block)
                place += block.nbytes
                continue
            if length - place < 9:
                raise DamageError('a chunk ends inside a record')
            opcode, size = struct.unpack_from('<BQ', data, place)
            place += 9
            if size > length - place:
                raise DamageError('a chunk ends inside a record')
            self._take_in_chunk(opcode, data[place:place + size])
            place += size

    def _take_in_chunk(self, opcode: int, content: bytes) -> None:
        stream = ReadDataStream(io.BytesIO(content))
        if opcode == Opcode.SCHEMA:
            self.take(Schema.read(stream))
        elif opcode == Opcode.CHANNEL:
            self.take(Topic.read(stream))
        elif opcode == Opcode.MESSAGE:
            message = Message.read(stream, len(content))
            topic = self.topics.get(message.channel_id)
            if topic is None:
                raise DamageError(f'a message of a topic {message.channel_id} that is not there')
            if topic.topic not in self.skipped:
                raise DamageError(f'a message of {one_line(topic.topic)} is no Float64')
            self.messages += 1

    def _take_messages(self, block: NDArray[Any]) -> None:
        self.messages += len(block)
        if self.messages > SAMPLES.value():
            raise RecordingError(SAMPLES.exceeded())
        block = block[np.argsort(block['topic'], kind='stable')]
        for own in np.split(block, np.flatnonzero(np.diff(block['topic'])) + 1):
            number = int(own['topic'][0])
            topic = self.topics.get(number)
            if topic is None:
                raise DamageError(f'a message of a topic {number} that is not there')
            if topic.topic in self.skipped:
                continue
            # numpy leaves out the zero bytes at the end
            if not np.all(own['cdr'] == CDR_HEADER.rstrip(b'\0')):
                raise RecordingError(f'{one_line(topic.topic)}: a message is not in little-endian '
                                     'CDR, the only encoding that is read here')
            self.samples[topic.topic].append(own[['log_time', 'value']])

    def _take_metadata(self, record: Metadata) -> None:
        if record.name == FORMAT and record.metadata.get('format') != FORMAT_VERSION:
            raise RecordingError('written by a newer version of antenna_drive')
        if record.name == CHANGE:
            try:
                self.changes.append([int(record.metadata['step']), record.metadata['unit'],
                                     from_json(record.metadata['values'])])
            except (KeyError, ValueError):
                raise DamageError('a live change cannot be read') from None

    def last_ns(self) -> int:
        """Return the last time stamp that was read [ns], -1 if there is none."""
        return max((int(part['log_time'].max()) for parts in self.samples.values()
                    for part in parts if len(part)), default=-1)


def _unpacked(chunk: Chunk) -> bytes:
    """Return what is packed in a chunk, which is no longer than it says and than is allowed."""
    size = chunk.uncompressed_size
    if size > BAG_RECORD.value():
        raise RecordingError(BAG_RECORD.exceeded())
    if chunk.compression == 'zstd':
        import zstandard
        data = zstandard.ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
    elif chunk.compression == 'lz4':
        import lz4.frame
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, size + 1)
    elif chunk.compression == '':
        data = chunk.data
    else:
        raise DamageError(f'a chunk is packed by {one_line(repr(chunk.compression), 30)}')
    if len(data) != size:
        raise DamageError('a chunk has another size than it says')
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise DamageError('the checksum of a chunk is another')
    return data


class _Within:
    """A file of which no record is read that is longer than what is left of it, or allowed."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file = file
        self._left = size
        self._most = BAG_RECORD.value()

    def read(self, count: int) -> bytes:
        """Return the next `count` bytes."""
        if count > self._left:
            raise DamageError('the file ends early')
        if count > self._most:
            raise RecordingError(BAG_RECORD.exceeded())
        self._left -= count
        return self._file.read(count)


def _message_bytes(record: Message) -> bytes:
    content = struct.pack('<HIQQ', record.channel_id, record.sequence, record.log_time,
                          record.publish_time) + record.data
    if len(content) != _MESSAGE_LENGTH:
        raise DamageError('a message outside a chunk is no Float64')
    return struct.pack('<BQ', Opcode.MESSAGE, len(content)) + content


def _opened(path: Path) -> BinaryIO:
    """Open a storage file; one that is packed as a whole is unpacked to a file without a name."""
    file: BinaryIO = path.open('rb')
    if path.suffix != PACKED:
        return file
    import zstandard
    unpacked: Any = tempfile.TemporaryFile()
    with file:
        try:
            for part in zstandard.ZstdDecompressor().read_to_iter(file):
                if unpacked.tell() + len(part) > BAG.value():
                    raise RecordingError(BAG.exceeded())
                unpacked.write(part)
        except zstandard.ZstdError:
            pass  # what was unpacked ends early, and is read up to there
    unpacked.flush()
    unpacked.seek(0)
    return cast(BinaryIO, unpacked)


def read_storage(path: Path, storage: Storage) -> None:
    """Read one storage file to its end, and check that it is all there."""
    try:
        file = _opened(path)
    except FileNotFoundError as error:  # a part of a split bag
        raise DamageError(f'{path}: {error.strerror}') from error
    except OSError as error:
        raise RecordingError(f'{path}: {error.strerror}') from error
    storage.schemas, storage.topics = {}, {}  # each file has numbers of its own
    before = storage.messages
    count: int | None = None
    with file:
        size = os.fstat(file.fileno()).st_size
        footer: Footer | None = None
        try:
            within: Any = _Within(file, size)
            for record in StreamReader(within, emit_chunks=True, validate_crcs=True,
                                       record_size_limit=None).records:
                if isinstance(record, Statistics):
                    count = record.message_count
                elif isinstance(record, Footer):
                    footer = record
                else:
                    storage.take(record)
        except (DamageError, RecordingError):
            raise
        except Exception as error:  # noqa: B902 (a damaged file can raise anything in there)
            if file.read(1) == b'' and size:
                raise DamageError('the file ends early') from None
            raise DamageError(f'{type(error).__name__} {one_line(error)}') from None
        if footer is None or file.read(1):
            raise DamageError('something follows the end')
        if footer.summary_start > size:
            raise DamageError('the summary begins behind the end')
        if footer.summary_start and footer.summary_crc:
            file.seek(footer.summary_start)
            if zlib.crc32(file.read(size - _FOOTER_TAIL - footer.summary_start)) \
                    != footer.summary_crc:
                raise DamageError('the summary is damaged')
    if count is not None and count != storage.messages - before:
        raise DamageError(
            f'{storage.messages - before} messages, but the summary tells of {count}')
