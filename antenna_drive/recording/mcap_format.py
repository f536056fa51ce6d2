# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Recordings as rosbag2 folders with MCAP storage: what ROS 2 tools, PlotJuggler and Foxglove open.

One std_msgs/Float64 topic per signal, '/unit/signal'; the log time is simulated time, the
sequence number is the step. Attachments hold the configuration and the notes (JSON) and the test
sheet (YAML); a metadata record holds each live change. The mcap library writes and reads the
storage; nothing here needs ROS 2.

A chunk is complete at least every half second, and a reader needs nothing behind it: whatever
happens to the process that records, at most the last half second is lost. Should the power fail,
what was synchronised is safe, see `sync_s`. The index of the chunks is held in memory until its
file ends, so a long bag has several storage files, see `split_s`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
import io
import math
import os
from pathlib import Path
import struct
import time
from types import TracebackType
from typing import Any, BinaryIO
import warnings
import zlib

from antenna_drive.drafts import drafted
from antenna_drive.emulator.wiring import signal_names
from antenna_drive.errors import one_line
from antenna_drive.limits import BAG, BAG_RECORD, SAMPLES, SIGNALS
from antenna_drive.parameters.plain_yaml import parse_yaml, read_yaml
from antenna_drive.parameters.schema import ParameterError
from antenna_drive.recording.atomic import new_folder, refuse_existing, refuse_io, sync_folder
from antenna_drive.recording.csv_format import parse_known
from antenna_drive.recording.plain import freeze, from_json, PlainDataError, to_json
from antenna_drive.recording.recording import (
    make_channel, NANOSECONDS, Recording, RecordingError, RecordingWarning, unit_of,
)
from antenna_drive.recording.sheet import dump_sheet, FILE_NAME, parse_sheet, TestSheet
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment, Channel as Topic, Chunk, Footer, Header, Message, Metadata, Schema, Statistics,
)
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
import numpy as np
from numpy.typing import NDArray
import yaml

METADATA = 'metadata.yaml'
MESSAGE_TYPE = 'std_msgs/msg/Float64'
MESSAGE_DEFINITION = b'float64 data\n'
# REP-2011 hash of the type, as ROS 2 computes it
MESSAGE_HASH = 'RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a'
CONFIGURATION, NOTES = 'configuration.json', 'notes.json'
FORMAT, CHANGE = 'antenna_drive/recording', 'antenna_drive/change'
FORMAT_VERSION = '1'
# Version 8 is what every rosbag2 since Iron reads; in 9 the quality of service is a list, which
# older ones do not understand.
ROSBAG2_VERSION = 8
FLUSH_S = 0.5
SPLIT_S = 600.0

_CDR_FLOAT64 = struct.Struct('<4sd')  # encapsulation: little-endian CDR
_CDR_HEADER = b'\x00\x01\x00\x00'
# A message record of Float64 as it lies in a chunk: 43 bytes, read by the thousand.
_MESSAGE = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('topic', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8'), ('cdr', 'S4'), ('value', '<f8')])
_MESSAGE_LENGTH = _MESSAGE.itemsize - 9
_FEW = 1024  # messages that are looked at at first
_FOOTER_TAIL = 12  # the summary's checksum and the magic


@dataclass
class _StorageFile:
    """A file of a bag: when it was begun [s], its messages by topic, its time stamps [ns]."""

    name: str
    began_at: float
    counts: list[int]
    first_ns: int = 2**63 - 1
    last_ns: int = -1

    def reaches(self, time_ns: int) -> None:
        """Note the time stamp of a sample."""
        self.first_ns = min(time_ns, self.first_ns)
        self.last_ns = max(time_ns, self.last_ns)

    def span(self) -> dict[str, Any]:
        """Return what rosbag2 says of it."""
        count = sum(self.counts)
        return {
            'starting_time': {'nanoseconds_since_epoch': self.first_ns if count else 0},
            'duration': {'nanoseconds': self.last_ns - self.first_ns if count else 0},
            'message_count': count}


class BagWriter:
    """
    Writes a rosbag2 folder while the drive runs.

    Use it as a context manager, or call `close`; without that the samples are safe up to the
    last `flush`, but metadata.yaml is missing and `read_bag` wants to be told that a part is
    enough.

    Attributes
    ----------
    path : the folder
    written_ns : time stamp of the last sample that is safe in the file [ns], -1 if none is
    synced_ns : time stamp of the last sample that a failure of the power leaves [ns], -1 if none

    """

    def __init__(self, path: str | Path, signals: Mapping[str, str], *,
                 configuration: Mapping[str, Any] | None = None, sheet: TestSheet | None = None,
                 notes: Mapping[str, Any] | None = None, stem: str | None = None,
                 flush_s: float = FLUSH_S, sync_s: float | None = None,
                 split_s: float = SPLIT_S, clock: Callable[[], float] = time.monotonic) -> None:
        """
        Create the folder and write everything that is known before the first sample.

        Parameters
        ----------
        path
            folder that is not there yet
        signals
            name -> unit of each signal that will come
        configuration, sheet, notes
            see Recording
        stem
            first part of the storage file's name; the folder's name if not given
        flush_s
            longest time between chunks, by `clock` and by the time stamps [s]
        sync_s
            after how long by `clock` the disk is made to hold what was written [s], at the end
            of a chunk; None for at the end of each storage file only
        split_s
            how long a storage file becomes, by `clock` or by the time stamps [s]
        clock
            a steady clock [s]

        Raises
        ------
        RecordingError : the folder exists already or cannot be written, or an argument is no
            plain data

        """
        self.path = Path(path)
        self.written_ns = self.synced_ns = -1
        self._sync_s = sync_s
        self._signals = dict(signals)
        self._flush_s = flush_s
        self._flush_ns = flush_s * NANOSECONDS
        self._clock = clock
        self._flushed_at = self._synced_at = clock()
        self._flushed_ns = 0
        self._split_s = split_s
        self._files: list[_StorageFile] = []
        self._stem = stem or self.path.name
        attachments = {
            CONFIGURATION: _as_json(configuration or {}), NOTES: _as_json(notes or {}),
            FILE_NAME: dump_sheet(sheet or TestSheet())}
        refuse_existing(self.path)
        try:
            self.path.mkdir(parents=True)
            self._raw, self._writer = self._opened()
        except FileExistsError:
            raise RecordingError(f'{self.path}: exists already; choose another name') from None
        except OSError as error:
            raise refuse_io(self.path, error) from error
        with self._guarded() as writer:
            self._topics = self._begin(writer, attachments)
            if sync_s is not None:
                self._sync()

    def _opened(self) -> tuple[io.FileIO, Writer | None]:
        """Return the next storage file and what writes it."""
        name = f'{self._stem}_{len(self._files)}.mcap'
        # not buffered: after a full disk nothing may be written that was held back; the writer
        # buffers a raw stream itself
        raw = (self.path / name).open('xb', buffering=0)
        self._files.append(_StorageFile(name, self._clock(), [0] * len(self._signals)))
        return raw, Writer(raw, enable_data_crcs=True)

    def _begin(self, writer: Writer, attachments: Mapping[str, str]) -> list[int]:
        writer.start('ros2')
        writer.add_metadata(FORMAT, {'format': FORMAT_VERSION})
        for name, text in attachments.items():
            kind = 'application/yaml' if name.endswith('.yaml') else 'application/json'
            writer.add_attachment(0, 0, name, kind, text.encode())
        schema = writer.register_schema(MESSAGE_TYPE, 'ros2msg', MESSAGE_DEFINITION)
        topics = [
            writer.register_channel(f'/{name}', 'cdr', schema, {
                'offered_qos_profiles': '', 'unit': unit, 'topic_type_hash': MESSAGE_HASH})
            for name, unit in self._signals.items()]
        writer.flush()
        return topics

    def __enter__(self) -> BagWriter:
        """Return the writer."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Close the bag; after an error leave it as it is, safe up to the last chunk."""
        if kind is None:
            self.close()
        else:
            self._abandon()

    @property
    def closed(self) -> bool:
        """Tell whether the bag was closed or given up after an error."""
        return self._writer is None

    def write(self, step: int, time_ns: int, values: Sequence[float]) -> None:
        """
        Write one sample of every signal.

        Parameters
        ----------
        step
            number of the macro-step
        time_ns
            simulated time [ns], not negative
        values
            one for each signal, in their order; NaN where there is no sample

        Raises
        ------
        RecordingError : the disk is full or the file cannot be written, a value is infinite, or
            the time is negative; what was written before stays readable

        """
        if not 0 <= time_ns < 2**63 or any(map(math.isinf, values)):
            for i, value in enumerate(values):
                self._check(i, time_ns, value)
        if self._full:
            self._split()
        pack, sequence, file = _CDR_FLOAT64.pack, step & 0xFFFFFFFF, self._files[-1]
        with self._guarded() as writer:
            for i, value in enumerate(values):
                if value == value:
                    writer.add_message(self._topics[i], time_ns, pack(_CDR_HEADER, value),
                                       time_ns, sequence)
                    file.counts[i] += 1
        file.reaches(time_ns)
        if (time_ns - self._flushed_ns >= self._flush_ns
                or self._clock() - self._flushed_at >= self._flush_s):
            self.flush()

    def add(self, signal: int, step: int, time_ns: int, value: float) -> None:
        """
        Write one sample of one signal, given by its place in the order of the signals.

        Raises
        ------
        RecordingError : see `write`

        """
        self._check(signal, time_ns, value)
        with self._guarded() as writer:
            writer.add_message(self._topics[signal], time_ns,
                               _CDR_FLOAT64.pack(_CDR_HEADER, value), time_ns, step & 0xFFFFFFFF)
        self._files[-1].counts[signal] += 1
        self._files[-1].reaches(time_ns)

    def _check(self, signal: int, time_ns: int, value: float) -> None:
        if math.isinf(value) or not 0 <= time_ns < 2**63:
            name = list(self._signals)[signal]
            raise RecordingError(f'{name}: {value} at {time_ns} ns cannot be recorded; allowed '
                                 'are finite numbers and times that are not negative')

    def know(self, configuration: Mapping[str, Any]) -> None:
        """
        Write down the configuration, in the place of what was known of it before.

        Raises
        ------
        RecordingError : the file cannot be written, or it is no plain data

        """
        text = _as_json(configuration)
        with self._guarded() as writer:
            writer.add_attachment(0, 0, CONFIGURATION, 'application/json', text.encode())

    def change(self, step: int, unit: str, values: Mapping[str, Any]) -> None:
        """
        Write down that tuning parameters changed and act from `step` on.

        Raises
        ------
        RecordingError : the file cannot be written, or a value is no plain data

        """
        text = _as_json(values, f'{unit}: ')
        with self._guarded() as writer:
            writer.add_metadata(CHANGE, {'step': str(step), 'unit': unit, 'values': text})
        self.flush()

    def flush(self) -> None:
        """
        Complete the chunk, so that what was written so far survives this process.

        Raises
        ------
        RecordingError : the disk is full or the file cannot be written

        """
        with self._guarded() as writer:
            writer.flush()
        self.written_ns = max(file.last_ns for file in self._files)
        self._flushed_ns = max(self.written_ns, 0)
        self._flushed_at = self._clock()
        if self._sync_s is not None and self._flushed_at - self._synced_at >= self._sync_s:
            with self._guarded():
                self._sync()

    @property
    def _full(self) -> bool:
        """Tell whether the storage file is long enough; looked at when a chunk is complete."""
        file = self._files[-1]
        return file.last_ns >= 0 and self.written_ns == file.last_ns and (
            self._flushed_at - file.began_at >= self._split_s
            or file.last_ns - file.first_ns >= self._split_s * NANOSECONDS)

    def _split(self) -> None:
        """Complete the storage file, and begin the next one."""
        with self._guarded() as writer:
            self._complete(writer)
            self._raw.close()
            self._raw, self._writer = self._opened()
        with self._guarded() as writer:
            self._topics = self._begin(writer, {})

    def _complete(self, writer: Writer) -> None:
        writer.finish()
        writer.flush()
        self.written_ns = max(file.last_ns for file in self._files)
        self._sync()

    def _sync(self) -> None:
        os.fsync(self._raw.fileno())
        sync_folder(self.path)
        self.synced_ns = self.written_ns
        self._synced_at = self._clock()

    def close(self) -> None:
        """
        Complete the bag: the index, and metadata.yaml, which ROS 2 tools look for.

        Raises
        ------
        RecordingError : the disk is full or the file cannot be written

        """
        if self._writer is None:
            return
        with self._guarded() as writer:
            self._complete(writer)
            with drafted(self.path / METADATA) as stream:
                stream.write(self._metadata().encode())
            sync_folder(self.path)
        self._abandon()

    def _metadata(self) -> str:
        whole = _StorageFile(
            '', 0.0, [sum(own) for own in zip(*(f.counts for f in self._files), strict=True)],
            min(f.first_ns for f in self._files), max(f.last_ns for f in self._files))
        topics = [
            {'topic_metadata': {
                'name': f'/{name}', 'type': MESSAGE_TYPE, 'serialization_format': 'cdr',
                'offered_qos_profiles': '', 'type_description_hash': MESSAGE_HASH},
             'message_count': number}
            for name, number in zip(self._signals, whole.counts, strict=True)]
        text: str = yaml.safe_dump({'rosbag2_bagfile_information': {
            'version': ROSBAG2_VERSION, 'storage_identifier': 'mcap',
            **whole.span(),
            'topics_with_message_count': topics,
            'compression_format': '', 'compression_mode': '',
            'relative_file_paths': [file.name for file in self._files],
            'files': [{'path': file.name, **file.span()} for file in self._files],
            'custom_data': {}, 'ros_distro': 'unknown'}}, sort_keys=False)
        return text

    @contextmanager
    def _guarded(self) -> Iterator[Writer]:
        """Turn a full disk into one line that says how much is safe, and end the writing."""
        if self._writer is None:
            raise RecordingError(f'{self.path}: the bag is closed')
        try:
            yield self._writer
        except OSError as error:
            self._abandon()
            safe = self.written_ns
            so_far = (f'recorded up to {safe / NANOSECONDS:.3f} s' if safe >= 0
                      else 'nothing recorded')
            raise RecordingError(
                f'{self.path}: cannot be written, {error.strerror or error}; {so_far}') from error

    def _abandon(self) -> None:
        self._writer = None
        self._raw.close()


def _as_json(content: Mapping[str, Any], prefix: str = '') -> str:
    try:
        return to_json(freeze(dict(content)))
    except PlainDataError as error:
        raise RecordingError(f'{prefix}{error}') from None


def write_bag(recording: Recording, path: str | Path) -> None:
    """
    Write a recording as a rosbag2 folder, whole or not at all.

    Raises
    ------
    RecordingError : the folder exists already or cannot be written, or a time stamp is negative,
        which ROS 2 does not know (`Recording.shift` moves it)

    """
    path = Path(path)
    if recording.start_ns < 0:
        raise RecordingError(f'{path}: a time stamp of {recording.start_ns / NANOSECONDS:g} s is '
                             'negative; a bag has none')
    with new_folder(path) as folder:
        with BagWriter(folder / 'bag', {n: recording[n].unit for n in recording},
                       configuration=recording.configuration, sheet=recording.sheet,
                       notes=recording.notes, stem=path.name, flush_s=math.inf) as bag:
            for change in recording.changes:
                bag.change(change.step, change.unit, change.values)
            channels = list(recording.channels.values())
            if channels:
                which = np.repeat(np.arange(len(channels)), [len(c) for c in channels])
                stamps = np.concatenate([c.time_ns for c in channels])
                values = np.concatenate([c.values for c in channels])
                steps = np.concatenate([np.arange(len(c)) for c in channels])
                order = np.lexsort((which, stamps))
                for signal, step, stamp, value in zip(
                        which[order].tolist(), steps[order].tolist(), stamps[order].tolist(),
                        values[order].tolist(), strict=True):
                    bag.add(signal, step, stamp, value)
        for file in (folder / 'bag').iterdir():
            file.rename(folder / file.name)
        (folder / 'bag').rmdir()


# -- reading ----------------------------------------------------------------------------------


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
            if not np.all(own['cdr'] == _CDR_HEADER.rstrip(b'\0')):
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
    files = []
    for name in names:
        file = path / name
        if not _lies_in(path, name):
            raise RecordingError(f'{path / METADATA}: the file {one_line(name, 60)} lies outside '
                                 'the bag')
        files.append(file)
    return files, counts


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
            raise RecordingError(f'{name}: a time stamp is beyond 292 years')
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
