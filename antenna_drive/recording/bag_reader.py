# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Reads bags: our own and those of `ros2 bag`, whole or up to where they were cut off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
import io
import os
from pathlib import Path
import struct
from typing import Any, BinaryIO
import warnings
import zlib

from antenna_drive.emulator.wiring import signal_names
from antenna_drive.limits import BAG, BAG_RECORD
from antenna_drive.recording.bag import (
    CDR_HEADER, CHANGE, CONFIGURATION, FORMAT, FORMAT_VERSION, MESSAGE_TYPE, METADATA, NOTES,
)
from antenna_drive.recording.csv_format import parse_known
from antenna_drive.recording.recording import Recording, unit_of
from antenna_drive.recording.sheet import FILE_NAME, parse_sheet
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
from simgap.inputs.plain import from_json, PlainDataError
from simgap.inputs.plain_yaml import parse_yaml, read_yaml
from simgap.inputs.schema import ParameterError
from simgap.logs.channel import make_channel, NANOSECONDS, RecordingError, RecordingWarning

# A message record of Float64 as it lies in a chunk: 43 bytes, read by the thousand.
_MESSAGE = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('topic', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8'), ('cdr', 'S4'), ('value', '<f8')])
_MESSAGE_LENGTH = _MESSAGE.itemsize - 9
_FEW = 1024  # messages that are looked at at first
_FOOTER_TAIL = 12  # the summary's checksum and the magic
LONGEST_NAME = 255  # characters of a file's name; no file system of today takes more


class _DamageError(Exception):
    """A storage file ends early or is damaged; the text says how."""


@dataclass
class _Storage:
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

    def begin_file(self) -> None:
        """Forget the numbers of types and topics: each file has its own."""
        self.schemas, self.topics = {}, {}

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
            raise _DamageError(f'topic {topic.id} is defined twice')
        self.topics[topic.id] = topic
        schema = self.schemas.get(topic.schema_id)
        if schema is None:
            raise _DamageError(f'topic {one_line(topic.topic)} has no message type')
        if schema.name != MESSAGE_TYPE or topic.message_encoding != 'cdr':
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
                raise _DamageError('a chunk ends inside a record')
            opcode, size = struct.unpack_from('<BQ', data, place)
            place += 9
            if size > length - place:
                raise _DamageError('a chunk ends inside a record')
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
                raise _DamageError(f'a message of a topic {message.channel_id} that is not there')
            if topic.topic not in self.skipped:
                raise _DamageError(f'a message of {one_line(topic.topic)} is no Float64')
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
                raise _DamageError(f'a message of a topic {number} that is not there')
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
                raise _DamageError('a live change cannot be read') from None

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
        raise _DamageError(f'a chunk is packed by {one_line(repr(chunk.compression), 30)}')
    if len(data) != size:
        raise _DamageError('a chunk has another size than it says')
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise _DamageError('the checksum of a chunk is another')
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
            raise _DamageError('the file ends early')
        if count > self._most:
            raise RecordingError(BAG_RECORD.exceeded())
        self._left -= count
        return self._file.read(count)


def _message_bytes(record: Message) -> bytes:
    content = struct.pack('<HIQQ', record.channel_id, record.sequence, record.log_time,
                          record.publish_time) + record.data
    if len(content) != _MESSAGE_LENGTH:
        raise _DamageError('a message outside a chunk is no Float64')
    return struct.pack('<BQ', Opcode.MESSAGE, len(content)) + content


def _records(file: BinaryIO, size: int) -> Iterator[object]:
    """Yield the records of a storage file; whatever the library meets in it is damage."""
    within: Any = _Within(file, size)
    reader = StreamReader(within, emit_chunks=True, validate_crcs=True,
                          record_size_limit=None)
    records = reader.records
    while True:
        try:
            record = next(records)
        except StopIteration:
            return
        except (_DamageError, RecordingError):
            raise
        except Exception as error:  # noqa: B902 (a damaged file can raise anything in there)
            if file.read(1) == b'' and size:
                raise _DamageError('the file ends early') from None
            raise _DamageError(f'{type(error).__name__} {one_line(error)}') from None
        yield record


def _read_storage(path: Path, storage: _Storage) -> None:
    """Read one storage file to its end, and check that it is all there."""
    try:
        file = path.open('rb')
    except OSError as error:
        raise RecordingError(f'{path}: {error.strerror}') from error
    storage.begin_file()
    before = storage.messages
    count: int | None = None
    with file:
        size = os.fstat(file.fileno()).st_size
        footer: Footer | None = None
        try:
            for record in _records(file, size):
                if isinstance(record, Statistics):
                    count = record.message_count
                elif isinstance(record, Footer):
                    footer = record
                else:
                    storage.take(record)
        except (_DamageError, RecordingError):
            raise
        except Exception as error:  # noqa: B902 (compressed data that is none, and the like)
            raise _DamageError(f'{type(error).__name__} {one_line(error)}') from None
        if footer is None or file.read(1):
            raise _DamageError('something follows the end')
        if footer.summary_start > size:
            raise _DamageError('the summary begins behind the end')
        if footer.summary_start and footer.summary_crc:
            file.seek(footer.summary_start)
            if zlib.crc32(file.read(size - _FOOTER_TAIL - footer.summary_start)) \
                    != footer.summary_crc:
                raise _DamageError('the summary is damaged')
    if count is not None and count != storage.messages - before:
        raise _DamageError(f'{storage.messages - before} messages, but the summary tells of '
                           f'{count}')


def read_bag(path: str | Path, *, partial: bool = False) -> Recording:
    """
    Read a rosbag2 folder with MCAP storage, or one storage file.

    Topics of other types than std_msgs/Float64 are left out and named in the notes, under
    'skipped_topics'. A namespace that the whole drive ran in is taken off the names and kept in
    the notes, under 'namespace'.

    Parameters
    ----------
    path
        the folder, or a file NAME.mcap
    partial
        read what can be read of a bag that was cut off or damaged, and warn how far

    Raises
    ------
    RecordingError : the bag is not there, is none, or was cut off or damaged and `partial` is
        not set; one line says where and why

    Warns
    -----
    RecordingWarning : `partial` was needed; the message says up to where the bag was read

    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f'{path}: no such file or folder')
    storage = _Storage()
    damage: str | None = None
    try:
        files, counts = _files(path)
        for file in files:
            _read_storage(file, storage)
        _check_counts(storage, counts)
    except _DamageError as error:
        damage = str(error)
    except RecordingError as error:
        raise error if str(error).startswith(str(path)) else RecordingError(
            f'{path}: {error}') from None
    if damage is not None:
        last = storage.last_ns()
        until = f'up to {last / NANOSECONDS:.9f} s' if last >= 0 else 'up to no sample at all'
        if not partial:
            raise RecordingError(f'{path}: cut off or damaged, {damage}; it can be read {until} '
                                 'if a part is enough (--partial)')
        warnings.warn(f'{path}: cut off or damaged, {damage}; read {until}', RecordingWarning,
                      stacklevel=2)
    try:
        return _recording(storage)
    except (RecordingError, PlainDataError, ParameterError) as error:
        raise RecordingError(f'{path}: {error}') from None


def _files(path: Path) -> tuple[list[Path], dict[str, int] | None]:
    """Return the storage files of a bag in their order, and its topics' message counts."""
    if path.is_file():
        return [path], None
    if not (path / METADATA).is_file():
        found = sorted(path.glob('*.mcap'), key=lambda file: (len(file.name), file.name))
        if not found:
            raise RecordingError(f'{path}: no bag, there is neither {METADATA} nor a file .mcap')
        return found, {}
    try:
        tree = read_yaml(path / METADATA)
    except ParameterError as error:
        raise RecordingError(str(error)) from None
    try:
        info = tree['rosbag2_bagfile_information']
        storage, compression = info['storage_identifier'], info.get('compression_mode', '')
        names = info['relative_file_paths']
        counts = {topic['topic_metadata']['name']: topic['message_count']
                  for topic in info['topics_with_message_count']}
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or (
                not all(isinstance(n, str) and isinstance(c, int) for n, c in counts.items())):
            raise TypeError
    except (KeyError, TypeError, AttributeError):
        raise RecordingError(f'{path / METADATA}: no description of a bag') from None
    if storage != 'mcap':
        raise RecordingError(f'{path}: storage {one_line(repr(storage), 30)}, but only mcap is '
                             'read here; ros2 bag convert changes it')
    if compression not in ('', 'none', None):
        raise RecordingError(f'{path}: compressed by {one_line(repr(compression), 30)}, which is '
                             'not read here; MCAP compresses its own chunks')
    for name in names:
        if len(name) > LONGEST_NAME:
            raise RecordingError(f'{path / METADATA}: {one_line(name, 60)} is no name of a file')
        if not _lies_in(path, name):
            raise RecordingError(f'{path / METADATA}: the file {one_line(name, 60)} lies outside '
                                 'the bag')
    return [path / name for name in names], counts


def _lies_in(folder: Path, name: str) -> bool:
    try:
        return bool(name) and (folder / name).resolve().is_relative_to(folder.resolve())
    except (ValueError, OSError):  # no name of a file: a null byte, half of a character, too long
        return False


def _check_counts(storage: _Storage, counts: dict[str, int] | None) -> None:
    if counts is None:
        return
    if not counts:
        raise _DamageError(f'there is no {METADATA}')
    for topic, parts in storage.samples.items():
        found = sum(len(part) for part in parts)
        if counts.get(topic) != found:
            raise _DamageError(f'{found} messages of {one_line(topic)}, but {METADATA} tells of '
                               f'{counts.get(topic, 0)}')
    missing = set(counts) - set(storage.samples) - storage.skipped
    for topic in sorted(missing):
        if counts[topic]:
            raise _DamageError(f'no message of {one_line(topic)}, but {METADATA} tells of '
                               f'{counts[topic]}')


def _recording(storage: _Storage) -> Recording:
    namespace = _namespace(list(storage.samples))
    channels = {}
    for topic, parts in storage.samples.items():
        name = topic.removeprefix(namespace).lstrip('/')
        stamps = np.concatenate([np.empty(0, np.uint64), *(p['log_time'] for p in parts)])
        values = np.concatenate([np.empty(0), *(p['value'] for p in parts)])
        if len(stamps) and stamps.max() >= 2**63:
            raise RecordingError(f'{one_line(name)}: a time stamp is beyond 292 years')
        channels[name] = make_channel(name, storage.units[topic] or unit_of(name),
                                      stamps.astype(np.int64), values)
    known = {}
    for key, file in (('configuration', CONFIGURATION), ('notes', NOTES)):
        if file in storage.attachments:
            known[key] = from_json(storage.attachments[file])
    known = parse_known({**known, 'changes': storage.changes})
    notes = dict(known.pop('notes'))
    if storage.skipped:
        notes['skipped_topics'] = sorted(storage.skipped)
    if namespace:
        notes['namespace'] = namespace
    sheet = parse_sheet(parse_yaml(storage.attachments.get(FILE_NAME, b'')) or {})
    return Recording(channels, sheet=sheet, notes=notes, **known)


def _namespace(topics: Sequence[str]) -> str:
    """Return the namespace that one drive ran in, '' for none or several."""
    own = signal_names()
    found = {topic[:-len(name)].rstrip('/')
             for topic in topics for name in own if topic.endswith(f'/{name}')}
    return found.pop() if len(found) == 1 else ''
